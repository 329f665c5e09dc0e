"""
NumPy tables as PointCloud2 messages, and back.

A message is hostile until checked: nothing is allocated before its sizes have been compared with
the bytes that are really there.
"""

import array
from collections.abc import Iterable
from itertools import pairwise
import re
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import PointCloud2, PointField

#: PointField's datatypes as NumPy scalars, little endian.
_SCALARS: Final = {
    PointField.INT8: 'i1', PointField.UINT8: 'u1', PointField.INT16: '<i2',
    PointField.UINT16: '<u2', PointField.INT32: '<i4', PointField.UINT32: '<u4',
    PointField.FLOAT32: '<f4', PointField.FLOAT64: '<f8',
}
_DATATYPES: Final = {np.dtype(scalar): number for number, scalar in _SCALARS.items()}
#: Names of columns that are shown as they are.
_WORD: Final = re.compile(r'\w{1,40}', re.ASCII)


class TableError(ValueError):
    """A PointCloud2 message does not hold the table it should; the message says what is wrong."""


def cloud_from_table(
    table: npt.NDArray[np.void], frame_id: str, shape: tuple[int, int] | None = None,
) -> PointCloud2:
    """
    Write a structured array as a PointCloud2 message with a zero stamp.

    Parameters
    ----------
    table : ndarray, shape (n,) or (height, width)
        Structured; columns of little-endian integers up to 32 bits and float32/64, scalars or
        one-dimensional. Equal tables give equal bytes if their padding is zero.
    frame_id : str
        The frame of its columns x, y, z.
    shape : tuple of int, optional
        ``(height, width)``; ``(1, n)`` by default for a one-dimensional table.

    Raises
    ------
    TableError
        If a column is of a type that PointCloud2 has not.

    """
    shape = shape or (table.shape if table.ndim == 2 else (1, table.size))
    return cloud_of(table.dtype, array.array('B', table.tobytes()), frame_id, shape)


def cloud_of(
    dtype: np.dtype[np.void], data: 'array.array[int]', frame_id: str, shape: tuple[int, int],
) -> PointCloud2:
    """Return the message of a table whose bytes are there already; see `cloud_from_table`."""
    height, width = shape
    msg = PointCloud2(height=height, width=width, is_bigendian=False, is_dense=True)
    msg.header.frame_id = frame_id
    msg.fields = [_point_field(dtype, name) for name in dtype.names or ()]
    msg.point_step = dtype.itemsize
    msg.row_step = dtype.itemsize * width
    msg.data = data
    return msg


def _point_field(dtype: np.dtype[np.void], name: str) -> PointField:
    assert dtype.fields is not None
    column, offset = dtype.fields[name][:2]
    scalar, shape = column.base, column.shape
    if scalar not in _DATATYPES or len(shape) > 1:
        raise TableError(f'column {name} is of type {column}, which PointCloud2 has not')
    return PointField(name=name, offset=offset, datatype=_DATATYPES[scalar],
                      count=shape[0] if shape else 1)


def table_from_cloud(msg: Any, dtype: npt.DTypeLike) -> npt.NDArray[np.void]:
    """
    Read the columns of ``dtype`` out of a PointCloud2 message.

    Columns may stand in any order, with gaps and with others between them; both byte orders are
    read.

    Parameters
    ----------
    msg : PointCloud2
        What arrived.
    dtype : dtype
        Structured, as for `cloud_from_table`.

    Returns
    -------
    ndarray of ``dtype``, shape (height, width)
        A copy.

    Raises
    ------
    TableError
        If strides and sizes disagree with the data, or a column is missing, of another type or
        count, or lies outside the point.

    """
    wanted: np.dtype[np.void] = np.dtype(dtype)
    columns = columns_from_cloud(msg, wanted)
    table = np.zeros(next(iter(columns.values())).shape[:2], dtype=wanted)
    for name, column in columns.items():
        table[name] = column
    return table


