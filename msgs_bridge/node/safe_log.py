"""The logs of ROS, made safe: no code that a terminal obeys gets there, and no flood."""

import os
from typing import Any, Final

from rclpy.impl import rcutils_logger
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import RcutilsLogger

from msgs_bridge.node.log_valve import Valve
from msgs_bridge.untrusted.text import printable

_log: Final[Any] = RcutilsLogger.log
_valve: Final = Valve()


def guard_logs() -> None:
    """
    Let every line that a node of this process logs be one line, with its codes shown.

    And let nobody fill the disk: of one kind so many are said as a person can read, then how many
    were not. What is logged comes from topics, bags and names in a hundred places: a door of their
    own each would be forgotten somewhere. Calling it again changes nothing.
    """
    if RcutilsLogger.log is _safe_log:
        return
    # rclpy tells lines apart (once, throttled) by who calls; this file is none of them.
    rcutils_logger._internal_callers.append(os.path.realpath(__file__))
    setattr(RcutilsLogger, 'log', _safe_log)  # noqa: B010 - mypy lets no method be replaced


def _safe_log(self: Any, message: Any, severity: Any, **kwargs: Any) -> Any:
    text = printable(message)
    if severity > LoggingSeverity.DEBUG and not kwargs:  # others are throttled by rclpy itself
        text = _valve.let(text, severity >= LoggingSeverity.ERROR)
        if not text:
            return False
    return _log(self, text, severity, **kwargs)
