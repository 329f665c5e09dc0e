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
from msgs_bridge.node.node_info import Operation
from msgs_bridge.node.parameters import declare_parameters_from
from msgs_bridge.node.peers import PeerMonitor
from msgs_bridge.node.run import start_node
from msgs_bridge.node.throttled_log import LogRateLimiter
from teleop_node.asking import Asking
from teleop_node.commands import Commands
from teleop_node.driving import changed_speeds, FACTORS, MOVES, STANDING
from teleop_node.facts import Gathered, problem_with_readers
from teleop_node.keys import Action, ACTIONS, HELP, KeyParser, OTHER, Presses
from teleop_node.lifecycle import Signals
from teleop_node.pastes import PASTED, Pastes
from teleop_node.placing import Placing, where_to_teach
from teleop_node.settings import FIXED, Settings
from teleop_node.status_line import line_from_facts, line_over, message_over
from teleop_node.teaching import Answer, PATIENCE, Teaching
from teleop_node.terminal import descriptor, Terminal

#: How often keys are looked at, the line is written, peers are looked for, [s].
_KEY_PERIOD: Final = 0.02
_LINE_PERIOD: Final = 0.25
_PEERS_PERIOD: Final = 1.0
#: How often it is told that somebody is there, [s]: a few may be lost before a trial ends.
_HEARTBEAT_PERIOD: Final = 0.1
#: How long `quit` may take to arrive, [s], and how long ending a trial and a series may take.
_FAREWELL: Final = 0.1
_LEAVING_TIME: Final = 4.0

