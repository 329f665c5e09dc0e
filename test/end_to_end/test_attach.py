"""`experience demo --attach` teaches nodes that others have started, in a namespace, for real."""

from contextlib import ExitStack
import time

import pytest

from bridge_helpers import content_of
from control_field.records import Outcome
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.main import main
import forks
from ros_helpers import Process, start_node, wait_until
from suite_helpers import PARAMETERS

pytestmark = pytest.mark.slow
COMMAND = forks.command('experience_cli.main', 'demo', '--attach', '--trials', '1')


def start_nodes(stack, folder, namespace, lockstep):
    """Start the three nodes in a namespace, as demo.launch.py does."""
    nodes = []
    for name, usual in PARAMETERS.items():
        parameters = {**usual, 'lockstep': lockstep}
        if name == 'sim_node' and not lockstep:
            parameters |= {'speed_factor': 3.0, 'rate': 20.0}
        if name == 'learner_node':
            parameters['bags'] = str(folder / 'bags')
        nodes.append(stack.enter_context(start_node(
            f'{name}.node', folder, parameters, namespace=namespace)))
    return nodes


def whole(task):
    """Return the kinds of a task's bags, but for trials that were broken off and run again."""
    return [episode.kind for episode in task.episodes()
            if getattr(content_of(episode.path).record, 'outcome', None) is not Outcome.ABORTED]


def attach(folder, *arguments):
    process = Process([*COMMAND, *arguments], folder, name='experience')
    code = process.wait(90.0)
    return code, process


@pytest.mark.parametrize(('namespace', 'lockstep'), [('/robots/r1', True), ('/', False)])
def test_it_teaches_and_tries_and_leaves_the_nodes_alone(
    ros_domain, tmp_path, namespace, lockstep,
):
    with ExitStack() as stack:
        nodes = start_nodes(stack, tmp_path, namespace, lockstep)
        code, process = attach(tmp_path, f'--namespace={namespace}')
        assert code == 0, process.report()
        task = TaskFolder(tmp_path / 'bags', 'task1')
        assert whole(task) == [EpisodeKind.DEMO, EpisodeKind.TRIAL]
        # Who was taught is not taught again.
        code, process = attach(tmp_path, f'--namespace={namespace}')
        assert code == 0, process.report()
        assert 'knows the way (2 bags)' in process.stdout
        assert whole(task)[2:] == [EpisodeKind.TRIAL], '\n'.join(
            node.report() for node in nodes)


@pytest.mark.parametrize(('namespace', 'place'), [('/', ''), ('//', ''), ('/r1', '-r __ns:=/r1 ')])
def test_nodes_that_are_not_there_are_named_with_what_starts_them(
    ros_node, monkeypatch, capsys, namespace, place,
):
    # Of who was here before, the middleware may speak for a while.
    wait_until(lambda: ros_node.get_node_names() == [ros_node.get_name()], node=ros_node,
               what='an empty domain')
    monkeypatch.setattr('experience_cli.demo.attach._PATIENCE', 2.0)
    began = time.monotonic()
    assert main(['demo', '--attach', '--namespace', namespace]) == 2
    assert time.monotonic() - began < 20.0
    said = capsys.readouterr()
    assert 'waiting for sim_node, control_field_node and learner_node' in said.out
    [line] = said.err.splitlines()
    for words in ('no sim_node and no control_field_node and no learner_node',
                  f'`sim_node --ros-args {place}-p enable_stamped_cmd_vel:=true`'):
        assert words in line


def test_a_node_that_reads_another_type_is_named_with_the_parameter(ros_domain, tmp_path, capsys):
    with start_node('sim_node.node', tmp_path, {**PARAMETERS['sim_node'], 'lockstep': False,
                                                'enable_stamped_cmd_vel': False}):
        assert main(['demo', '--attach']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert 'sim_node reads cmd_vel as geometry_msgs/msg/Twist,' in line
    assert '-p enable_stamped_cmd_vel:=true' in line


@pytest.mark.parametrize(('arguments', 'words'), [
    (['--tasks', '1,2'], ['--tasks', 'one task']),
    (['--namespace', 'a b'], ["'a b'", 'namespace']),
])
def test_mistakes_are_one_line(quiet_domain, capsys, arguments, words):
    assert main(['demo', '--attach', *arguments]) == 2
    [line] = capsys.readouterr().err.splitlines()
    for word in words:
        assert word in line
