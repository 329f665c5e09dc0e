"""The logs of ROS, made safe for text from elsewhere: no code that a terminal obeys gets there."""

import os
from typing import Any, Final

from rclpy.impl import rcutils_logger
from rclpy.impl.rcutils_logger import RcutilsLogger

from msgs_bridge.foreign_text import printable

_log: Final[Any] = RcutilsLogger.log


def guard_logs() -> None:
    """
    Let every line that a node of this process logs be one line, with its codes shown.

    What is logged comes from topics, bags and names in a hundred places: a door of their own each
    would be forgotten somewhere. Calling it again changes nothing.
    """
    if RcutilsLogger.log is _safe_log:
        return
    # rclpy tells lines apart (once, throttled) by who calls; this file is none of them.
    rcutils_logger._internal_callers.append(os.path.realpath(__file__))
    setattr(RcutilsLogger, 'log', _safe_log)  # noqa: B010 - mypy lets no method be replaced


def _safe_log(self: Any, message: Any, severity: Any, **kwargs: Any) -> Any:
    return _log(self, printable(message), severity, **kwargs)
