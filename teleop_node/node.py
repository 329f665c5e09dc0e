"""The node `teleop_node`: a person drives and teaches by keys or services."""

from contextlib import ExitStack
import math
import os
import sys
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from control_field.limits import STANDSTILL, Velocity
from msgs_bridge import qos
from msgs_bridge.command_line import check_names, names_of, Program
from msgs_bridge.node_main import start_node
from msgs_bridge.parameters import declare_parameters_from
from msgs_bridge.poses import initialpose_from_pose, Pose, pose_from_odometry
from msgs_bridge.processes import prepare
from msgs_bridge.trial_status import trial_from_status
from msgs_bridge.velocities import fill_twist
from teleop_node.driving import changed_speeds, Driving, FACTORS, MOVES, Pace
from teleop_node.facts import Gathered, problem_with_readers
from teleop_node.keys import Action, ACTIONS, HELP, KeyParser, Presses
from teleop_node.lifecycle import Signals
from teleop_node.settings import FIXED, Settings
from teleop_node.status_line import line_from_facts, line_over, message_over
from teleop_node.teaching import Answer, Teaching
from teleop_node.terminal import descriptor, Terminal

#: How often keys are looked at, the line is written, peers are looked for, [s].
_KEY_PERIOD: Final = 0.02
_LINE_PERIOD: Final = 0.25
_PEERS_PERIOD: Final = 1.0
#: Longest wait for an answer, [s]: learning takes a while; and for that to `quit` to arrive.
_PATIENCE: Final = 60.0
_FAREWELL: Final = 0.1
#: How near its start a robot that was set back is, [m], and how long that may take, [s].
_NEAR: Final = 0.05
_SET_BACK_TIME: Final = 3.0

PROGRAM: Final = Program(
    'teleop_node', 'keys, or services of the same names, to drive and to teach (doc/teaching.md).'
    f'\n\n{HELP}', '-p speed:=0.1 -p topic:=cmd_vel', names_of(Settings))


