"""`experience page` starts everything, opens a browser where it can, and ends all of it."""

from contextlib import contextmanager, suppress
from pathlib import Path
import re
import signal
import socket
from urllib.request import urlopen

import pytest

from experience_cli.arguments import parser
from experience_cli.commands.page import robot_nodes
import forks
from robot_parameters import check_parameters
from ros_helpers import Process, ROOT, wait_until

ROBOTS = sorted(path.stem for path in (ROOT / 'config/robots').glob('*.yaml'))


@contextmanager
def running(folder, *arguments, **env):
    """Run the command until it has named the address; yield that and the process."""
    command = forks.command('experience_cli.main', 'page', '--bags', str(folder / 'bags'),
                            '--out', str(folder / 'out'), *arguments)
    env = {'DISPLAY': '', 'WAYLAND_DISPLAY': '', **env}
    with Process(command, folder, env, name='experience_page') as process:
        found = wait_until(lambda: re.search(r'http://\S+', process.stdout),
                           processes=[process], what='the address')
        yield found[0], process


def children_of(process):
    """Return the nodes that it has started and that still run."""
    pid = process.popen.pid
    children = Path(f'/proc/{pid}/task/{pid}/children').read_text().split()
    return [child for child in children
            if b'_node.node' in Path(f'/proc/{child}/cmdline').read_bytes()]


@pytest.fixture
def taken_port():
    """Let somebody have the usual port, if nobody has it yet."""
    with suppress(OSError), socket.create_server(('127.0.0.1', 8300)):
        yield
        return
    yield


def test_it_starts_all_opens_a_browser_and_ends_all(tmp_path, ros_domain, taken_port):
    browser, opened = tmp_path / 'browser', tmp_path / 'opened'
    browser.write_text(f'#!/bin/sh\necho "$1" >{opened}\n')
    browser.chmod(0o755)
    with running(tmp_path, BROWSER=f'{browser} %s', DISPLAY=':99') as (address, process):
        assert re.fullmatch(r'http://127\.0\.0\.1:\d+/', address)
        assert not address.endswith(':8300/')
        wait_until(lambda: opened.exists() and opened.read_text(), what='a browser')
        assert opened.read_text().strip() == address
        with urlopen(address) as answer:
            assert answer.status == 200
        nodes = children_of(process)
        assert len(nodes) == 4
        process.stop(signal.SIGINT)
        assert process.stderr == ''
        assert not any(Path('/proc', pid).exists() for pid in nodes)


def test_a_real_robot_needs_no_simulator(tmp_path, ros_domain):
    with running(tmp_path, '--robot', 'turtlebot3_burger') as (address, process):
        assert process.stdout.startswith(f'Open in a browser: {address}\n')
        assert len(children_of(process)) == 4
        assert sorted(path.stem for path in (tmp_path / 'out/logs').iterdir()) == [
            'control_field_node', 'learner_node', 'neighbourhood_node', 'page_node']


@pytest.mark.parametrize('robot', ROBOTS)
def test_what_it_tells_the_nodes_of_a_robot_is_allowed(robot):
    nodes = robot_nodes(parser().parse_args(['page', '--robot', robot]))
    nodes |= {'localised_odometry_node': {}, 'teleop_node': {}}
    check_parameters(nodes)
    assert nodes['page_node']['enable_stamped_cmd_vel'] is robot.startswith('turtlebot3')
    assert nodes['learner_node']['simulation'] is False


@pytest.mark.long
def test_a_port_that_is_asked_for_and_taken_is_one_line(tmp_path, ros_domain):
    with socket.create_server(('127.0.0.1', 0)) as other:
        command = forks.command('experience_cli.main', 'page', '--no-browser', '--port',
                                str(other.getsockname()[1]), '--out', str(tmp_path / 'out'))
        with Process(command, tmp_path) as process:
            assert process.wait() == 2
    [line] = process.stderr.splitlines()
    assert line.startswith('experience page: page_node ended with code 2: page_node: ')
    assert 'port' in line


@pytest.mark.parametrize(('words', 'said'), [
    (['--world', 'atlantis'], '--world atlantis: '),
    (['--robot', 'hal'], '--robot hal: '),
    (['--robot', 'hal.yaml'], 'hal.yaml'),
    (['--robot', 'turtlebot3_burger', '--world', 'open'], 'is for a simulated robot'),
    (['--task', '../elsewhere'], '--task ../elsewhere: '),
])
def test_mistakes_are_one_line(mistake, words, said):
    assert said in mistake('page', *words)


def test_a_file_that_leaves_a_node_out_is_named(mistake, tmp_path):
    path = tmp_path / 'robot.yaml'
    path.write_text('/**/control_field_node: {ros__parameters: {v_max: 0.2}}\n')
    assert 'says nothing of neighbourhood_node' in mistake('page', '--robot', path)
