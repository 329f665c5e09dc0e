"""However the controller ends, the robot comes to stand; what ROS refuses is one line."""

from array import array
from contextlib import ExitStack
from itertools import pairwise
import math
import signal

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
import pytest
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from control_field.records import Outcome
from control_field.robot.stop_reasons import StopReason
from controller_helpers import straight_field
from msgs_bridge.messages.poses import seconds_from_stamp
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.messages.trial_status import trial_from_status
from msgs_bridge.node import qos
from ros_helpers import call, collect, node_command, Process, run, start_node, wait_until

#: Long enough for a busy machine to halt in between, [s].
TIMEOUT, PATIENCE = 1.5, 10.0
SPEED = 0.15
ACCELERATION = 0.5
STAMPED = {'enable_stamped_cmd_vel': True}
#: The controller with a mistake in it, which shows when the robot drives.
BROKEN = f"""
from control_field_node.node import main
from control_field_node.supervisor import Supervisor

answer = Supervisor.on_pose

def on_pose(self, *arguments):
    if self.output.velocity[0] > {SPEED}:
        raise RuntimeError('a mistake')
    return answer(self, *arguments)

Supervisor.on_pose = on_pose
main()
"""
NODES = {
    'sim_node': {}, 'control_field_node': {}, 'learner_node': {'task': 'a_task'},
    'teleop_node': {'keyboard': False}, 'neighbourhood_node': {}, 'localised_odometry_node': {},
    'page_node': {'port': 0},
}


def speed(msg):
    return msg.twist.twist.linear.x


class Drive:
    """A simulated robot in real time that a controller drives, and who hears both."""

    def __init__(self, node, folder, stack, code=None):
        self.node = node
        command = node_command('control_field_node.node', folder, {
            **STAMPED, 'a_max': ACCELERATION, 'odom_timeout': PATIENCE,
            'neighbourhood_timeout': PATIENCE})
        if code:
            command[1:3] = ['-c', code]
        self.sim = stack.enter_context(start_node(
            'sim_node.node', folder, {**STAMPED, 'cmd_vel_timeout': TIMEOUT}))
        self.controller = stack.enter_context(Process(
            command, folder, name='control_field_node'))
        self.commands = collect(node, TwistStamped, 'cmd_vel', 100)
        self.odometry = collect(node, Odometry, 'odom', qos.ODOMETRY_PUB)
        self.statuses = collect(node, DiagnosticStatus, 'trial', qos.LATCHED)
        self.diagnostics = collect(node, DiagnosticArray, '/diagnostics', 10)
        self.field = node.create_publisher(PointCloud2, 'control_field', qos.LATCHED)
        self.push(1)

    def n_refused(self):
        """Return how many fields the controller has refused, as its diagnostics say."""
        return max((int(value.value) for msg in self.diagnostics for status in msg.status
                    for value in status.values if value.key == 'refused_fields'), default=0)

    def push(self, revision):
        self.field.publish(cloud_from_field(straight_field((3, 15), revision)))

    def wait(self, predicate, what):
        return wait_until(predicate, node=self.node, processes=[self.sim], what=what,
                          report=lambda: f'{self.controller.report()}\n{self.statuses[-1:]}')

    def is_started(self):
        answer = call(self.node, Trigger, 'control_field_node/start_trial')
        return answer.success or 'already' in answer.message

    def start(self):
        self.wait(self.is_started, 'a start')
        self.wait(self.drives, 'a robot that drives')

    def drives(self):
        return self.odometry and speed(self.odometry[-1]) > SPEED

    def stands(self):
        return self.odometry and speed(self.odometry[-1]) == 0.0


@pytest.fixture
def driving(ros_node, tmp_path):
    with ExitStack() as stack:
        drive = Drive(ros_node, tmp_path, stack)
        drive.start()
        yield drive


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_sends_a_standstill_before_the_end(driving, number):
    driving.controller.stop(number)
    driving.wait(lambda: driving.commands[-1].twist == Twist(), 'a standstill')
    driving.wait(driving.stands, 'the robot to stand')
    driving.wait(lambda: trial_from_status(driving.statuses[-1]).outcome is Outcome.ABORTED,
                 'the end of the trial')
    assert 'no command' not in driving.sim.stderr
    assert 'Traceback' not in driving.controller.stderr


def test_an_exception_sends_a_standstill_before_the_end(ros_node, tmp_path):
    with ExitStack() as stack:
        drive = Drive(ros_node, tmp_path, stack, BROKEN)
        drive.wait(drive.is_started, 'a start')
        assert drive.controller.wait() == 1
        assert 'a mistake' in drive.controller.stderr
        drive.wait(lambda: drive.commands and drive.commands[-1].twist == Twist(), 'a standstill')
        drive.wait(drive.stands, 'the robot to stand')
        assert max(msg.twist.linear.x for msg in drive.commands) > SPEED
        assert 'no command' not in drive.sim.stderr


