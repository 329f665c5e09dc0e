from array import array
import math
import os
import signal
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters

from control_field.grid import Grid
from control_field.records import ControlField, Kind, Outcome
from control_field.robot.stop_rules import StopReason
from controller_helpers import GRID, straight_field
from controller_peer import controller, Peer, simulator, velocity_of
from msgs_bridge.messages.poses import initialpose_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.messages.trial_status import State
from msgs_bridge.node import qos
import ros_helpers


@pytest.fixture
def peer(ros_node, tmp_path):
    with controller(tmp_path):
        yield Peer(ros_node).meet()


def test_without_a_field_nothing_moves_and_a_start_is_refused_in_words(peer):
    for _ in range(30):
        peer.tick()
    answer = peer.call('start_trial')
    assert not answer.success
    assert 'no control field' in answer.message
    assert peer.commands == []


def test_outside_a_trial_nothing_is_published(peer):
    peer.push()
    for _ in range(30):
        peer.tick()
        ros_helpers.spin_some(peer.node)
    assert not peer.call('stop_trial').success
    assert peer.commands == []
    assert peer.status.state is State.IDLE


def test_stale_odometry_stops_the_robot_and_says_so(peer):
    peer.push().drive()
    peer.wait(peer.has_stopped, 'a standstill')
    peer.wait(lambda: peer.status.state is State.PAUSED, 'a pause')
    assert 'odometry' in peer.status.reason or 'neighbourhood' in peer.status.reason


@pytest.mark.parametrize('change', [{'x': math.nan}, {'y': math.inf}, {'frame_id': 'map'}])
def test_odometry_that_is_not_to_be_trusted_stops_the_robot(peer, change):
    peer.push().drive()
    peer.tick(**change)
    peer.wait(peer.has_stopped, 'a standstill')
    peer.wait(lambda: peer.status.state is State.PAUSED, 'a pause')


def test_a_stop_sends_one_standstill_and_ends_the_trial(peer):
    peer.push().drive()
    assert peer.call('stop_trial').success
    peer.wait(lambda: peer.status.outcome is Outcome.STOPPED, 'the end')
    peer.wait(peer.has_stopped, 'a standstill')
    n = len(peer.commands)
    for _ in range(10):
        peer.tick()
        ros_helpers.spin_some(peer.node)
    assert len(peer.commands) == n


