"""Parameter files: whose section is whose, and that none is dropped without a word."""

import json

import pytest
import rclpy
from rclpy.node import Node

from msgs_bridge.node.parameter_files import is_for, problem_with_file, sections_of
import ros_helpers

SECTIONS = ('me', '/me', '/**', '**', '*', '/*', '/**/me', '**/me', '/*/me', '*/me', '/*/*',
            '/**/*', 'ns/me', '/ns/me', '/ns/**', '/ns/*', '/a/**/me', '/**/ns/me', '/**/ns/**',
            '/**/a/**', '/a/*/me', 'you', '/ns', '/ns/you', '/**/you', '/me/**')
FULL_NAMES = ('/me', '/ns/me', '/a/ns/me')


def write(folder, sections, name='parameters.yaml'):
    path = folder / name
    path.write_text(json.dumps(sections))
    return path


def filled(*names):
    return {name: {'ros__parameters': {'v_max': 0.05}} for name in names}


def given(path, full_name, context):
    """Return what ROS itself gives a node from a file."""
    namespace, _, name = full_name.rpartition('/')
    node = Node(name, namespace=namespace, context=context, use_global_arguments=False,
                cli_args=['--ros-args', '--params-file', str(path)], enable_rosout=False,
                start_parameter_services=False)
    try:
        return set(node._parameter_overrides)
    finally:
        node.destroy_node()


def test_a_section_is_for_a_node_just_where_ros_says_so(ros_domain, tmp_path):
    content = {section: {'ros__parameters': {f'p{i}': 1}} for i, section in enumerate(SECTIONS)}
    content['a'] = {'ns': {'me': {'ros__parameters': {'deep': 1}}}}
    path = write(tmp_path, content)
    sections = {section: set(values) for section, values in sections_of(path).items()}
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=ros_domain)
    try:
        for full_name in FULL_NAMES:
            ours = set().union(*(names for section, names in sections.items()
                                 if is_for(section, full_name)))
            assert ours == given(path, full_name, context), full_name
    finally:
        context.try_shutdown()


@pytest.mark.parametrize(('sections', 'words'), [
    (['control_field_node'], ['its sections are control_field_node:',
                              'call the section control_field_node /robot1/control_field_node',
                              'or /**/control_field_node']),
    (['/robot2/control_field_node', '/**/sim_node'], ['are /robot2/control_field_node, /**/sim']),
    (['/**/control_feild_node'], ['call the section /**/control_feild_node /robot1/control_']),
    (['learner_node'], ['its sections are learner_node: /**/control_field_node would be for']),
    (['/**', 'control_field_node'], ['the section control_field_node of', 'is not for /robot1/c']),
    (['/**', 'controlfield_node'], ['the section controlfield_node of']),
    ([], ['has no section'])])
def test_what_is_for_no_node_is_named_with_what_to_write(tmp_path, sections, words):
    path = write(tmp_path, filled(*sections))
    said = problem_with_file(path, '/robot1/control_field_node', ['control_field_node'])
    for word in [*words, str(path), '/robot1/control_field_node']:
        assert word in said
    assert '\n' not in said


@pytest.mark.parametrize('sections', [
    ['/**'], ['/**/control_field_node', '/**/sim_node'], ['/robot1/*', 'learner_node'],
    ['/**', '/robot2/control_field_node'], ['/**', '/**/sim_node', 'teleop_node'],
    ['control_field_node', '/robot1/control_field_node'], ['/**', 'amcl', 'bt_navigator']])
def test_a_file_that_several_nodes_share_is_none_of_those(tmp_path, sections):
    path = write(tmp_path, filled(*sections))
    assert not problem_with_file(path, '/robot1/control_field_node', ['control_field_node'])


def test_a_renamed_node_may_be_meant_by_the_name_of_its_executable(tmp_path):
    path = write(tmp_path, filled('/**', 'sim_node'))
    assert problem_with_file(path, '/robot', ['robot', 'sim_node'])


TWICE = """
me:
  ros__parameters: {v_max: 0.05, plan: {a: 1}}
you:
  ros__parameters: {v_max: 0.1, v_max: 0.3}
/**:
  ros__parameters: {v_max: 0.2}
me:
  ros__parameters:
    w_max: 1.0
    LAST
"""


@pytest.mark.parametrize(('last', 'words'), [
    ('v_max: 0.22', 'sets v_max twice, in line 3 and in line 11: keep one of them'),
    ('plan.a: 2', 'sets plan.a twice, in line 3 and in line 11: keep one of them'),
    ('odom_timeout: 0.3', '')])
def test_a_parameter_that_is_set_twice_is_said(tmp_path, last, words):
    path = tmp_path / 'parameters.yaml'
    path.write_text(TWICE.replace('LAST', last))
    said = problem_with_file(path, '/me', ['me'])
    assert words in said if words else not said
    assert set(sections_of(path)) == {'me', 'you', '/**'}


def test_a_long_file_is_named_in_part(tmp_path):
    path = write(tmp_path, filled(*(f'node{i}' for i in range(40))))
    said = problem_with_file(path, '/me', ['me'])
    assert 'node11 and 28 more' in said


@pytest.mark.parametrize('arguments', [['-r', '__ns:=/robot1'], ['-r', '__node:=controller']])
def test_a_node_refuses_a_file_without_a_section_for_it(quiet_domain, tmp_path, arguments):
    path = write(tmp_path, filled('control_field_node'))
    other = write(tmp_path, filled('/**'), 'other.yaml')
    command = ros_helpers.node_command('control_field_node.node', tmp_path)
    process = ros_helpers.run([*command, '--ros-args', '--params-file', str(other),
                               '--params-file', str(path), *arguments], tmp_path)
    assert process.popen.returncode == 2
    [line] = process.stderr.splitlines()
    assert line.startswith(f'control_field_node: no section of {path} is for /')
    assert 'its sections are control_field_node' in line
