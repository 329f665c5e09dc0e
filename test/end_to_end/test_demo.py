"""`experience demo` from the command line: what it writes, and that nothing is left running."""

import json
import os
from pathlib import Path
import shutil
import signal
import sys

from PIL import Image
import pytest

from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.task_folder import TaskFolder
from experience_cli.commands.learn import digest
from ros_helpers import Process, ROOT, wait_until

pytestmark = pytest.mark.slow
COMMAND = [sys.executable, '-m', 'experience_cli.main', 'demo']


def children_of(pid):
    """Return the processes that a process has started and that still run."""
    found = []
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            fields = path.read_text().rpartition(')')[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != 'Z':
            found.append(int(path.parent.name))
    return found


def is_alive(pid):
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


@pytest.fixture(scope='module')
def shown(ros_domain, tmp_path_factory):
    """Run the demo with both tasks, one by the path of its world, and four trials each."""
    folder = tmp_path_factory.mktemp('demo')
    out = folder / 'out'
    for ending in ('yaml', 'pgm'):
        shutil.copy(ROOT / 'config' / 'worlds' / f'task2.{ending}', folder)
    tasks = f'1,{folder / "task2.yaml"}'
    process = Process([*COMMAND, '--out', str(out), '--trials', '4', '--tasks', tasks], folder)
    assert process.wait(250.0) == 0, process.report()
    return out, process


def test_the_report_has_the_result_of_the_paper(shown):
    report = json.loads((shown[0] / 'report.json').read_text())
    assert list(report['tasks']) == ['task1', 'task2']
    for task in report['tasks'].values():
        assert [trial['trial'] for trial in task['trials']] == [1, 2, 3, 4]
        assert all(set(trial) == {
            'trial', 'steps', 'hidden_neurons', 'reinforcements', 'collisions', 'outcome',
            'seconds'} for trial in task['trials'])
        assert not any(trial['collisions'] for trial in task['trials'])
        assert all(trial['outcome'] == 'goal' for trial in task['trials'][2:])
        assert task['trials'][0]['reinforcements'] > 0
        assert task['trials'][3]['reinforcements'] == 0
        assert task['other_starts']['starts'] >= 20
        assert task['other_starts']['collisions'] == 0


def test_both_tasks_start_from_the_same_demonstrated_field(shown):
    digests = []
    for name in ('task1', 'task2'):
        task = TaskFolder(shown[0] / 'bags', name)
        header = Episode.at(task.find(1).path).header
        relearner = Relearner(header.grid, header.parameters)
        relearner.learn(Episode(task.find(1)))
        digests.append(digest(relearner.field()))
    assert digests[0] == digests[1]


@pytest.mark.parametrize('number', range(2, 8))
def test_the_figures_are_there(shown, number):
    with Image.open(shown[0] / f'figure_{number}.png') as picture:
        assert min(picture.size) > 400
        assert len(picture.convert('RGB').getcolors(1 << 24)) > 20


def test_it_ends_with_a_table_and_the_paths(shown):
    out, process = shown
    assert 'hidden neurons' in process.stdout
    assert 'task1: Drive 0001 kept: 26 steps. From all ' in process.stdout
    assert 'task1: trial 1 (task1/0002) reached the goal in ' in process.stdout
    for word in ('Press t', 'basin', 'poses', 'coherence'):
        assert word not in process.stdout
    for name in ('report.json', 'figure_7.png', 'learning_task2.png', 'learning.png',
                 'bags/task1'):
        assert str(out / name) in process.stdout
    assert '\r' not in process.stdout


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_is_left_running(ros_domain, tmp_path, number):
    process = Process([*COMMAND, '--out', str(tmp_path / 'out'), '--tasks', '1'], tmp_path)
    wait_until(lambda: len(children_of(process.popen.pid)) == 3, processes=[process],
               what='the three nodes')
    children = children_of(process.popen.pid)
    os.kill(process.popen.pid, number)
    code = process.wait()
    wait_until(lambda: not any(map(is_alive, children)), what='the end of the children')
    if number == signal.SIGINT:
        assert code == 130
        assert 'Traceback' not in process.stderr