@pytest.mark.parametrize('number', [
    signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_leaves_the_robot_standing(ros_node, tmp_path, number):
    with controller(tmp_path) as process:
        peer = Peer(ros_node).meet()
        peer.push().drive()
        process.stop(number)
        assert 'Traceback' not in process.stderr
    peer.wait(peer.has_stopped, 'a standstill')
    peer.wait(lambda: peer.status.outcome is Outcome.ABORTED, 'the end of the trial')


def test_with_nohup_the_end_of_the_terminal_ends_nothing(ros_node, tmp_path):
    command = ros_helpers.node_command('control_field_node.node', tmp_path, {})
    ignoring = ['sh', '-c', 'trap "" HUP; exec "$@"', 'sh', *command]
    with ros_helpers.Process(ignoring, tmp_path, name='controller') as process:
        peer = Peer(ros_node).meet()
        process.send(signal.SIGHUP)
        peer.push()
        peer.wait(lambda: peer.status.revision == 1, 'the controller, which goes on')
        process.stop(signal.SIGTERM)


@pytest.fixture
def patient(ros_node, tmp_path):
    """Return a peer of a controller that a busy machine's halts do not upset."""
    with controller(tmp_path, {'takeover_timeout': 2.0, 'odom_timeout': 10.0,
                               'neighbourhood_timeout': 10.0}):
        yield Peer(ros_node).meet()


def test_a_person_takes_over_and_the_field_waits(patient):
    peer = patient
    peer.push().drive()
    hand = peer.node.create_publisher(Twist, 'cmd_vel', qos.COMMAND)
    peer.wait(lambda: hand.get_subscription_count() == 2, 'the controller')
    push = Twist()
    push.linear.x = 0.123

    def taken_over():
        hand.publish(push)
        ros_helpers.spin_some(peer.node)
        return peer.status.state is State.PAUSED

    peer.wait(taken_over, 'a pause')
    assert 'person' in peer.status.reason

    def all_by_hand():
        """Whether everything heard in a while, after what was under way, is the person's."""
        peer.commands[:] = []
        for _ in range(3):
            hand.publish(push)
            ros_helpers.spin_some(peer.node)
        return {velocity_of(msg) for msg in peer.commands} == {(0.123, 0.0)}

    peer.wait(all_by_hand, 'silence of the field')

    def taught():
        hand.publish(push)
        ros_helpers.spin_some(peer.node)
        peer.tick()
        assert {velocity_of(msg) for msg in peer.commands} == {(0.123, 0.0)}
        return any(row['kind'] == Kind.TAUGHT for row in peer.rows)

    peer.wait(taught, 'a step taught')
    peer.node.destroy_publisher(hand)

    def goes_on():
        peer.tick()
        return peer.status.state is State.RUNNING

    peer.wait(goes_on, 'the trial to go on')


def test_teleop_outside_a_trial_goes_through_the_limits(peer):
    hand = peer.node.create_publisher(Twist, 'cmd_vel_teleop', qos.COMMAND)
    requests = peer.collect(TwistStamped, 'cmd_vel_requested', qos.COMMAND)
    peer.wait(hand.get_subscription_count, 'the controller')
    push = Twist()
    push.linear.x = 1.0

    def passed_on():
        peer.tick()
        hand.publish(push)
        return peer.commands and requests and velocity_of(peer.commands[-1])[0] > 0.2

    peer.wait(passed_on, 'a command')
    assert velocity_of(requests[-1]) == (1.0, 0.0)
    assert max(velocity_of(msg)[0] for msg in peer.commands) <= 0.22
    peer.wait(peer.has_stopped, 'a standstill when the keys are let go')


def test_before_there_is_a_field_a_person_is_kept_off_what_is_occupied(ros_node, tmp_path):
    hand = ros_node.create_publisher(Twist, 'cmd_vel_teleop', qos.COMMAND)
    diagnostics = ros_helpers.collect(ros_node, DiagnosticArray, '/diagnostics')
    push = Twist()
    push.linear.x = 0.2
    with simulator(tmp_path, {'speed_factor': 2.0}) as sim, controller(tmp_path) as process:
        def is_held():
            hand.publish(push)
            ros_helpers.spin_some(ros_node)
            return any(pair.key == 'held' and 'blocked' in pair.value for array in diagnostics
                       for status in array.status for pair in status.values)

        ros_helpers.wait_until(is_held, node=ros_node, processes=[sim, process], what='the wall')
        assert 'collision' not in sim.stderr


def test_who_takes_over_turns_no_faster_than_the_limits_let(peer):
    hand = peer.node.create_publisher(Twist, 'cmd_vel_teleop', qos.COMMAND)
    peer.wait(hand.get_subscription_count, 'the controller')
    turn = Twist()
    turn.angular.z = -2.0
    peer.push().drive()
    before, n = time.monotonic(), len(peer.commands)
    peer.tick()
    peer.wait(lambda: len(peer.commands) > n, 'an answer')
    last = velocity_of(peer.commands[-1])[1]

    def taken_over():
        hand.publish(turn)
        return velocity_of(peer.commands[-1])[1] != last

    peer.wait(taken_over, 'a turn')
    [w] = [velocity_of(msg)[1] for msg in peer.commands if velocity_of(msg)[1] != last][:1]
    assert abs(w - last) <= 3.2 * (time.monotonic() - before) + 1e-9


@pytest.mark.parametrize('profile', [qos.LATCHED, qos.POSE], ids=['latched', 'not latched'])
def test_decisions_are_made_where_a_localisation_says_that_the_robot_is(
        ros_node, tmp_path, profile):
    with controller(tmp_path, {'pose_topic': 'amcl_pose'}):
        peer = Peer(ros_node).meet()
        poses = ros_node.create_publisher(PoseWithCovarianceStamped, 'amcl_pose', profile)
        peer.wait(poses.get_subscription_count, 'the controller')
        peer.push()
        peer.wait(lambda: (peer.tick(), 'no pose' in peer.call('start_trial').message)[1],
                  'a refusal')
        wrong = initialpose_from_pose(Pose(peer.pose.stamp, 0.0, 0.0, 0.0, frame_id='mars'))
        poses.publish(wrong)
        poses.publish(PoseWithCovarianceStamped())  # no rotation
        there = GRID.world_from_cell(6, 5)

        def started():
            peer.tick()
            poses.publish(initialpose_from_pose(Pose(
                peer.pose.stamp, *there, 0.0, frame_id='map'), (1e-4, 1e-4, 1e-4)))
            return peer.accepts_start()

        peer.wait(started, 'a start')
        peer.wait(lambda: (peer.tick(), peer.rows)[1], 'a decision')
        assert (peer.rows[0]['row'], peer.rows[0]['col']) == (6, 5)


def test_a_peer_with_the_other_type_is_told_which_parameter_to_set(ros_node, tmp_path):
    stamped = ros_node.create_subscription(TwistStamped, 'cmd_vel', lambda _: None, 1)
    diagnostics = ros_helpers.collect(ros_node, DiagnosticArray, '/diagnostics')
    with controller(tmp_path) as process:
        ros_helpers.wait_until(
            lambda: 'set enable_stamped_cmd_vel:=true' in process.stderr, node=ros_node,
            processes=[process], what='a line that says which parameter to set')
        ros_helpers.wait_until(
            lambda: any('enable_stamped' in status.message for array in diagnostics
                        for status in array.status), node=ros_node, what='a diagnostic')
        assert process.stderr.count('enable_stamped_cmd_vel') == 1
    ros_node.destroy_subscription(stamped)


def test_all_who_have_the_other_type_are_named_also_on_cmd_vel_teleop(ros_node, tmp_path):
    here = [ros_node.create_publisher(TwistStamped, 'cmd_vel', 1),
            ros_node.create_subscription(TwistStamped, 'cmd_vel', lambda _: None, 1)]
    teleop = ros_node.create_publisher(TwistStamped, 'cmd_vel_teleop', 1)
    with controller(tmp_path) as process:
        def says(words):
            ros_helpers.wait_until(lambda: words in process.stderr, node=ros_node,
                                   processes=[process], what=words)
        says('test_node publishes cmd_vel as geometry_msgs/msg/TwistStamped and '
             'test_node subscribes to cmd_vel as')
        ros_node.destroy_publisher(here[0])
        ros_node.destroy_subscription(here[1])
        says('test_node publishes cmd_vel_teleop as geometry_msgs/msg/TwistStamped but')
    ros_node.destroy_publisher(teleop)


def test_in_real_time_the_simulated_robot_gets_to_the_goal(ros_node, tmp_path):
    with simulator(tmp_path, {'world': 'open'}), controller(tmp_path):
        peer = Peer(ros_node)
        peer.push(straight_field((3, 5)))
        peer.wait(peer.accepts_start, 'a start')
        peer.wait(lambda: peer.status.state is State.ENDED, 'the end', 30.0)
        assert peer.status.outcome is Outcome.GOAL


def test_a_second_controller_on_the_same_robot_ends_the_trial(peer, tmp_path):
    peer.push().drive()
    with ros_helpers.own_node(int(os.environ['ROS_DOMAIN_ID']), 'control_field_node') as rival:
        hand = rival.create_publisher(Twist, 'cmd_vel', qos.COMMAND)
        peer.wait(lambda: hand.get_subscription_count() == 2, 'the controller')

        def ended():
            hand.publish(Twist())
            peer.tick()
            return peer.status.state is State.ENDED

        peer.wait(ended, 'the end of the trial')
    assert peer.status.outcome is Outcome.STOPPED
    assert 'another controller' in peer.status.reason


@pytest.mark.parametrize('other', ['grid', 'version'])
def test_a_field_of_something_else_ends_the_trial(peer, other):
    peer.push().drive()
    cloud = cloud_from_field(ControlField.void(Grid(10, 10, 0.5)) if other == 'grid'
                             else straight_field((3, 8)))
    if other == 'version':
        version = next(field.offset for field in cloud.fields if field.name == 'version')
        cloud.data[version::cloud.point_step] = array('B', [7] * (cloud.width * cloud.height))
    peer.field.publish(cloud)
    peer.wait(lambda: peer.tick() or peer.status.state is State.ENDED, 'the end of the trial')
    assert (peer.status.outcome, peer.status.stop_reason) == (
        Outcome.STOPPED, StopReason.WRONG_FIELD)
    assert other == 'grid' or 'version is 7' in peer.status.reason
    peer.wait(peer.has_stopped, 'a standstill')


def test_exclusive_cmd_vel_is_refused_to_a_silent_publisher_too(ros_node, tmp_path):
    with controller(tmp_path, {'exclusive_cmd_vel': True}):
        peer = Peer(ros_node).meet()
        peer.push().drive()
        silent = ros_node.create_publisher(Twist, 'cmd_vel', qos.COMMAND)
        peer.wait(lambda: peer.status.state is State.ENDED, 'the end of the trial')
        assert peer.status.outcome is Outcome.STOPPED
        assert 'publishes cmd_vel, too' in peer.status.reason
        answer = peer.call('start_trial')
        assert not answer.success
        assert 'exclusive_cmd_vel' in answer.message
        ros_node.destroy_publisher(silent)


def test_an_older_rclpy_without_the_events_executor_will_do(ros_domain, tmp_path):
    code = ('import sys; sys.modules["rclpy.experimental.events_executor"] = None; '
            'from msgs_bridge.node.run import quickest_executor; '
            'print(quickest_executor().__name__)')
    process = ros_helpers.run([sys.executable, '-c', code], tmp_path)
    assert process.stdout.strip() == 'SingleThreadedExecutor', process.report()


def test_a_wrong_parameter_is_one_line_and_code_2(ros_domain, tmp_path):
    for parameters, name in (({'v_max': -1.0}, 'v_max'), ({'lockstep': 'yes'}, 'lockstep'),
                             ({'moves': 5}, 'moves'), ({'v_max': math.inf}, 'v_max')):
        command = ros_helpers.node_command('control_field_node.node', tmp_path, parameters)
        process = ros_helpers.run(command, tmp_path)
        assert process.popen.returncode == 2, process.report()
        assert name in process.stderr
        assert len(process.stderr.splitlines()) == 1


def test_a_parameter_out_of_range_is_refused_at_run_time_with_the_range(peer):
    def set_parameter(name, value):
        request = SetParameters.Request(parameters=[Parameter(
            name=name, value=ParameterValue(type=3, double_value=value))])
        return ros_helpers.call(
            peer.node, SetParameters, 'control_field_node/set_parameters', request).results[0]

    refused = set_parameter('v_max', 99.0)
    assert not refused.successful
    assert '5.0' in refused.reason
    assert set_parameter('v_max', 0.1).successful
    peer.push().start()

    def driving():
        peer.tick()
        return len(peer.commands) > 30

    peer.wait(driving, 'commands')
    assert max(velocity_of(msg)[0] for msg in peer.commands) == pytest.approx(0.1)
