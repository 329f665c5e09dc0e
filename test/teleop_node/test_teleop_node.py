"""The node `teleop_node` as a process of its own, on a pseudo-terminal and on real topics."""

from contextlib import contextmanager
import shlex
import shutil
import signal
import sys
import time

from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.velocities import velocity_from_twist
from msgs_bridge.node import qos
from msgs_bridge.teaching.actions import Action
import ros_helpers
from terminal_helpers import TerminalProcess


class Robot:
    """The other side: hears commands, with the time they came."""

    def __init__(self, node, kind=Twist, topic='cmd_vel_teleop'):
        self.node, self.heard, self.messages = node, [], []
        node.create_subscription(kind, topic, self._hear, 50)
        self.topic = topic

    def _hear(self, msg):
        self.messages.append(msg)
        self.heard.append((time.monotonic(), velocity_from_twist(msg)))

    def wait(self, predicate, process, what):
        return ros_helpers.wait_until(predicate, node=self.node, processes=[process], what=what)

    def ready(self, process):
        self.wait(lambda: self.node.count_publishers(self.topic), process, 'the publisher')
        self.wait(lambda: self.types('k', process) or self.heard, process, 'the first command')
        self.silence(process)

    def types(self, key, process):
        process.type(key)
        ros_helpers.spin_some(self.node, 0.05)

    def stands(self):
        """Tell whether the last command is a standstill."""
        return self.heard and self.heard[-1][1] == (0.0, 0.0)

    def silence(self, process):
        """Wait until nothing has come for a while."""
        self.wait(lambda: time.monotonic() - self.heard[-1][0] > 0.6, process, 'silence')
        self.heard.clear()
        self.messages.clear()


@contextmanager
def teleop(folder, parameters=None, **options):
    command = ros_helpers.node_command('teleop_node.node', folder, parameters)
    with TerminalProcess(command, folder, name='teleop_node', **options) as process:
        yield process


class TestHoldToMove:
    def test_it_moves_for_as_long_as_the_key_comes_and_then_stands(self, ros_node, tmp_path):
        robot = Robot(ros_node)
        # A machine that halts for less than this lets no key go.
        with teleop(tmp_path, {'hold_time': 1.0}) as process:
            robot.ready(process)
            for _ in range(10):
                last = time.monotonic()
                process.type('i')
                ros_helpers.spin_some(ros_node, 0.05)
            robot.wait(robot.stands, process, 'the standstill')
            stopped = next(at for at, velocity in robot.heard if velocity == (0.0, 0.0))
            assert {velocity for at, velocity in robot.heard if at < stopped} == {(0.2, 0.0)}
            assert 0.95 < stopped - last < 2.0
            robot.silence(process)  # others may drive now

    def test_space_stops_at_once(self, ros_node, tmp_path):
        robot = Robot(ros_node)
        with teleop(tmp_path, {'hold_time': 1.0}) as process:
            robot.ready(process)
            process.type('u')
            robot.wait(lambda: robot.heard, process, 'a command')
            assert robot.heard[0][1] == (0.2, 1.0)
            pressed = time.monotonic()
            process.type(' ')
            robot.wait(robot.stands, process, 'the standstill')
            assert robot.heard[-1][0] - pressed < 0.8

    def test_speeds_are_keys_and_parameters(self, ros_node, tmp_path):
        robot = Robot(ros_node)
        with teleop(tmp_path, {'speed': 0.1}) as process:
            robot.ready(process)
            process.type('wci')
            robot.wait(lambda: robot.heard, process, 'a command')
            assert robot.heard[0][1] == pytest.approx((0.11, 0.0))
            robot.silence(process)
            request = SetParameters.Request(parameters=[
                Parameter('turn', value=2.0).to_parameter_msg(),
                Parameter('speed', value=9.0).to_parameter_msg()])
            results = ros_helpers.call(
                ros_node, SetParameters, '/teleop_node/set_parameters', request).results
            assert [result.successful for result in results] == [True, False]
            process.type('j')
            robot.wait(lambda: robot.heard, process, 'a command')
            assert robot.heard[0][1] == (0.0, 2.0)

    def test_stamped_and_straight_to_the_robot(self, ros_node, tmp_path):
        robot = Robot(ros_node, TwistStamped, 'cmd_vel')
        with teleop(tmp_path, {'enable_stamped_cmd_vel': True, 'topic': 'cmd_vel'}) as process:
            robot.ready(process)
            process.type('l')
            robot.wait(lambda: robot.heard, process, 'a command')
            header = robot.messages[0].header
            assert header.frame_id == 'base_footprint'
            assert abs(header.stamp.sec - time.time()) < 10.0

    def test_in_lock_step_a_command_answers_the_last_odometry(self, ros_node, tmp_path):
        robot = Robot(ros_node, TwistStamped)
        poses = ros_node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
        with teleop(tmp_path, {'lockstep': True}) as process:
            robot.ready(process)
            for stamp in (3.25, 3.3):
                def is_answered(stamp=stamp):
                    poses.publish(odometry_from_pose(Pose(stamp, 0.0, 0.0, 0.0)))
                    robot.types('i', process)
                    return robot.messages and (
                        robot.messages[-1].header.stamp.nanosec == round((stamp - 3.0) * 1e9))
                robot.wait(is_answered, process, 'the answer')
                assert robot.messages[-1].header.stamp.sec == 3

    def test_a_reader_of_the_other_type_is_told_about(self, ros_node, tmp_path):
        ros_node.create_subscription(TwistStamped, 'cmd_vel_teleop', lambda _: None, 10)
        with teleop(tmp_path) as process:
            ros_helpers.wait_until(
                lambda: 'set enable_stamped_cmd_vel:=true' in process.read(), node=ros_node,
                processes=[process], what='the hint')


