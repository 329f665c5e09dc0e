"""What the demo waits for, in words."""

from types import SimpleNamespace

import pytest

from experience_cli.demo.peers import absent_nodes, mistyped, start_hint, what_is_missing

IDLE = {'phase': 'idle', 'heard': 'odom neighbourhood trial'}


def test_absent_nodes_are_those_that_are_not_there():
    assert absent_nodes(['sim_node', 'rviz']) == ['control_field_node', 'learner_node']
    assert absent_nodes(['learner_node', 'control_field_node', 'sim_node']) == []


@pytest.mark.parametrize(('absent', 'has_odometry', 'learner', 'words'), [
    (['sim_node'], True, IDLE, 'sim_node'),
    (['sim_node', 'learner_node'], False, {}, 'sim_node and learner_node'),
    ([], False, IDLE, 'odometry on odom'),
    ([], True, {}, 'the state of learner_node on /diagnostics'),
    ([], True, {**IDLE, 'phase': 'learning', 'doing': 'learning'}, 'busy: learning'),
    ([], True, {**IDLE, 'heard': 'odom'}, 'to hear neighbourhood and trial'),
    ([], True, IDLE, 'find each other'),
])
def test_what_is_missing_is_said_in_words(absent, has_odometry, learner, words):
    assert words in what_is_missing(absent, has_odometry, learner)


def test_the_hint_can_be_copied():
    assert start_hint(['sim_node'], '/') == (
        '`sim_node --ros-args -p enable_stamped_cmd_vel:=true`')
    assert start_hint(['learner_node'], '/r1') == (
        '`learner_node --ros-args -r __ns:=/r1 -p enable_stamped_cmd_vel:=true '
        '-p simulation:=true -p task:=task1`')


def test_only_our_nodes_must_read_the_stamped_type():
    others = [SimpleNamespace(node_name='recorder', topic_type='geometry_msgs/msg/Twist'),
              SimpleNamespace(node_name='sim_node', topic_type='geometry_msgs/msg/TwistStamped')]
    assert mistyped(others) == ''
    wrong = SimpleNamespace(node_name='learner_node', topic_type='geometry_msgs/msg/Twist')
    assert 'learner_node reads cmd_vel as geometry_msgs/msg/Twist' in mistyped([*others, wrong])