class TeleopNode(Node):
    """
    Publishes commands, and asks learner and controller for what a person wants.

    Parameters
    ----------
    terminal : Terminal or None
        Where keys come from; None for the services alone.

    Raises
    ------
    ValueError
        If a parameter is wrong: one line that names it.

    """

    def __init__(self, terminal: Terminal | None = None, **options: Any) -> None:
        """Declare, subscribe, wait for keys."""
        super().__init__('teleop_node', **options)
        self.settings = declare_parameters_from(
            self, Settings, fixed=FIXED, on_change=self._on_settings)
        check_names(self)
        self.terminal = terminal if self.settings.keyboard else None
        self.is_done = False
        self._parser, self._presses = KeyParser(), Presses()
        self._driving = Driving(self.settings.speeds, self.settings.hold_time)
        self._pace = Pace(1.0 / self.settings.rate)
        self._pose: Pose | None = None
        self._began: Pose | None = None
        self._odometry: Odometry | None = None
        self._arrivals: list[Future] = []
        self._problem = ''
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._gathered = Gathered(
            self._full_name(self.settings.learner), self._full_name(self.settings.controller))
        self._teaching = Teaching(self, self.settings.learner, self.settings.controller)
        self._make_topics()
        self._make_services()
        self.create_timer(_KEY_PERIOD, self._look_at_keys, clock=self._steady)
        self.create_timer(_LINE_PERIOD, self._write_line, clock=self._steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_peers, clock=self._steady)

    def _full_name(self, node: str) -> str:
        return node if node.startswith('/') else f'{self.get_namespace().rstrip("/")}/{node}'

    def _make_topics(self) -> None:
        self._command_type = TwistStamped if self.settings.is_stamped else Twist
        self._command = self._command_type()
        if self.settings.is_stamped:
            self._command.header.frame_id = self.settings.base_frame_id
        self._commands = self.create_publisher(
            self._command_type, self.settings.topic, qos.COMMAND)
        self._places = self.create_publisher(PoseWithCovarianceStamped, 'initialpose', qos.POSE)
        self.create_subscription(Odometry, 'odom', self._on_odometry, (
            qos.ODOMETRY_PUB if self.settings.lockstep else qos.SENSOR))
        # A trial's end is soon followed by the next beginning: neither may be missed.
        self.create_subscription(
            DiagnosticStatus, 'trial', self._on_trial, qos.RECORDING_LATCHED)
        self.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda msg: self._gathered.saw_diagnostics(msg, time.monotonic()), 10)

    def _make_services(self) -> None:
        # One that waits for an answer must keep neither the answer nor other requests waiting.
        group = ReentrantCallbackGroup()
        for action in Action:
            self.create_service(
                Trigger, f'~/{action}', self._service(action), callback_group=group)
        learner, controller = self.settings.learner, self.settings.controller
        self._record = self.create_client(SetBool, f'{learner}/record_demonstration')
        self._learner_parameters = self.create_client(GetParameters, f'{learner}/get_parameters')
        names = [f'{learner}/{name}' for name in (
            'discard_demonstration', 'drop_last', 'label_success', 'label_failure', 'run_trials')]
        names += [f'{controller}/start_trial', f'{controller}/stop_trial']
        self._triggers = {name: self.create_client(Trigger, name) for name in names}

    def _service(self, action: Action) -> Any:
        async def serve(_: Any, response: Any) -> Any:
            response.success, response.message = await self._perform(action)
            return response

        return serve

    def _on_settings(self, settings: Settings) -> None:
        self.settings = settings
        self._driving.speeds, self._driving.hold_time = settings.speeds, settings.hold_time

    # Keys

    def _look_at_keys(self) -> None:
        now = time.monotonic()
        if self.terminal is not None:
            data = self.terminal.read()
            self.is_done = self.is_done or data is None
            for key in self._parser.feed(data or b'', now):
                self._on_key(key, now)
        self._drive(now)

    def _on_key(self, key: str, now: float) -> None:
        new = self._presses.is_new(key, now)
        if key in MOVES:
            self._driving.press(key, now)
        elif key in FACTORS:
            self._change_speeds(key)
        else:
            if key not in ACTIONS or ACTIONS[key] is Action.STOP:
                self.halt()
            else:
                self.let_go()
            if key in ACTIONS and new:
                self.executor.create_task(self._perform(ACTIONS[key]))
            elif new and key.lower() in MOVES and key:
                self._say('capital letters do not drive: is caps lock on?')

    def _change_speeds(self, key: str) -> None:
        speeds = changed_speeds(key, self.settings.speeds, self.settings.greatest)
        self.set_parameters_atomically([
            Parameter(name, value=value)
            for name, value in zip(('speed', 'turn'), speeds, strict=True)])

    async def _perform(self, action: Action) -> Answer:
        answer = await self._teaching.perform(action)
        self._say(f'{action.replace("_", " ")}: {"" if answer.success else "not done, "}'
                  f'{answer.message}')
        return answer

    # Commands

    def _drive(self, now: float) -> None:
        command = self._driving.command(now)
        if self._pace.is_due(command, now) and command is not None:
            self._send(command)

    def _send(self, velocity: Velocity) -> None:
        fill_twist(self._command, *velocity)
        if self.settings.is_stamped:
            odometry = self._odometry if self.settings.lockstep else None
            self._command.header.stamp = (
                self.get_clock().now().to_msg() if odometry is None else odometry.header.stamp)
        self._commands.publish(self._command)

    def stand_still(self) -> None:
        """Stop the robot and see that it gets to know, before this process pauses or ends."""
        speaks = self._driving.command(time.monotonic()) is not None
        self._driving.stop(-math.inf)
        if speaks:
            self._send(STANDSTILL)
            self._commands.wait_for_all_acked(Duration(nanoseconds=200_000_000))

    def pause(self) -> None:
        """Stop the robot and give the terminal back."""
        self.stand_still()
        if self.terminal is not None:
            self.terminal.write('\n')
            self.terminal.leave()

    def go_on(self) -> None:
        """Take the terminal again."""
        if self.terminal is not None:
            self.terminal.enter()

    # What comes in

    def _on_odometry(self, msg: Odometry) -> None:
        self._odometry = msg
        try:
            self._pose = pose_from_odometry(msg)
        except ValueError:
            return  # others say so
        while self._arrivals:
            self._arrivals.pop().set_result(True)

    def _on_trial(self, msg: DiagnosticStatus) -> None:
        try:
            self._gathered.saw_trial(trial_from_status(msg))
        except ValueError as error:
            self._say(f'refused: {error}')

    def _look_at_peers(self) -> None:
        """Notice when nobody hears the commands, or who wants the other type."""
        topic = self.resolve_topic_name(self.settings.topic)
        problem, sentence = problem_with_readers(
            topic, f'geometry_msgs/msg/{self._command_type.__name__}',
            self.get_subscriptions_info_by_topic(topic))
        if sentence and problem != self._problem:
            self._say(sentence)
        self._problem = problem

    # What the terminal shows

    def _write_line(self) -> None:
        if self.terminal is not None:
            facts = self._gathered.at(time.monotonic(), self.settings.speeds, self._problem)
            self.terminal.write(line_over(line_from_facts(facts, self.terminal.width - 1)))

    def _say(self, text: str) -> None:
        """Say something that stays: on the terminal, or in the log where there is none."""
        if self.terminal is None:
            self.get_logger().info(text)
            return
        self.terminal.write(message_over(text))
        self._write_line()

    # What actions ask for (teaching.Peers)

    async def ask(self, service: str, on: bool | None = None) -> Answer:
        """Call a service of learner or controller."""
        client = self._triggers[service] if on is None else self._record
        request = Trigger.Request() if on is None else SetBool.Request(data=on)
        answer = await self._answer(client, request)
        if answer is None:
            state = 'does not answer' if client.service_is_ready() else 'is not there'
            return Answer(False, f'{service} {state}')
        self._gathered.saw_answer(on, answer.success, time.monotonic())
        return Answer(answer.success, answer.message)

    async def _answer(self, client: Any, request: Any) -> Any:
        """Return the answer of a service; None if there is none."""
        if not client.service_is_ready():
            return None
        future = client.call_async(request)
        answer = await self._within(future, _PATIENCE)
        client.remove_pending_request(future)
        return answer

    async def _within(self, future: Future, seconds: float) -> Any:
        """Return the result of a future, None when that takes longer."""
        timer = self.create_timer(
            seconds, lambda: future.done() or future.set_result(None), clock=self._steady)
        try:
            return await future
        finally:
            self.destroy_timer(timer)

    async def is_simulated(self) -> bool:
        """Ask the learner whether it may set the robot back."""
        request = GetParameters.Request(names=['simulation'])
        answer = await self._answer(self._learner_parameters, request)
        return bool(answer is not None and answer.values and answer.values[0].bool_value)

    async def set_back(self) -> Answer:
        """Set a simulated robot back to where the demonstration began."""
        began = self._began
        if began is None:
            return Answer(True, '')
        self._places.publish(initialpose_from_pose(began))
        deadline = time.monotonic() + _SET_BACK_TIME
        while time.monotonic() < deadline:
            arrival = Future(executor=self.executor)
            self._arrivals.append(arrival)
            await self._within(arrival, _SET_BACK_TIME)
            if self._pose is not None and math.hypot(
                    self._pose.x - began.x, self._pose.y - began.y) < _NEAR:
                return Answer(True, '')
        return Answer(False, 'the robot was not set back')

    def is_trying(self) -> bool:
        """Tell whether a trial runs."""
        return self._gathered.is_trying

    def is_recording(self) -> bool:
        """Tell whether the learner records a demonstration."""
        return self._gathered.is_recording(time.monotonic())

    def demonstration_began(self) -> None:
        """Keep where it began."""
        self._began = self._pose

    def halt(self) -> None:
        """Stop the robot, whoever drives it."""
        self._driving.stop(time.monotonic())

    def let_go(self) -> None:
        """Stop driving; who does not drive stays silent, and takes no trial over."""
        if self._driving.command(time.monotonic()) is not None:
            self.halt()

    def quit(self) -> None:
        """End the program."""
        self.is_done = True


