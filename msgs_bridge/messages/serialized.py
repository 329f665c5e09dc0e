"""Messages as bytes, for rooms that know no rclpy."""

import array
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


def cdr_from_cloud(cloud: Any) -> bytes:
    """
    Return the bytes of a PointCloud2; its data are copied once, not three times.

    In the message they are followed by one byte, `is_dense`, and follow their length.
    """
    data, cloud.data = cloud.data, array.array('B')
    empty = bytes(serialize_message(cloud))
    cloud.data = data
    return b''.join([empty[:-5], len(data).to_bytes(4, 'little'), data, empty[-1:]])
