"""
CDR: where the fields of a serialised message lie.

Only the messages that are learnt from are described here. A message is hostile until checked: no
length is believed unless there are as many bytes.
"""

from dataclasses import dataclass, field
import struct
from typing import Any, Final, Literal, NamedTuple

import numpy as np

Order = Literal['<', '>']
#: Codes of fields: NumPy scalars; ``f8*36`` fixed arrays; ``str``; ``i1[]`` sequences of bytes;
#: a tuple of fields for a sequence of structs. A ``!`` marks numbers that shape the message.
Code = str | tuple[tuple[str, Any], ...]
Fields = tuple[tuple[str, Code], ...]

_HEADER: Final[Fields] = (('sec', 'i4'), ('nanosec', 'u4'), ('frame_id', 'str'))
_POSE: Final[Fields] = tuple(
    (name, 'f8') for name in ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'))
_TWIST: Final[Fields] = tuple(
    (name, 'f8') for name in ('vx', 'vy', 'vz', 'wx', 'wy', 'wz'))

ODOMETRY: Final[Fields] = (
    *_HEADER, ('child_frame_id', 'str'), *_POSE, ('pose_covariance', 'f8*36'), *_TWIST,
    ('twist_covariance', 'f8*36'))
TWIST: Final = _TWIST
TWIST_STAMPED: Final[Fields] = (*_HEADER, *_TWIST)
POSE_STAMPED: Final[Fields] = (*_HEADER, *_POSE)
POSE_WITH_COVARIANCE_STAMPED: Final[Fields] = (*POSE_STAMPED, ('covariance', 'f8*36'))
OCCUPANCY_GRID: Final[Fields] = (
    *_HEADER, ('load_sec', 'i4'), ('load_nanosec', 'u4'), ('resolution', 'f4'),
    ('width', 'u4'), ('height', 'u4'), *_POSE, ('data', 'i1[]'))
LASER_SCAN: Final[Fields] = (
    *_HEADER, *((name, 'f4') for name in (
        'angle_min', 'angle_max', 'angle_increment', 'time_increment', 'scan_time', 'range_min',
        'range_max')), ('ranges', 'f4[]'), ('intensities', 'f4[]'))
POINT_CLOUD: Final[Fields] = (
    *_HEADER, ('height', 'u4!'), ('width', 'u4!'),
    ('fields', (('name', 'str'), ('offset', 'u4'), ('datatype', 'u1'), ('count', 'u4'))),
    ('is_bigendian', 'u1!'), ('point_step', 'u4!'), ('row_step', 'u4!'), ('data', 'u1[]'),
    ('is_dense', 'u1'))
DIAGNOSTIC_STATUS: Final[Fields] = (
    ('level', 'u1'), ('name', 'str'), ('message', 'str'), ('hardware_id', 'str'),
    ('values', (('key', 'str'), ('value', 'str'))))

#: The messages that are described, by type.
DESCRIBED: Final[dict[str, Fields]] = {
    'nav_msgs/msg/Odometry': ODOMETRY,
    'nav_msgs/msg/OccupancyGrid': OCCUPANCY_GRID,
    'geometry_msgs/msg/Twist': TWIST,
    'geometry_msgs/msg/TwistStamped': TWIST_STAMPED,
    'geometry_msgs/msg/PoseStamped': POSE_STAMPED,
    'geometry_msgs/msg/PoseWithCovarianceStamped': POSE_WITH_COVARIANCE_STAMPED,
    'sensor_msgs/msg/PointCloud2': POINT_CLOUD,
    'diagnostic_msgs/msg/DiagnosticStatus': DIAGNOSTIC_STATUS,
}

#: First bytes of everything that zstd packed, and what that means for a message.
_ZSTD: Final = b'\x28\xb5\x2f\xfd'
_COMPRESSED: Final = (
    'its messages are compressed one by one (zstd), which only metadata.yaml tells: put the '
    'metadata.yaml of that bag back beside its files and name the folder')


class CdrError(ValueError):
    """The bytes are no such message."""


class Place(NamedTuple):
    """Where a field's numbers lie: offset [bytes], type without byte order, how many."""

    offset: int
    scalar: str
    n: int


@dataclass
class Layout:
    """
    Where everything in a message lies.

    Parameters
    ----------
    order : str
        Byte order, ``<`` or ``>``.
    size : int
        Bytes of the message that are accounted for.
    places : dict of str to Place
        The numbers.
    values : dict
        Whatever shapes the message: texts, lists of structs, numbers marked so.
    frozen : list of (int, int)
        Spans of bytes that are equal in every message of this layout: all that shapes it.

    """

    order: Order
    size: int = 0
    places: dict[str, Place] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)
    frozen: list[tuple[int, int]] = field(default_factory=list)

    def numbers(
        self, message: bytes | memoryview, name: str,
    ) -> np.ndarray[Any, np.dtype[Any]]:
        """Return the numbers of a field of a message of this layout, shape (count,)."""
        place = self.places[name]
        return np.frombuffer(message, self.order + place.scalar, place.n, place.offset)


