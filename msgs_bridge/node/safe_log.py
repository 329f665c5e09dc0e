"""Safe ROS logs: no control codes for the terminal, and no flood."""

import os
from typing import Any, Final

from rclpy.impl import rcutils_logger
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import RcutilsLogger

from msgs_bridge.node.throttled_log import LogRateLimiter
from msgs_bridge.untrusted.text import printable

_log: Final[Any] = RcutilsLogger.log
_rate_limiter: Final = LogRateLimiter()


def guard_logs() -> None:
    """
    Escape control codes in every line that a node of this process logs, and limit its rate.

    What is logged comes from topics, bags and names in a hundred places: guarding each place would
    leave one out. Calling it again changes nothing.
    """
    if RcutilsLogger.log is _safe_log:
        return
    # rclpy tells lines apart (once, throttled) by who calls; this file is none of them.
    rcutils_logger._internal_callers.append(os.path.realpath(__file__))
    setattr(RcutilsLogger, 'log', _safe_log)  # noqa: B010 - mypy lets no method be replaced


def _safe_log(self: Any, message: Any, severity: Any, **kwargs: Any) -> Any:
    text = printable(message)
    if severity > LoggingSeverity.DEBUG and not kwargs:  # others are throttled by rclpy itself
        text = _rate_limiter.limit(text, severity >= LoggingSeverity.ERROR)
        if not text:
            return False
    return _log(self, text, severity, **kwargs)
