"""The type of `/tf` and `/tf_static`, where a ROS installation has it."""

from typing import Any


def transforms_type() -> Any:
    """Return the type of `/tf`; None where tf2_msgs is not installed."""
    try:
        from tf2_msgs.msg import TFMessage  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        return None
    return TFMessage
