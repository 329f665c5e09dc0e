"""What every node's `main` does: start ROS, work until a signal comes, say mistakes in a line."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
import os
import signal
import sys
from types import FrameType
from typing import Any, Final, NoReturn, TypeVar
import warnings

import rclpy
from rclpy import node as rclpy_node
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.logging import get_logger_effective_level, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.time_source import TimeSource
from rclpy.utilities import ok, try_shutdown

from msgs_bridge.node.command_line import begin, check_remappings, Program
from msgs_bridge.node.environment import prepare
from msgs_bridge.node.safe_log import guard_logs
from msgs_bridge.untrusted.text import printable

AnyNode = TypeVar('AnyNode', bound=Node)

#: Longest time until a signal is noticed, [s].
_PERIOD: Final = 0.2
#: Greatest ROS_DOMAIN_ID: there are no ports for more.
_MAX_DOMAIN: Final = 232


class _Signals:
    """Notes the signals that end a process, from its start on; whoever works looks here."""

    def __init__(self) -> None:
        self.came = False
        self.wake: Callable[[], None] = lambda: None

    def listen(self) -> None:
        """Begin to note; before ROS is there, so that no moment is left without a handler."""
        self.came = False
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            # With nohup the end of the terminal is nobody's end.
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True
        self.wake()


_signals: Final = _Signals()


class _CheckedClock(TimeSource):
    """Passes over a `/clock` before the beginning of time, of which rclpy's own would die."""

    def clock_callback(self, msg: Any) -> None:
        """Set the time."""
        node: Any = self._get_node()
        if msg.clock.sec >= 0:
            super().clock_callback(msg)
        elif node is not None:
            node.get_logger().warning(
                f'refused: /clock: sec is {msg.clock.sec}, must be 0 or more',
                throttle_duration_sec=5.0)


def run_node(
    program: Program, kind: Callable[[], AnyNode], args: list[str] | None = None,
    executor: Callable[[], Any] = SingleThreadedExecutor,
    is_over: Callable[[AnyNode], Any] = lambda node: False,
) -> AnyNode | None:
    """
    Run a node until a signal comes; what it has to do at its end is its `close`.

    Parameters
    ----------
    program : Program
        What --help says.
    kind : callable
        Makes the node. If that has a method `close`, it is called while ROS is still there,
        whether a signal or an exception ends the node.
    args : list of str, optional
        Those of the command line by default.
    executor : callable
        Makes the executor.
    is_over : callable
        Tells of the node whether its work is over without a signal.

    Returns
    -------
    Node or None
        The node, for which there is no ROS any more; None if a signal came before it was made.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong; with code
        0 after the page of help.

    """
    prepare()
    node = None
    try:
        node = start_node(program, kind, args)
        spin_until_signal(node, partial(is_over, node), executor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        try:
            if node is not None and ok():
                getattr(node, 'close', lambda: None)()
        finally:
            with suppress(rcl.RCLError):
                try_shutdown()
    return node


def start_node(
    program: Program, kind: Callable[[], AnyNode], args: list[str] | None,
) -> AnyNode:
    """
    Start ROS without its signal handlers, and make a node.

    Those of rclpy 7.1 lose signals that come just before `spin` (ADR 9): it then never ends.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong, or ROS
        cannot do what its environment asks for; with code 0 after the page of help.

    """
    _signals.listen()
    guard_logs()
    name = program.name
    try:
        begin(program, args)
        _check_domain()
        _start_ros(args)
        setattr(rclpy_node, 'TimeSource', _CheckedClock)  # noqa: B010 - a type is not assigned to
        with warnings.catch_warnings():
            # Where no node can be made, rclpy warns of what it cannot tidy up on top.
            warnings.simplefilter('ignore', RuntimeWarning)
            node = kind()
        check_remappings(node)
        return node
    except rcl.RCLError as error:
        exit_with(name, _without_sources(error))
    except (ValueError, ParameterException, NameValidationException) as error:
        exit_with(name, str(error))


def quickest_executor() -> Any:
    """Return the events executor; it needs 0.4 ms a tick where the usual one needs 0.9."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:  # it came to Jazzy with rclpy 7.1.4
        return SingleThreadedExecutor
    return EventsExecutor


def spin_until_signal(
    node: Node, is_over: Callable[[], Any] = lambda: False, executor: Any = None,
) -> None:
    """
    Work until a signal comes, or until something is so.

    ROS outlives the signal, so that the node can still tell others that it ends.
    """
    executor = executor or SingleThreadedExecutor()
    executor.add_node(node)
    _signals.wake = executor.wake
    try:
        while not _signals.came and not is_over() and ok():
            executor.spin_once(_PERIOD)
    finally:
        _signals.wake = lambda: None
        # One that is left to the garbage collector may fail with a traceback (rclpy 7.1).
        executor.shutdown()


def signal_came() -> bool:
    """Return whether a signal to end came since `start_node` began."""
    return _signals.came


def exit_with(name: str, problem: str) -> NoReturn:
    """Say a user's mistake in one line on stderr, and exit with code 2."""
    print(f'{name}:', printable(' '.join(problem.split())), file=sys.stderr)
    raise SystemExit(2)


def _start_ros(args: list[str] | None) -> None:
    """Start ROS; ValueError with one line, and nothing else logged, if its arguments are wrong."""
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it would say a part of it beforehand
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except (rcl.RCLError, rcl.UnknownROSArgsError) as error:
        raise ValueError(f'wrong ROS arguments: {_without_sources(error)}') from None
    finally:
        if get_logger_effective_level('rcl') == LoggingSeverity.FATAL:
            set_logger_level('rcl', LoggingSeverity.UNSET)


def _check_domain() -> None:
    """Refuse a domain without ports; ROS would print a page about it."""
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain.isdecimal() and int(domain) > _MAX_DOMAIN:
        raise ValueError(f'ROS_DOMAIN_ID is {domain}, must be in 0 ... {_MAX_DOMAIN}')


def _without_sources(error: Exception) -> str:
    """Return what ROS says, without the places in its sources."""
    return str(error).split(', at /')[0].removeprefix('failed to initialize rcl: ')
