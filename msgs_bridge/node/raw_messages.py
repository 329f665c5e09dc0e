"""
Raw messages: refused by size before they are deserialized.

Deserializing 60 MB takes rclpy a second, in which its executor does nothing else. A node that must
never be held up takes bytes, and deserializes what is small.
"""

from collections.abc import Callable
from typing import Any, Final

from rclpy.serialization import deserialize_message

#: No pose, command or 3x3 local grid has more, [bytes].
MOST_BYTES: Final = 16_384


def small_only(
    kind: type, topic: str, callback: Callable[[Any], None], refuse: Callable[[str], None],
) -> Callable[[bytes | int], None]:
    """
    Return a callback for a raw subscription that deserializes messages of at most `MOST_BYTES`.

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