class TestServices:
    def test_every_action_is_one_and_says_what_is_missing(self, ros_node, tmp_path):
        with ros_helpers.start_node('teleop_node.node', tmp_path, {'keyboard': False}) as process:
            for action in Action:
                answer = ros_helpers.call(ros_node, Trigger, f'/teleop_node/{action}')
                alone = action in (Action.STOP, Action.QUIT)
                assert answer.success == alone
                if not alone:
                    assert 'is not there' in answer.message
            assert process.wait() == 0

    def test_keys_ask_the_same(self, ros_node, tmp_path):
        asked = []

        def answer(request, response):
            asked.append(request)
            response.success, response.message = True, 'dropped 0001_demo'
            return response
        ros_node.create_service(Trigger, 'learner_node/drop_last', answer)
        with teleop(tmp_path) as process:
            def is_done():
                if not asked:
                    process.type('d')
                # Longer than a key that is held repeats: another press, if nobody was there yet.
                ros_helpers.spin_some(ros_node, 1.0)
                return 'Dropped 0001_demo.' in process.read()
            ros_helpers.wait_until(is_done, node=ros_node, processes=[process], what='the answer')
            assert len(asked) == 1


class TestTheScreen:
    @pytest.mark.parametrize('width', [80, 40])
    def test_the_line_stays_one_line(self, ros_domain, tmp_path, width):
        with teleop(tmp_path, width=width) as process:
            ros_helpers.wait_until(
                lambda: process.read().count('no learner') > 3, processes=[process])
            status = [line for line in process.lines() if 'no learner' in line]
            assert max(map(len, status)) < width
            assert process.read().count('\n') < 8  # the help alone


