"""A node's command line: help, what is no argument, and parameters that there are not."""

from difflib import get_close_matches
from itertools import permutations
import json

import pytest
from rclpy.parameter import Parameter

from control_field.parameters import Parameters
from control_field_node import settings as controller
from control_field_node.settings import DECISION_PARAMETERS
from learner_node import settings as learner
from localised_odometry_node.fusion import LocalisedSettings
from msgs_bridge.node.command_line import (
    _SLIP, ALIKE, check_names, Given, names_of, split_arguments)
from msgs_bridge.node.parameter_files import names_for_all
from neighbourhood_node.settings import NeighbourhoodSettings
from page_node import settings as page
import ros_helpers
from sim_node.settings import SimSettings
from teleop_node import settings as teleop

NODES = {
    'sim_node.node': [SimSettings], 'control_field_node.node': [controller.Settings],
    'learner_node.node': [Parameters, learner.Settings], 'teleop_node.node': [teleop.Settings],
    'neighbourhood_node.node': [NeighbourhoodSettings],
    'localised_odometry_node.node': [LocalisedSettings], 'page_node.node': [page.Settings]}


def run(module, folder, *arguments):
    command = ros_helpers.node_command(module, folder)
    return ros_helpers.run([*command, *arguments], folder)


def mistake(module, folder, *arguments):
    """Return the one line that a process says before it ends with 2."""
    process = run(module, folder, *arguments)
    assert process.popen.returncode == 2, process.report()
    [line] = process.stderr.splitlines()
    assert process.stdout == ''
    return line


@pytest.mark.parametrize('module', NODES)
def test_help_is_a_page_that_names_every_parameter(quiet_domain, tmp_path, module):
    process = run(module, tmp_path, '--help')
    assert (process.popen.returncode, process.stderr) == (0, '')
    lines = process.stdout.splitlines()
    name = module.removesuffix('.node')
    assert lines[0].startswith(f'{name}: ')
    assert len(lines) < 30
    assert max(map(len, lines)) <= 100
    assert f'{name} --ros-args -p ' in process.stdout
    assert 'doc/parameters.md' in process.stdout
    words = process.stdout.replace(',', ' ').split()
    assert {spec for kind in NODES[module] for spec in kind.__dataclass_fields__} <= set(words)


def test_help_is_given_whatever_else_is_said(quiet_domain, tmp_path):
    process = run('sim_node.node', tmp_path, '-h', '--ros-args', '-p', 'rat:=1')
    assert process.popen.returncode == 0
    assert process.stdout.startswith('sim_node: ')


@pytest.mark.parametrize(('arguments', 'words'), [
    (['world:=task1'], ["'world:=task1'", '--ros-args -p', '--help']),
    (['--ros-args', '-p', 'world:=task1', '--', 'more'], ["'more'"]),
    (['--ros-args', '-p', 'cmd_vel_timeot:=0.1'], ["'cmd_vel_timeot'", 'cmd_vel_timeout']),
    (['--ros-args', '-p', 'sim_node:rat:=5.0', '-p', 'qqq:=1'], ["'rat' (is rate meant?)"]),
    (['--ros-args', '-p', 'robot:rate:=5.0'], ['-p robot:rate is for /robot', '/sim_node']),
    (['--ros-args', '-p', 'sim_node:rate:=5.0', '-r', '__ns:=/a'], ['-p rate:=', '/a/sim_node']),
    (['--ros-args', '-p', 'rate:=0.5'], ['rate is 0.5', 'between 1.0 and 1000.0 [1/s]']),
    (['--ros-args', '-p', 'seed:=-1'], ['seed is -1', 'between 0 and']),
    (['--ros-args', '-p', 'rate'], ["'-p rate'"]),
    (['--ros-args', '-p'], ['-p']),
    (['--ros-args', '-r', '__node:=1x'], ['1x']),
    (['--ros-args', '--params-file', '/nowhere.yaml'], ['/nowhere.yaml']),
    (['--ros-args', '--log-level', 'loud'], ['loud']),
    (['--ros-args', '--nonsense'], ['--nonsense'])])
