"""
Messages as the bytes they arrive in: refused by size before anything is made of them.

Making a message of 60 MB takes rclpy a second, in which its executor does nothing else. What must
never be held up takes bytes and reads them itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from msgs_bridge.messages.cdr import CdrError, layout_from_cdr, POINT_CLOUD
from msgs_bridge.messages.clouds import TableError
from msgs_bridge.node.qos import hear_all

#: No pose, command or 3x3 sight is longer, [bytes].
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


@dataclass(frozen=True, slots=True)
class _Header:
    frame_id: str


@dataclass(frozen=True, slots=True)
class _Column:
    name: str
    offset: int
    datatype: int
    count: int


@dataclass(frozen=True, slots=True)
class RawCloud:
    """
    A PointCloud2 whose data stay where they arrived; it has the message's own attributes.

    Parameters
    ----------
    header, fields, height, width, is_bigendian, point_step, row_step
        As in the message.
    data : ndarray of uint8
        A view.

    """

    header: _Header
    fields: list[_Column]
    height: int
    width: int
    is_bigendian: bool
    point_step: int
    row_step: int
    data: np.ndarray[Any, np.dtype[np.uint8]]


def cloud_from_cdr(message: bytes) -> RawCloud:
    """
    Read a PointCloud2 from its bytes; nothing is copied.

    Raises
    ------
    TableError
        If the bytes are no such message.

    """
    try:
        layout = layout_from_cdr(POINT_CLOUD, message)
    except CdrError as error:
        raise TableError(f'its bytes are no PointCloud2: {error}') from None
    values = layout.values
    return RawCloud(
        _Header(values['frame_id']), [_Column(**column) for column in values['fields']],
        values['height'], values['width'], bool(values['is_bigendian']), values['point_step'],
        values['row_step'], layout.numbers(message, 'data'))