def test_after_kill_9_of_the_controller_the_simulator_stops_by_staleness(driving):
    driving.controller.kill()
    killed = driving.odometry[-1]
    driving.wait(driving.stands, 'the robot to stand')
    before, after = killed.pose.pose.position, driving.odometry[-1].pose.pose.position
    assert driving.commands[-1].twist != Twist()
    assert math.hypot(after.x - before.x, after.y - before.y) < 0.22 * (TIMEOUT + 0.5)
    driving.wait(lambda: f'no command for {TIMEOUT:g} s' in driving.sim.stderr, 'a word of it')


def test_a_refreshed_field_does_not_make_the_robot_jerk(driving):
    n = len(driving.commands)
    for revision in range(2, 12):
        driving.push(revision)
        driving.wait(lambda: trial_from_status(driving.statuses[-1]).revision
                     == revision, f'revision {revision}')  # noqa: B023
    commands = [(seconds_from_stamp(msg.header.stamp), msg.twist.linear.x)
                for msg in driving.commands[n:]]
    assert len(commands) > 2
    for (t0, v0), (t1, v1) in pairwise(commands):
        # On a busy machine poses come late, and the collision monitor slows down as much as that
        # needs.
        assert v1 - v0 <= ACCELERATION * (t1 - t0) + 1e-9


def test_a_huge_message_is_read_and_refused_while_the_robot_drives(driving):
    huge = serialize_message(PointCloud2(
        height=600, width=600, point_step=96, data=array('B', bytes(600 * 600 * 96))))
    for n_refused in (1, 2):
        driving.field.publish(huge)
        driving.wait(lambda: driving.n_refused() == n_refused, 'a refusal')  # noqa: B023
    driving.wait(lambda: driving.commands[-1].twist.linear.x > 0.0 or trial_from_status(
        driving.statuses[-1]).outcome is Outcome.GOAL, 'a robot that drives on')
    assert not any(trial_from_status(status).stop_reason is StopReason.READING_FIELD
                   for status in driving.statuses)


@pytest.mark.parametrize('name', NODES)
@pytest.mark.parametrize(('variable', 'value', 'words'), [
    ('ROS_DOMAIN_ID', '233', '0 ... 232'), ('ROS_DOMAIN_ID', 'seven', 'ROS_DOMAIN_ID'),
    ('ROS_SECURITY_ENABLE', 'true', 'secur')])
def test_what_ros_cannot_do_is_one_line_and_code_2(
        quiet_domain, tmp_path, name, variable, value, words):
    (tmp_path / 'keys' / 'enclaves').mkdir(parents=True)
    environment = {'ROS_SECURITY_KEYSTORE': str(tmp_path / 'keys'),
                   'ROS_SECURITY_STRATEGY': 'Enforce', variable: value}
    parameters = {**NODES[name], **({'bags': str(tmp_path)} if 'learner' in name else {})}
    process = run(node_command(f'{name}.node', tmp_path, parameters), tmp_path, environment)
    assert process.popen.returncode == 2, process.report()
    last = process.stderr.splitlines()[-1]
    assert words in last
    assert last.startswith(f'{name}:')
    assert 'Traceback' not in process.stderr


@pytest.mark.parametrize('name', NODES)
def test_a_clock_before_the_beginning_of_time_is_passed_over(ros_domain, ros_node, tmp_path, name):
    clock = ros_node.create_publisher(Clock, '/clock', 1)
    with start_node(f'{name}.node', tmp_path, {**NODES[name], 'use_sim_time': True}) as process:
        def is_said():
            clock.publish(Clock(clock=Time(sec=-1)))
            return '/clock: sec is -1' in process.stderr
        wait_until(is_said, node=ros_node, processes=[process], what='a word about the clock')
        assert process.running


#: The learner leaves by `os._exit` while it compiles: then it does so here when all is said.
LEFT_OVER = """
import gc
import os
from rclpy.executors import Executor
from {}.node import main

gc.disable()
ends = []
leave, os._exit = os._exit, ends.append
main()
left = [thing for thing in gc.get_objects() if isinstance(thing, Executor)]
print([executor for executor in left if not executor._is_shutdown])
if ends:
    leave(*ends)
"""


@pytest.mark.parametrize('name', NODES)
def test_no_executor_is_left_to_the_garbage_collector(ros_domain, ros_node, tmp_path, name):
    """Who finds guard conditions of rclpy 7.1 before their executor says so with a traceback."""
    command = node_command(f'{name}.node', tmp_path, NODES[name])
    command[1:3] = ['-c', LEFT_OVER.format(name)]
    with Process(command, tmp_path) as process:
        wait_until(lambda: name in ros_node.get_node_names(), node=ros_node,
                   processes=[process], what=name)
    assert process.stdout.splitlines()[-1] == '[]'
