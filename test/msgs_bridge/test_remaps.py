"""Remappings that change nothing are named; those that do, and shared ones, are not warned of."""

from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

from msgs_bridge.node.remaps import idle_rules, note_subscription, problem_with_special
import ros_helpers


@pytest.fixture
def rules_of(ros_domain):
    """Return what is said of rules that a node was started with."""
    context = rclpy.Context()

    def start(*rules):
        arguments = ['--ros-args', '-r', '__ns:=/r1', *(
            word for rule in rules for word in ('-r', rule))]
        rclpy.init(args=arguments, context=context, domain_id=ros_domain)
        node = Node('sim_node', context=context)
        node.create_publisher(Odometry, 'odom', 1)
        node.create_subscription(Odometry, 'wheels', lambda _: None, 1)
        node.create_service(Trigger, '~/reset', lambda _, answer: answer)
        node.create_client(Trigger, 'learner_node/undo')
        note_subscription(node.resolve_topic_name('heard_aside'))
        said = idle_rules(rules, node, 'sim_node')
        node.destroy_node()
        return said

    yield start
    context.try_shutdown()


@pytest.mark.parametrize('rule', [
    'odom:=base/odom', '/r1/odom:=/robot/odom', 'odom:=/odom', 'wheels:=w', '~/reset:=again',
    'learner_node/undo:=u', 'heard_aside:=aside', 'sim_node:odom:=base/odom', '__node:=other'])
def test_what_changes_something_is_not_said(rules_of, rule):
    assert rules_of(rule) == ([], [])


@pytest.mark.parametrize(('rule', 'words'), [
    ('odmo:=x', 'sim_node has no odmo, is odom meant?'), ('odon:=x', 'is odom meant?'),
    ('/odom:=x/odom', 'sim_node has no /odom'), ('~/rest:=x', 'is ~/reset meant?'),
    ('lights:=x', 'sim_node has no lights'), (
        'robot:odom:=x', 'is for a node robot, this one is')])
def test_what_changes_nothing_is_named(rules_of, rule, words):
    warnings, notes = rules_of(rule)
    [line] = [*warnings, *notes]
    assert f'-r {rule} ' in line
    assert 'changes nothing' in line
    assert words in line


def test_a_slip_beside_a_rule_for_the_topic_itself(rules_of):
    [line], _ = rules_of('odom:=base/odom', 'odmo:=x')
    assert 'is odom meant?' in line


@pytest.mark.parametrize('rule', ['/tf:=tf', 'scan:=front_scan', 'cmd_vel_teleop:=joy_vel'])
def test_what_a_launch_file_gives_to_all_nodes_is_no_warning(rules_of, rule):
    warnings, [_] = rules_of(rule)
    assert warnings == []


@pytest.mark.parametrize(('rule', 'near'), [
    ('__nss:=/x', '__ns'), ('__nod:=x', '__node'), ('sim_node:__nmae:=x', '__name'),
    ('__log:=x', '__ns or __node')])
def test_what_cannot_be_set_is_refused(rule, near):
    assert problem_with_special(['odom:=x', rule]) == (
        f'-r {rule}: there is no {rule.partition(":=")[0].rpartition(":")[2]} to set, is {near} '
        f'meant?')
    assert problem_with_special(['__ns:=/x', '__node:=a', '__name:=b', 'odom:=__x']) == ''


def test_a_node_says_it_in_a_line(quiet_domain, tmp_path):
    command = ros_helpers.node_command('sim_node.node', tmp_path, remappings={'__nss': '/x'})
    process = ros_helpers.run(command, tmp_path)
    assert process.popen.returncode == 2
    assert process.stderr == 'sim_node: -r __nss:=/x: there is no __nss to set, is __ns meant?\n'
    with ros_helpers.start_node(
            'sim_node.node', tmp_path, remappings={'odmo': 'wheels/odom'}) as process:
        ros_helpers.wait_until(lambda: 'is odom meant?' in process.stderr, processes=[process])


@pytest.mark.parametrize(('module', 'topics'), [
    ('control_field_node.node', [
        'odom', 'neighbourhood', 'goal_pose', 'contact', 'cmd_vel', 'cmd_vel_teleop', 'trial',
        'teleop_heartbeat', 'control_field', 'experience', 'cmd_vel_requested', '/diagnostics',
        '~/start_trial', '~/stop_trial']),
    ('learner_node.node', [
        'odom', 'neighbourhood', 'goal_pose', 'contact', 'cmd_vel', 'initialpose', 'trial',
        'teleop_heartbeat', 'control_field', 'prototypes', 'experience', '/diagnostics', '~/undo',
        'control_field_node/start_trial']),
    ('neighbourhood_node.node', ['odom', 'scan', 'neighbourhood'])])
def test_a_node_knows_all_its_topics(quiet_domain, tmp_path, module, topics):
    remappings = {topic: f'/other/name{number}' for number, topic in enumerate(topics)}
    with ros_helpers.start_node(
            module, tmp_path, {'bags': str(tmp_path)} if 'learner' in module else None,
            remappings={**remappings, 'nothing_of_ours': 'x'}) as process:
        ros_helpers.wait_until(lambda: 'changes nothing' in process.stderr, processes=[process])
    [line] = [line for line in process.stderr.splitlines() if 'changes nothing' in line]
    assert 'nothing_of_ours' in line
