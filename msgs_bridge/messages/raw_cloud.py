"""A PointCloud2 read from its bytes; nothing is copied."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from msgs_bridge.messages.cdr import CdrError, layout_from_cdr, POINT_CLOUD
from msgs_bridge.messages.clouds import TableError


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


def cloud_from_cdr(message: bytes | memoryview) -> RawCloud:
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