class TestLeaving:
    """The terminal is as it was, the robot stands, the exit code is 0."""

    @contextmanager
    def held(self, ros_node, folder):
        robot = Robot(ros_node)
        with teleop(folder, {'hold_time': 1.0}) as process:
            before = process.before
            robot.ready(process)
            assert process.mode() != before
            process.type('i')
            robot.wait(lambda: robot.heard, process, 'a command')
            yield process
            assert process.wait() == 0
            assert process.mode() == before
            assert 'Traceback' not in process.report()
            ros_helpers.wait_until(
                robot.stands, node=ros_node, what='the standstill')

    @pytest.mark.parametrize('key', ['\x1b', '\x03', '\x1c'])
    def test_by_key(self, ros_node, tmp_path, key):
        with self.held(ros_node, tmp_path) as process:
            process.type(key)

    @pytest.mark.parametrize('number', [
        signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
    def test_by_signal(self, ros_node, tmp_path, number):
        with self.held(ros_node, tmp_path) as process:
            process.send(number)

    def test_by_service(self, ros_node, tmp_path):
        with self.held(ros_node, tmp_path):
            ros_helpers.call(ros_node, Trigger, '/teleop_node/quit')

    def test_when_the_terminal_goes_away(self, ros_node, tmp_path):
        robot = Robot(ros_node)
        with teleop(tmp_path, {'hold_time': 1.0}) as process:
            robot.ready(process)
            process.type('i')
            robot.wait(lambda: robot.heard, process, 'a command')
            process.close()
            assert process.popen.wait(ros_helpers.DEADLINE) == 0
            ros_helpers.wait_until(
                robot.stands, node=ros_node, what='the standstill')

    def test_an_arrow_key_is_no_escape(self, ros_node, tmp_path):
        with self.held(ros_node, tmp_path) as process:
            process.type('\x1b[A')
            shown = process.read().count('m/s')
            ros_helpers.wait_until(
                lambda: process.read().count('m/s') > shown + 3, node=ros_node,
                processes=[process])
            process.type('\x1b')

    @pytest.mark.skipif(shutil.which('bash') is None, reason='bash is not installed')
    def test_ctrl_z_gives_the_terminal_back_until_fg(self, ros_node, tmp_path):
        robot = Robot(ros_node)
        command = ros_helpers.node_command('teleop_node.node', tmp_path, {'hold_time': 1.0})
        with TerminalProcess(['bash', '--norc', '--noediting', '-i'], tmp_path) as shell:
            usual = shell.before[3]
            shell.type(shlex.join(command) + '\n')
            robot.ready(shell)
            shell.type('i')
            robot.wait(lambda: robot.heard, shell, 'a command')
            shell.type('\x1a')
            robot.wait(lambda: 'Stopped' in shell.report(), shell, 'the shell')
            robot.wait(robot.stands, shell, 'the standstill')
            assert shell.mode()[3] == usual
            shell.type('fg\n')
            robot.wait(lambda: shell.mode()[3] != usual, shell, 'the keys')
            robot.silence(shell)
            shell.type('j')
            robot.wait(lambda: robot.heard, shell, 'a command')
            shell.type('\x1b')
            robot.wait(lambda: shell.mode()[3] == usual, shell, 'the end')
            shell.type('exit\n')
            assert shell.wait() == 0


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_node_is_made_ends_it(ros_domain, tmp_path, number):
    code = f"""
import os
from teleop_node import node
make = node._make_node
def make_slowly():
    made = make()
    os.kill(os.getpid(), {number})
    return made
node._make_node = make_slowly
node.main(['--ros-args', '-p', 'keyboard:=false'])
"""
    process = ros_helpers.run([sys.executable, '-c', code], tmp_path)
    assert process.popen.returncode == 0, process.report()
    assert 'Traceback' not in process.stderr


class TestMistakes:
    """One line on stderr and exit code 2."""

    def test_no_terminal(self, ros_domain, tmp_path):
        process = ros_helpers.run(ros_helpers.node_command('teleop_node.node', tmp_path), tmp_path)
        assert process.popen.returncode == 2
        line, = process.stderr.splitlines()
        assert line.startswith('teleop_node: standard input is no terminal')

    @pytest.mark.parametrize(('parameter', 'word'), [
        ('speed:=0.5', 'speed_max'), ('hold_time:=0.0', 'hold_time'), ('topic:=" "', 'topic'),
        ('rate:=fast', 'rate')])
    def test_parameters(self, ros_domain, tmp_path, parameter, word):
        command = ros_helpers.node_command('teleop_node.node', tmp_path)
        process = ros_helpers.run([*command, '--ros-args', '-p', parameter], tmp_path)
        assert process.popen.returncode == 2
        line, = process.stderr.splitlines()
        assert line.startswith('teleop_node: ')
        assert word in line