def columns_from_cloud(msg: Any, dtype: npt.DTypeLike) -> dict[str, npt.NDArray[Any]]:
    """
    Find the columns of ``dtype`` in a PointCloud2 message; see `table_from_cloud`.

    Returns
    -------
    dict of ndarray, shape (height, width) and that of the column
        By name: views into the message, in its byte order.

    """
    wanted: np.dtype[np.void] = np.dtype(dtype)
    shape = _check_layout(msg)
    offsets = {name: _offset(msg, wanted, name) for name in wanted.names or ()}
    _check_overlap(wanted, offsets)
    order: Literal['<', '>'] = '>' if msg.is_bigendian else '<'
    data = np.frombuffer(msg.data, dtype=np.uint8)
    columns: dict[str, npt.NDArray[Any]] = {}
    for name, offset in offsets.items():
        column = wanted[name]
        base = column.base.newbyteorder(order)
        columns[name] = np.zeros((*shape, *column.shape), base) if 0 in shape else np.ndarray(
            (*shape, *column.shape), base, data, offset,
            (msg.row_step, msg.point_step, *(base.itemsize for _ in column.shape)))
    return columns


def _check_layout(msg: Any) -> tuple[int, int]:
    """Return (height, width) after comparing every size with the bytes that are there."""
    height, width, n_bytes = msg.height, msg.width, len(msg.data)
    if msg.point_step < 1:
        raise TableError(f'point_step is {msg.point_step}, must be 1 or more')
    if msg.row_step < width * msg.point_step:
        raise TableError(f'row_step is {msg.row_step}, must be {width} points of '
                         f'{msg.point_step} bytes or more')
    if height * msg.row_step != n_bytes:
        raise TableError(f'{n_bytes} bytes of data, must be {height} rows of {msg.row_step}')
    return (height, width) if height * width else (0, 0)


def _offset(msg: Any, wanted: np.dtype[np.void], name: str) -> int:
    """Find a column and compare it with what is wanted."""
    found = [field for field in msg.fields if field.name == name]
    if len(found) != 1:
        # A name may hold line breaks and worse: what is no plain word is quoted.
        names = ', '.join(field.name if _WORD.fullmatch(field.name) else repr(field.name[:20])
                          for field in msg.fields[:20])
        raise TableError(f'column {name} stands {len(found)} times, must once, among: {names}')
    field = found[0]
    column = wanted[name]
    count = column.shape[0] if column.shape else 1
    if _SCALARS.get(field.datatype) is None or np.dtype(_SCALARS[field.datatype]) != column.base:
        raise TableError(f'column {name} has datatype {field.datatype}, '
                         f'must be {_DATATYPES[column.base]} ({column.base})')
    if field.count != count:
        raise TableError(f'column {name} has count {field.count}, must be {count}')
    if field.offset + column.itemsize > msg.point_step:
        raise TableError(f'column {name} ends at byte {field.offset + column.itemsize}, '
                         f'must end within the point of {msg.point_step}')
    return int(field.offset)


def _check_overlap(wanted: np.dtype[np.void], offsets: dict[str, int]) -> None:
    spans = sorted((offset, offset + wanted[name].itemsize, name)
                   for name, offset in offsets.items())
    for (_, end, name), (start, _, other) in pairwise(spans):
        if start < end:
            raise TableError(f'columns {name} and {other} overlap at byte {start}')


def first_bad(good: npt.NDArray[np.bool_]) -> tuple[int, ...] | None:
    """Return the index of the first False, or None."""
    if good.all():
        return None
    return tuple(int(i) for i in np.unravel_index(int(np.argmin(good)), good.shape))


def check_column(
    what: str, name: str, values: npt.NDArray[Any], good: npt.NDArray[np.bool_], must: str,
) -> None:
    """
    Refuse a column if one of its values is not good.

    Raises
    ------
    TableError
        Naming table, column, place and value, and what it must be.

    """
    place = first_bad(good)
    if place is not None:
        raise TableError(f'{what}: {name} is {values[place]} at {place}, must be {must}')


def check_in(what: str, name: str, values: npt.NDArray[Any], allowed: Iterable[int]) -> None:
    """Refuse a column that holds anything but the allowed numbers; see `check_column`."""
    numbers = list(allowed)
    check_column(what, name, values, np.isin(values, numbers),
                 f'one of {", ".join(map(str, numbers))}')
