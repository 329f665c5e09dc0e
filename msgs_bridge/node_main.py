"""What every node's `main` does: start ROS, work until a signal comes, say mistakes in a line."""

from collections.abc import Callable
import signal
import sys
from typing import Any, NoReturn, TypeVar

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok

AnyNode = TypeVar('AnyNode', bound=Node)

#: How often the reason to end is looked at when nothing else happens, [s].
_PERIOD = 1.0
#: The signals that came, and whom to wake then: a process has one node.
_signals: list[int] = []
_woken: list[SingleThreadedExecutor] = []


def start_node(name: str, kind: Callable[[], AnyNode], args: list[str] | None) -> AnyNode:
    """
    Start ROS without its signal handlers, and make a node.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except (rcl.RCLError, rcl.UnknownROSArgsError) as error:
        exit_with(name, f'wrong ROS arguments: {str(error).split(", at /")[0]}')
    try:
        return kind()
    except (ValueError, ParameterException) as error:
        exit_with(name, str(error))


def spin_until_signal(node: Node, is_over: Callable[[], Any] = bool) -> None:
    """
    Work until SIGINT or SIGTERM, or until something is so.

    ROS outlives the signal, so that the node can still tell others that it ends.
    """
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    _woken.append(executor)
    while not _signals and not is_over() and ok():
        executor.spin_once(_PERIOD)


def _stop(number: int, _: Any) -> None:
    """Note a signal; a node that is being made, or works, is not torn apart by it."""
    _signals.append(number)
    for executor in _woken:
        executor.wake()


def exit_with(name: str, problem: str) -> NoReturn:
    """Say a user's mistake in one line on stderr, and exit with code 2."""
    print(f'{name}:', ' '.join(problem.split()), file=sys.stderr)
    raise SystemExit(2)