#: Services that end a trial, which is right whoever hears it; keeping a drive is, too.
_ENDING: Final = ('/stop_trial', '/stop_trials')

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
        self.has_left = False  #: whether trial and series have been ended already
        self._is_stopping = False
        self._parser, self._presses, self._pastes = KeyParser(), Presses(), Pastes()
        self._problem = ''
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._gathered = Gathered(
            self._full_name(self.settings.learner), self._full_name(self.settings.controller))
        self._teaching = Teaching(self, self.settings.learner, self.settings.controller)
        self._rate_limiter = LogRateLimiter()
        self._peers = PeerMonitor(self, say=self._say)
        self._make_topics()
        self._make_services()
        self.create_timer(_KEY_PERIOD, self._look_at_keys, clock=self._steady)
        # From the loop that reads keys and answers: one that hangs falls silent.
        self.create_timer(
            _HEARTBEAT_PERIOD, lambda: self._heartbeat.publish(Empty()), clock=self._steady)
        self.create_timer(_LINE_PERIOD, self._write_line, clock=self._steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_peers, clock=self._steady)

    def _full_name(self, node: str) -> str:
        return node if node.startswith('/') else f'{self.get_namespace().rstrip("/")}/{node}'

    def _make_topics(self) -> None:
        self._commands = Commands(self, self.settings, self._stamp)
        self._heartbeat = self.create_publisher(Empty, 'teleop_heartbeat', qos.COMMAND)
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
        self._asking = Asking(
            self, self.settings.learner, self.settings.controller,
            lambda: Future(executor=self.executor), self._steady)
        self._placing = Placing(self, self._asking, self.settings.lockstep)

    def _service(self, action: Action) -> Any:
        async def serve(_: Any, response: Any) -> Any:
            response.success, response.message = await self._perform(action)
            return response

        return serve

    def _on_settings(self, settings: Settings) -> None:
        self.settings = settings
        driving = self._commands.driving
        driving.speeds, driving.hold_time = settings.speeds, settings.hold_time

    # Keys

    def _look_at_keys(self) -> None:
        now = time.monotonic()
        if self.terminal is not None:
            data = self.terminal.read()
            self.is_done = self.is_done or data is None
            keys, is_pasted = self._pastes.typed(self._parser.feed(data or b'', now), now)
            if is_pasted:
                self._stop(OTHER, new=True)
                self._say(PASTED)
            for key in keys:
                self._on_key(key, now)
        self._commands.drive(now)

    def _on_key(self, key: str, now: float) -> None:
        new = self._presses.is_new(key, now)
        action = ACTIONS.get(key, Action.STOP)
        if key in MOVES and key != STANDING:
            self._commands.driving.press(key, now)
        elif key in FACTORS:
            self._change_speeds(key)
        elif action is Action.STOP:
            self._stop(key, new)
        else:
            self.let_go()
            if new:
                self._begin(action)

    def _begin(self, action: Action) -> None:
        assert self.executor is not None
        self.executor.create_task(self._perform(action))

    def _stop(self, key: str, new: bool) -> None:
        """Stop the robot, whatever key that is; it ends what drives by itself, too."""
        self.halt()
        tries = self._teaching.drives_by_itself
        if not self._is_stopping and (tries or (new and key in ACTIONS)):
            self._begin(Action.STOP)
        elif new and key.lower() in MOVES and key != STANDING and key:
            self._say('capital letters do not drive: is caps lock on?')

    def _change_speeds(self, key: str) -> None:
        speeds = changed_speeds(key, self.settings.speeds, self.settings.greatest)
        self.set_parameters_atomically([
            Parameter(name, value=value)
            for name, value in zip(('speed', 'turn'), speeds, strict=True)])

    async def _perform(self, action: Action) -> Answer:
        self._is_stopping = self._is_stopping or action is Action.STOP
        try:
            answer = await self._teaching.perform(action)
        finally:
            self._is_stopping = self._is_stopping and action is not Action.STOP
        self._say(answer.sentence)
        return answer

    # Commands

    def _stamp(self) -> Any:
        """Return the stamp of a command; in lock-step it answers the last odometry."""
        odometry = self._placing.odometry if self.settings.lockstep else None
        return self.get_clock().now().to_msg() if odometry is None else odometry.header.stamp

    def stand_still(self) -> None:
        """Stop the robot and see that it gets to know, before this process pauses or ends."""
        self._commands.stand_still(lambda seconds: Duration(nanoseconds=round(seconds * 1e9)))

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

    def _on_trial(self, msg: DiagnosticStatus) -> None:
        try:
            self._gathered.saw_trial(trial_from_status(msg))
        except ValueError as error:
            self._say(f'refused: {error}')

    def _look_at_peers(self) -> None:
        """Notice when nobody hears the commands, or who wants the other type."""
        topic = self.resolve_topic_name(self.settings.topic)
        problem, sentence = problem_with_readers(
            topic, f'geometry_msgs/msg/{self._commands.kind.__name__}',
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
        text = self._rate_limiter.limit(text)
        if text:
            self.terminal.write(message_over(text))
            self._write_line()

    async def leave(self) -> None:
        """End trial and series, and say so where there was any."""
        answer = await self._teaching.leave()
        if answer.message:
            self._say(answer.sentence)

    # What actions ask for (teaching.Peers)

    async def ask(
        self, service: str, on: bool | None = None, patience: float = PATIENCE,
    ) -> Answer:
        """Call a service of learner or controller; where there are two, only one that ends."""
        # A request reaches whichever of them is there, the neighbour's, too.
        if on is not False and not service.endswith(_ENDING) and (
                why := self._peers.why_not(Operation.CHANGE)):
            return Answer(False, why)
        answer = await self._asking.ask(service, on, patience)
        self._gathered.saw_answer(on, answer.success, time.monotonic())
        if service.endswith('/stop_trials') and answer.success:
            self._gathered.saw_end_of_series()
        if service.endswith('/run_trials') and answer.success:
            self._gathered.saw_series(time.monotonic())
        if service.endswith('/discard_demonstration'):
            self._gathered.saw_answer(False, answer.success, time.monotonic())
        return answer

    async def is_simulated(self) -> bool | None:
        """Ask the learner whether it may set the robot back; None if it does not answer."""
        return await self._asking.is_simulated()

    async def set_back(self, to_start: bool) -> Answer:
        """Set a simulated robot to where trials start, or where the demonstration began."""
        if to_start:
            return await self._placing.set_to_start(self._gathered.start)
        return await self._placing.set_back()

    async def set_where_to_teach(self) -> Answer:
        """Set a simulated robot to the next place where a demonstration would help."""
        return await self._placing.set_to_next(self._gathered.teach_here)

    def where_to_teach(self) -> Answer:
        """Say where a demonstration would help most."""
        return where_to_teach(self._gathered.teach_here)

    def is_trying(self) -> bool:
        """Tell whether a trial runs."""
        return self._gathered.is_trying

    def has_series(self) -> bool:
        """Tell whether the learner runs trials by itself, as far as is known."""
        return self._gathered.has_series(time.monotonic())

    def is_recording(self) -> bool:
        """Tell whether the learner records a demonstration."""
        return self._gathered.is_recording(time.monotonic())

    def demonstration_began(self) -> None:
        """Keep where it began."""
        self._placing.demonstration_began()

    def halt(self) -> None:
        """Stop the robot, whoever drives it."""
        self._commands.halt()

    def let_go(self) -> None:
        """Stop driving; who does not drive stays silent, and takes no trial over."""
        self._commands.let_go()

    def quit(self) -> None:
        """End the program; nothing drives on that nobody would watch."""
        self.is_done = self.has_left = True


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
        if not node.has_left:
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