def main(args: list[str] | None = None) -> None:
    """
    Run the node until Esc or a signal; the terminal is left as it was found.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr: a wrong argument or parameter, or no terminal.

    """
    prepare()
    node = None
    try:
        node = start_node(PROGRAM, _make_node, args)
        _run(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            _close(node)
        rclpy.try_shutdown()


def _run(node: TeleopNode) -> None:
    """Work until Esc or a signal; ROS outlives it, so that the robot can be stopped."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with ExitStack() as stack, Signals() as signals:
        stack.callback(executor.shutdown)
        if node.terminal is not None:
            node.terminal.enter()
            node.terminal.write(HELP + '\n')
        while not node.is_done and rclpy.ok() and not signals.is_ended:
            executor.spin_once(_LINE_PERIOD)
            signals.look(node)


def _close(node: TeleopNode) -> None:
    """Leave the robot standing and the terminal as it was found, whatever has happened."""
    try:
        if rclpy.ok():
            node.stand_still()
            if node.is_done:
                time.sleep(_FAREWELL)
    finally:
        if node.terminal is not None:
            node.terminal.write('\r\x1b[K')
            node.terminal.leave()


def _make_node() -> TeleopNode:
    source, target = (descriptor(stream) for stream in (sys.stdin, sys.stdout))
    node = TeleopNode(Terminal(source, target) if os.isatty(source) else None)
    if node.settings.keyboard and node.terminal is None:
        raise ValueError('standard input is no terminal, so there are no keys to read: start it '
                         'in a terminal of its own, or set keyboard:=false for its services alone')
    return node


if __name__ == '__main__':
    main()