def layout_from_cdr(fields: Fields, message: bytes | memoryview) -> Layout:
    """
    Find the fields of a message.

    Parameters
    ----------
    fields : Fields
        What it is made of, see `DESCRIBED`.
    message : bytes or memoryview
        With its 4 bytes of encapsulation.

    Raises
    ------
    CdrError
        If it ends too early, is encapsulated in another way, or compressed.

    """
    if message[:4] == _ZSTD:
        raise CdrError(_COMPRESSED)
    if message[:2] not in (b'\x00\x01', b'\x00\x00'):
        raise CdrError(f'its encapsulation is {message[:2].hex() or "missing"}, must be plain CDR')
    walk = _Walk(message, Layout('<' if message[1] else '>'))
    try:
        for name, code in fields:
            walk.field(name, code)
    except (struct.error, UnicodeDecodeError, IndexError):
        raise CdrError(f'it ends or makes no sense at byte {walk.at} of {len(message)}') from None
    walk.layout.size = walk.at
    return walk.layout


def struct_from_cdr(fields: Fields, message: bytes) -> dict[str, Any]:
    """
    Return all fields of a message by name: numbers, arrays, texts and lists of dicts.

    Raises
    ------
    CdrError
        See `layout_from_cdr`.

    """
    layout = layout_from_cdr(fields, message)
    values = dict(layout.values)
    for name in layout.places:
        if name not in values:
            numbers = layout.numbers(message, name)
            is_array = any(mark in str(dict(fields)[name]) for mark in ('*', '[]'))
            values[name] = numbers if is_array else numbers[0].item()
    return values


class _Walk:
    """Goes through a message field by field."""

    def __init__(self, message: bytes | memoryview, layout: Layout) -> None:
        self.message, self.layout, self.at = message, layout, 4
        self._u4 = struct.Struct(layout.order + 'I')

    def field(self, name: str, code: Code) -> None:
        if isinstance(code, tuple):
            count = self._count(len(code))
            self.layout.values[name] = [self._struct(code) for _ in range(count)]
        elif code == 'str':
            self.layout.values[name] = self._text()
        elif code.endswith('[]'):
            self._numbers(name, code[:-2], self._count(1))
        else:
            scalar, _, count_text = code.rstrip('!').partition('*')
            start = self._numbers(name, scalar, int(count_text or 1))
            if code.endswith('!'):
                self.layout.values[name] = self.layout.numbers(self.message, name)[0].item()
                self.layout.frozen.append((start, self.at))

    def _numbers(self, name: str, scalar: str, count: int) -> int:
        size = int(scalar[-1])
        start = self._align(size) if count else self.at
        self._step(size * count)
        self.layout.places[name] = Place(start, scalar, count)
        return start

    def _struct(self, fields: Fields) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for name, code in fields:
            if code == 'str':
                values[name] = self._text()
            else:
                form = struct.Struct(self.layout.order + {'u4': 'I', 'u1': 'B'}[str(code)])
                values[name] = form.unpack_from(self.message, self._frozen(form.size))[0]
        return values

    def _text(self) -> str:
        n = self._count(1)
        start = self._frozen(n, align=1)
        return bytes(self.message[start:start + max(n - 1, 0)]).decode()

    def _count(self, least_size: int) -> int:
        """Read a length; so many parts must at least fit into what is left."""
        count: int = self._u4.unpack_from(self.message, self._frozen(4))[0]
        if self.at + count * least_size > len(self.message):
            raise IndexError
        return count

    def _frozen(self, size: int, align: int = 0) -> int:
        """Step over bytes that shape the message; the padding before them may be anything."""
        self._align(align or size)
        start = self._step(size)
        self.layout.frozen.append((start, self.at))
        return start

    def _align(self, size: int) -> int:
        self.at += (4 - self.at) % size
        return self.at

    def _step(self, size: int) -> int:
        start = self.at
        if start + size > len(self.message):
            raise IndexError
        self.at += size
        return start