def test_a_mistake_is_one_line_and_exit_code_2(quiet_domain, tmp_path, arguments, words):
    line = mistake('sim_node.node', tmp_path, *arguments)
    assert line.startswith('sim_node: ')
    for word in words:
        assert word in line


def parameter_file(folder, **sections):
    path = folder / 'parameters.yaml'
    path.write_text(json.dumps({
        {'everybody': '/**', 'robots': '/robot/*'}.get(name, f'/**/{name}'): {
            'ros__parameters': values} for name, values in sections.items()}))
    return ['--ros-args', '--params-file', str(path)]


def test_a_name_under_this_node_in_a_file_has_to_be_one_of_its_own(quiet_domain, tmp_path):
    arguments = parameter_file(tmp_path, everybody={'rows': 5}, control_field_node={'v_mx': 0.1})
    assert "'v_mx' (is v_max" in mistake('control_field_node.node', tmp_path, *arguments)


def test_a_file_for_several_nodes_may_hold_names_of_others(ros_domain, ros_node, tmp_path):
    arguments = parameter_file(
        tmp_path, everybody={'rows': 5, 'robot_radius': 0.2, 'diagnostic_updater': {'period': 1},
                             'odom_timout': 0.2, 'v_mx': 0.05, 'seed': 3},
        learner_node={'task': 'x'})
    command = ros_helpers.node_command('control_field_node.node', tmp_path)
    with ros_helpers.Process([*command, *arguments], tmp_path) as process:
        ros_helpers.wait_until(lambda: 'waits for' in process.stderr, processes=[process])
        first, second = [line for line in process.stderr.splitlines() if 'parameter file' in line]
    assert "'odom_timout' (is odom_timeout" in first
    assert "'v_mx' (is v_max" in second


def test_names_of_one_node_are_no_slips_of_another_ones():
    nodes = [set(names_of(*kinds)) for kinds in NODES.values()]
    nodes[1] |= set(DECISION_PARAMETERS)
    alike = {name for ours, others in permutations(nodes, 2) for name in others - ours
             if get_close_matches(name, ours, 1, _SLIP)}
    assert alike <= ALIKE


def test_a_name_that_is_like_none_changes_nothing_and_that_is_said(quiet_domain, tmp_path):
    command = ros_helpers.node_command('sim_node.node', tmp_path)
    arguments = ['--ros-args', '-p', 'auto_trials:=3', '-p', 'sim_node:qqq:=1']
    with ros_helpers.Process([*command, *arguments], tmp_path) as process:
        ros_helpers.wait_until(lambda: "'qqq' here" in process.stderr, processes=[process])
    for name in ('auto_trials', 'qqq'):
        assert process.stderr.count(f'no parameter {name!r} here') == 1


class TestGiven:
    def test_ros_arguments_stand_between_two_marks(self):
        assert split_arguments(['a', '--ros-args', '-p', 'b:=1', '--', '-c', '--ros-args']) == (
            ['a', '-c'], ['-p', 'b:=1'])

    def test_names_are_sorted_by_whom_they_were_given(self, tmp_path):
        arguments = parameter_file(tmp_path, everybody={'a': 1, 'b': 2}, robots={'n': {'c': 3}},
                                   me={'d': 4})
        assert names_for_all(tmp_path / 'parameters.yaml') == {'a', 'b', 'n.c'}
        given = Given()
        given.take(['program', *arguments, '--param', 'a:=9', '-p', 'me:e:=5'])
        assert given.unknown(['a', 'b', 'n.c', 'd', 'e']) == (['a', 'd', 'e'], ['b', 'n.c'])

    @pytest.mark.parametrize('text', ['[1, 2', '3', '', '/**: 3', '/**: {ros__parameters: 3}'])
    def test_what_is_no_parameter_file_names_nothing(self, tmp_path, text):
        (tmp_path / 'file').write_text(text)
        assert names_for_all(tmp_path / 'file') == set()
        assert names_for_all(tmp_path / 'nowhere') == set()


def test_a_node_made_in_python_is_checked_too(ros_domain):
    overrides = [Parameter('pwer', value=1)]
    with ros_helpers.own_node(ros_domain, parameter_overrides=overrides) as node:
        node.declare_parameter('power', 2)
        with pytest.raises(ValueError, match="'pwer' \\(is power meant"):
            check_names(node)
