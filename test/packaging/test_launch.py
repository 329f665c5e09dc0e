"""The launch file, its parameters and the RViz view name what exists."""

import ast
from dataclasses import fields
from importlib.metadata import distribution
from importlib.util import module_from_spec, spec_from_file_location
from types import SimpleNamespace

import pytest
import yaml

from experience_cli.arguments import parser
from learner_node.settings import Settings
from ros_helpers import ROOT

LAUNCH = ROOT / 'launch/demo.launch.py'
TOPICS = {'map', 'neighbourhood', 'markers', 'movers', 'control_field', 'prototypes', 'odom'}


def strings_of_calls(function):
    """Return the first argument of every call of a function in the launch file."""
    nodes = ast.walk(ast.parse(LAUNCH.read_text()))
    calls = [node for node in nodes if isinstance(node, ast.Call)]
    return {call.args[0].value for call in calls
            if getattr(call.func, 'id', '') == function and isinstance(call.args[0], ast.Constant)}


def test_it_starts_our_executables():
    ours = {entry.name for entry in distribution('experience_controller').entry_points}
    assert strings_of_calls('node') == {'sim_node', 'control_field_node', 'learner_node'} & ours


def test_what_teaches_is_ours_and_understood():
    assert strings_of_calls('ExecutableInPackage') == {'experience'}
    text = LAUNCH.read_text()
    options = [option for option in (
        '--attach', '--tasks', '--trials', '--movers=', '--namespace=') if f"'{option}" in text]
    assert len(options) == 5
    arguments = parser().parse_args(['demo', '--attach', '--tasks', '1', '--trials', '2',
                                     '--movers=', '--namespace='])
    assert (arguments.attach, arguments.movers, arguments.namespace) == (True, '', '')


def test_every_argument_is_declared():
    declared = strings_of_calls('DeclareLaunchArgument')
    used = strings_of_calls('LaunchConfiguration') | strings_of_calls('argument')
    assert used == declared


def test_the_learner_knows_its_parameters():
    parameters = yaml.safe_load((ROOT / 'config/demo.yaml').read_text())
    names = {name for node in parameters.values() for name in node['ros__parameters']}
    assert names <= {field.name for field in fields(Settings)}


def test_rviz_shows_every_topic_in_the_frame_of_the_workspace():
    view = yaml.safe_load((ROOT / 'config/experience.rviz').read_text())['Visualization Manager']
    topics = {display['Topic']['Value'] for display in view['Displays'] if 'Topic' in display}
    assert topics == TOPICS
    assert view['Global Options']['Fixed Frame'] == 'odom'


def test_launch_reads_it():
    """Runs where ROS is installed: launch is not on the Python package index."""
    pytest.importorskip('launch_ros')
    spec = spec_from_file_location('demo_launch', LAUNCH)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    assert len(module.generate_launch_description().entities) == 9 + 3 + 3 + 1 + 2


def test_it_keeps_its_nodes_to_this_machine_and_a_domain_of_this_user():
    text = LAUNCH.read_text()
    assert "'discovery', default_value='LOCALHOST'" in text
    assert {'ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'} == strings_of_calls(
        'SetEnvironmentVariable')
    tree = ast.parse(text)
    [function] = [node for node in tree.body if getattr(node, 'name', '') == 'own_domain']
    names = {'os': SimpleNamespace(environ={}, getuid=lambda: 1099)}
    exec(compile(ast.Module([function], []), 'launch', 'exec'), names)
    assert names['own_domain']() == '100'
    names['os'].environ['ROS_DOMAIN_ID'] = '7'
    assert names['own_domain']() == '7'


def test_the_recipe_keeps_its_nodes_apart_too():
    recipe = (ROOT / 'README.md').read_text().split('## Teach it yourself')[1].split('```')[1]
    first, *others = recipe.strip().splitlines()
    assert first.startswith('export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_DOMAIN_ID=')
    assert any(line.startswith('sim_node') for line in others)
