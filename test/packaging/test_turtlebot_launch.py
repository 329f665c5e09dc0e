"""The launch file for TurtleBots and its robots' files name what exists, and fit together."""

import ast
from dataclasses import fields
from importlib.util import module_from_spec, spec_from_file_location
import math

import pytest
from rcl_interfaces.srv import GetParameters
import yaml

from control_field.robot.footprint import footprint_from_text
from neighbourhood_node.settings import NeighbourhoodSettings
from robot_parameters import check_parameters, KINDS
import ros_helpers
from ros_helpers import ROOT, start_node

LAUNCH = ROOT / 'launch/turtlebot.launch.py'
ROBOTS = sorted((ROOT / 'config/robots').glob('*.yaml'))
WORKSPACE = ('frame_id', 'rows', 'cols', 'resolution', 'origin_x', 'origin_y')


def calls(function):
    """Return the calls of a function in the launch file."""
    return [node for node in ast.walk(ast.parse(LAUNCH.read_text()))
            if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == function]


def first_arguments(function):
    return {call.args[0].value for call in calls(function)
            if isinstance(call.args[0], ast.Constant)}


def parameters(robot, node):
    text = yaml.safe_load(robot.read_text())
    return text.get(f'/**/{node}', {}).get('ros__parameters', {})


def test_arguments_are_declared_and_used():
    declared = first_arguments('DeclareLaunchArgument')
    assert first_arguments('LaunchConfiguration') | first_arguments('argument') == declared
    assert {'namespace', 'enable_stamped_cmd_vel', 'scan', 'bags', 'task', 'robot'} <= declared


def test_it_knows_every_robot():
    robot, = (call for call in calls('DeclareLaunchArgument') if call.args[0].value == 'robot')
    choices, = (word.value for word in robot.keywords if word.arg == 'choices')
    assert {choice.value for choice in choices.elts} == {path.stem for path in ROBOTS}


def test_what_it_sets_are_parameters_of_its_nodes():
    nodes = {call.args[0].value: call.args[1] for call in calls('node')}
    assert set(nodes) == set(KINDS) - {'teleop_node', 'page_node'}
    for name, keys in nodes.items():
        if isinstance(keys, ast.Dict):
            known = {field.name for kind in KINDS[name] for field in fields(kind)}
            assert {key.value for key in keys.keys if key is not None} <= known


@pytest.mark.parametrize('robot', ROBOTS, ids=lambda path: path.stem)
class TestRobots:
    def test_every_value_is_allowed(self, robot):
        check_parameters({node.removeprefix('/**/'): section['ros__parameters'] for node, section
                          in yaml.safe_load(robot.read_text()).items()})

    def test_both_nodes_have_the_same_workspace_and_body(self, robot):
        local_grid, learner = (parameters(robot, name) for name in (
            'neighbourhood_node', 'learner_node'))
        assert [local_grid.get(key) for key in WORKSPACE] == [
            learner.get(key) for key in WORKSPACE]
        controller = parameters(robot, 'control_field_node')
        assert local_grid['robot_radius'] == controller['robot_radius'] == learner['robot_radius']
        assert local_grid.get('footprint', '') == controller.get('footprint', '')
        outline = footprint_from_text(controller.get('footprint', ''))
        if outline is not None:
            around = outline.circumscribed
            assert around <= controller['robot_radius'] < around + 0.002

    def test_the_workspace_fits_itself(self, robot):
        assert not NeighbourhoodSettings(**parameters(robot, 'neighbourhood_node')).is_bounded

    def test_the_body_fits_into_a_cell_and_the_start_is_a_centre(self, robot):
        local_grid = NeighbourhoodSettings(**parameters(robot, 'neighbourhood_node'))
        assert 2.0 * local_grid.robot_radius < local_grid.grid.resolution
        cell = local_grid.grid.cell_from_world(0.0, 0.0)
        assert math.hypot(*local_grid.grid.world_from_cell(*cell)) < 1e-9


@pytest.mark.parametrize('name', ['turtlebot3_burger', 'jackal'])
def test_the_node_reads_it(name, ros_node, tmp_path):
    robot = ROOT / f'config/robots/{name}.yaml'
    process = start_node('neighbourhood_node.node', tmp_path,
                         arguments=['--ros-args', '--params-file', str(robot), '--'])
    with process:
        answer = ros_helpers.call(
            ros_node, GetParameters, '/neighbourhood_node/get_parameters',
            GetParameters.Request(names=['laser_x', 'robot_radius']))
        expected = parameters(robot, 'neighbourhood_node')
        assert [value.double_value for value in answer.values] == [
            expected['laser_x'], expected['robot_radius']]


def test_launch_reads_it():
    """Runs where ROS is installed: launch is not on the Python package index."""
    pytest.importorskip('launch_ros')
    spec = spec_from_file_location('turtlebot_launch', LAUNCH)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    assert len(module.generate_launch_description().entities) == (
        len(calls('DeclareLaunchArgument')) + 1 + 4)
