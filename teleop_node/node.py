"""The node `teleop_node`: a person drives and teaches by keys or services."""

from contextlib import ExitStack
from functools import partial
import os
import sys
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from msgs_bridge.messages.trial_status import trial_from_status
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.environment import prepare
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import start_node
from msgs_bridge.teaching.actions import Action
from msgs_bridge.teaching.answers import Answer
from msgs_bridge.teaching.robot_placement import RobotPlacement
from msgs_bridge.teaching.service_clients import ServiceClients
from msgs_bridge.teaching.status_tracker import problem_with_readers, StatusTracker
from msgs_bridge.teaching.teaching import Teaching
from msgs_bridge.teaching.timeouts import Timeouts
from teleop_node.driving import changed_speeds
from teleop_node.keyboard import KeyBindings, Keyboard
from teleop_node.keys import HELP
from teleop_node.lifecycle import Signals
from teleop_node.screen import Screen
from teleop_node.settings import FIXED, Settings
from teleop_node.status_line import line_from_status
from teleop_node.terminal import descriptor, Terminal
from teleop_node.velocity_commands import VelocityCommands

#: How often keys are looked at, the line is written, peers are looked for, [s].
_KEY_PERIOD: Final = 0.02
_LINE_PERIOD: Final = 0.25
_PEERS_PERIOD: Final = 1.0
#: How often it is told that somebody is there, [s]: a few may be lost before a trial ends.
_HEARTBEAT_PERIOD: Final = 0.1
#: Longest wait for the standstill to arrive before this process pauses or ends.
_STANDSTILL_TIME: Final = Duration(nanoseconds=200_000_000)
#: How long `quit` may take to arrive, [s], and how long ending a trial and a series may take.
_FAREWELL: Final = 0.1
_LEAVING_TIME: Final = 4.0

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
        self._status = StatusTracker(
            self._full_name(self.settings.learner), self._full_name(self.settings.controller))
        self.screen = Screen(self.terminal, self._line, self.get_logger().info)
        self._keyboard = Keyboard(self.terminal)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._make_teaching(
            Timeouts(self, lambda: Future(executor=self.executor), steady))
        self._make_topics(steady)

    def _full_name(self, node: str) -> str:
        return node if node.startswith('/') else f'{self.get_namespace().rstrip("/")}/{node}'

    def _make_teaching(self, timeouts: Timeouts) -> None:
        placement = RobotPlacement(self, timeouts, self.settings.lockstep)
        self._commands = VelocityCommands(self, self.settings, partial(self._stamp, placement))
        peers = PeerMonitor(self, say=self.screen.say)
        self.service_clients = ServiceClients(
            self, self.settings.learner, self.settings.controller, self._status, peers, timeouts)
        self.teaching = Teaching(
            self.service_clients, placement, self._status, self._commands)
        # One that waits for an answer must keep neither the answer nor other requests waiting.
        group = ReentrantCallbackGroup()
        for action in Action:
            self.create_service(
                Trigger, f'~/{action}', self._service(action), callback_group=group)

    def _make_topics(self, steady: Clock) -> None:
        # A trial's end is soon followed by the next beginning: neither may be missed.
        self.create_subscription(
            DiagnosticStatus, 'trial', self._on_trial, qos.RECORDING_LATCHED)
        self.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda msg: self._status.on_diagnostics(msg, time.monotonic()), 10)
        heartbeat = self.create_publisher(Empty, 'teleop_heartbeat', qos.COMMAND)
        bindings = KeyBindings(
            self._commands, self.teaching, self._begin, self._change_speeds, self.screen.say)
        self.create_timer(_KEY_PERIOD, partial(self._look_at_keys, bindings), clock=steady)
        # From the loop that reads keys and answers: one that hangs falls silent.
        self.create_timer(_HEARTBEAT_PERIOD, lambda: heartbeat.publish(Empty()), clock=steady)
        self.create_timer(_LINE_PERIOD, self.screen.refresh, clock=steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_readers, clock=steady)

    def _service(self, action: Action) -> Any:
        async def serve(_: Any, response: Any) -> Any:
            response.success, response.message, _ = await self._perform(action)
            return response

        return serve

    def _on_settings(self, settings: Settings) -> None:
        self.settings = settings
        driving = self._commands.driving
        driving.speeds, driving.hold_time = settings.speeds, settings.hold_time

    @property
    def is_done(self) -> bool:
        """Whether the program is to end."""
        return self._keyboard.is_gone or self.teaching.has_quit

    # Keys and actions

    def _look_at_keys(self, bindings: KeyBindings) -> None:
        now = time.monotonic()
        bindings.on_typed(self._keyboard.read(now), now)
        self._commands.drive(now)

    def _begin(self, action: Action) -> None:
        assert self.executor is not None
        self.executor.create_task(self._perform(action))

    async def _perform(self, action: Action) -> Answer:
        answer = await self.teaching.perform(action)
        self.screen.say(answer.sentence)
        return answer

    async def leave(self) -> None:
        """End trial and series, and say so where there was any."""
        answer = await self.teaching.leave()
        if answer.message:
            self.screen.say(answer.sentence)

    def _change_speeds(self, key: str) -> None:
        speeds = changed_speeds(key, self.settings.speeds, self.settings.greatest)
        self.set_parameters_atomically([
            Parameter(name, value=value)
            for name, value in zip(('speed', 'turn'), speeds, strict=True)])

    def _stamp(self, placement: RobotPlacement) -> Any:
        """Return the stamp of a command; in lock-step it answers the last odometry."""
        odometry = placement.odometry if self.settings.lockstep else None
        return self.get_clock().now().to_msg() if odometry is None else odometry.header.stamp

    # The end, and pauses

    def stand_still(self) -> None:
        """Stop the robot and see that it gets to know, before this process pauses or ends."""
        self._commands.stand_still(_STANDSTILL_TIME)

    def pause(self) -> None:
        """Stop the robot and give the terminal back."""
        self._commands.stand_still(_STANDSTILL_TIME)
        if self.terminal is not None:
            self.terminal.write('\n')
            self.terminal.leave()

    def go_on(self) -> None:
        """Take the terminal again."""
        if self.terminal is not None:
            self.terminal.enter()

    # What comes in, and what of it is shown

    def _on_trial(self, msg: DiagnosticStatus) -> None:
        try:
            self._status.on_trial(trial_from_status(msg))
        except ValueError as error:
            self.screen.say(f'refused: {error}')

    def _look_at_readers(self) -> None:
        """Notice when nobody hears the commands, or who wants the other type."""
        topic = self.resolve_topic_name(self.settings.topic)
        problem, sentence = problem_with_readers(
            topic, f'geometry_msgs/msg/{self._commands.kind.__name__}',
            self.get_subscriptions_info_by_topic(topic))
        if sentence and problem != self._status.problem:
            self.screen.say(sentence)
        self._status.problem = problem

    def _line(self, width: int) -> str:
        return line_from_status(
            self._status.at(time.monotonic(), self.settings.speeds), width)


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
            signals.look(node, before=partial(_leave_nothing_driving, node, executor, signals))
        if not node.teaching.has_quit:
            _leave_nothing_driving(node, executor, signals)


def _leave_nothing_driving(node: TeleopNode, executor: Any, signals: Signals) -> None:
    """End trial and series before nobody watches them; a second Ctrl-C does not wait."""
    task = executor.create_task(node.leave())
    deadline = time.monotonic() + _LEAVING_TIME
    while not task.done() and time.monotonic() < deadline and rclpy.ok() and (
            not signals.is_impatient):
        executor.spin_once(_KEY_PERIOD)


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
