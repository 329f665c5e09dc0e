"""Messages as bytes, for rooms that know no rclpy."""

from typing import Any

from rclpy.serialization import deserialize_message, serialize_message


def message_from_cdr(cdr: bytes, kind: Any) -> Any:
    """
    Return a message of a class from its bytes.

    Raises
    ------
    RuntimeError
        If they are none of that class.

    """
    return deserialize_message(cdr, kind)


def cdr_from_message(message: Any) -> bytes:
    """Return a message's bytes."""
    return bytes(serialize_message(message))
