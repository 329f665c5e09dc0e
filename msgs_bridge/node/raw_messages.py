"""
Messages as the bytes they arrive in: refused by size before anything is made of them.

Making a message of 60 MB takes rclpy a second, in which its executor does nothing else. What must
never be held up takes bytes and reads them itself.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from msgs_bridge.node.qos import hear_all

#: No pose, command or 3x3 local grid is longer, [bytes].
MOST_BYTES: Final = 16_384


def small_only(
    kind: type, topic: str, callback: Callable[[Any], None], refuse: Callable[[str], None],
) -> Callable[[bytes | int], None]:
    """
    Return a callback for a raw subscription, or for `Ears`, that makes messages of what is small.

    Parameters
    ----------
    kind : type
        Of the message.
    topic : str
        What an error calls it.
    callback : callable
        Gets the message.
    refuse : callable
        Gets one line about what is too long or no message at all.

    """
    def take(message: bytes | int) -> None:
        size = message if isinstance(message, int) else len(message)
        if isinstance(message, int) or size > MOST_BYTES:
            refuse(f'{topic}: a message has {size} bytes, must have at most {MOST_BYTES}')
            return
        try:
            msg = deserialize_message(message, kind)
        except (RuntimeError, ValueError):
            refuse(f'{topic}: the bytes of a message are no {kind.__name__}')
            return
        callback(msg)

    return take


def hear_small(
    node: Node, kind: type, topic: str, callback: Callable[[Any], None],
    profiles: Sequence[QoSProfile], refuse: Callable[[str], None],
) -> None:
    """Subscribe to a topic of small messages, once a profile; see `small_only`."""
    hear_all(node, kind, topic, small_only(kind, topic, callback, refuse), profiles, raw=True)

