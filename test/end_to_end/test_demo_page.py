"""`experience demo --page`: seen in a browser from when somebody looks, until Ctrl-C."""

from contextlib import contextmanager
import json
from pathlib import Path
import re
import signal
import sys
from urllib.request import urlopen

import pytest
from websockets.sync.client import connect

from ros_helpers import Process, wait_until

pytestmark = pytest.mark.slow
COMMAND = [sys.executable, '-m', 'experience_cli.main', 'demo']
NODES = ('sim_node', 'control_field_node', 'learner_node', 'page_node')


@contextmanager
def shown(folder, *arguments):
    """Run the demo until it waits for somebody who looks; yield the address and the process."""
    command = [*COMMAND, '--page', '--no-browser', '--out', str(folder / 'out'), *arguments]
    with Process(command, folder, {'PYTHONUNBUFFERED': '1'}, name='demo') as process:
        wait_until(lambda: 'begins when somebody looks' in process.stdout, processes=[process],
                   what='the demo to be ready')
        yield re.search(r'http://\S+/', process.stdout)[0], process


def nodes_of(process):
    """Return the nodes that it has started and that still run."""
    pid = process.popen.pid
    children = Path(f'/proc/{pid}/task/{pid}/children').read_text().split()
    return [child for child in children
            if b'_node.node' in Path(f'/proc/{child}/cmdline').read_bytes()]


def test_it_waits_for_somebody_who_looks_and_can_be_ended_before(tmp_path, ros_domain):
    with shown(tmp_path) as (address, process):
        with urlopen(address) as answer:
            assert answer.status == 200
        nodes = nodes_of(process)
        assert len(nodes) == len(NODES)
        assert not list((tmp_path / 'out/bags/dead_ends').glob('0*'))
        process.send(signal.SIGINT)
        assert process.wait() == 130
        assert process.stderr == 'experience demo: stopped\n'
        assert not any(Path('/proc', pid).exists() for pid in nodes)


@pytest.mark.long
def test_it_shows_the_demo_and_then_the_page_stays(tmp_path, ros_domain):
    with shown(tmp_path, '--tasks', 'task1', '--trials', '2') as (address, process):
        here = address.replace('http', 'ws') + 'view'
        with connect(here, origin=address.rstrip('/'), max_size=None) as viewer:
            kinds, n_seen = set(), 0
            while not {'field', 'robot', 'state'} <= kinds:
                kinds |= kinds_in(viewer.recv(120.0))
                n_seen += 1
                viewer.send(json.dumps({'seen': n_seen}))
            wait_until(lambda: 'the page stays' in process.stdout, 300.0, processes=[process],
                       what='the end of the demo')
        assert 'task1: trial 2' in process.stdout
        report = json.loads((tmp_path / 'out/report.json').read_text())
        assert len(report['tasks']['task1']['trials']) == 2
        with urlopen(f'{address}api/story?task=task1') as answer:
            assert len(json.load(answer)['episodes']) == 3
        process.stop(signal.SIGINT)


def kinds_in(message):
    """Return the types of the frames in a message of the view."""
    if isinstance(message, str):
        return {frame['type'] for frame in json.loads(message)}
    size = int.from_bytes(message[:4], 'little')
    return {json.loads(message[4:4 + size])['type']}


@pytest.mark.parametrize(('arguments', 'why'), [
    (['--page', '--attach'], '--page: is not for --attach'),
    (['--no-browser'], '--no-browser: is for --page only'),
    (['--page', '--tasks', '1,2'], 'with --page one task'),
])
def test_what_does_not_go_together_is_said(tmp_path, arguments, why):
    process = Process([*COMMAND, *arguments], tmp_path)
    assert process.wait(60.0) == 2
    assert why in process.stderr
    assert process.stderr.count('\n') == 1
