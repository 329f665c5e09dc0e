"""Write CDR: the few messages that are made from others, with the same bytes every time."""

import math
import struct
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid

_PLAIN: Final = b'\x00\x01\x00\x00'


class CdrWriter:
    """Appends fields, each aligned to its size; padding is 0."""

    def __init__(self) -> None:
        """Start with the encapsulation."""
        self._data = bytearray(_PLAIN)

    def put(self, form: str, *values: float) -> 'CdrWriter':
        """Add numbers of one type, such as ``d``."""
        size = struct.calcsize(form)
        for value in values:
            self._data += bytes((4 - len(self._data)) % size) + struct.pack(f'<{form}', value)
        return self

    def text(self, text: str) -> 'CdrWriter':
        """Add a text."""
        data = text.encode() + b'\0'
        self.put('I', len(data))
        self._data += data
        return self

    def raw(self, data: bytes) -> 'CdrWriter':
        """Add a sequence of bytes."""
        self.put('I', len(data))
        self._data += data
        return self

    def message(self) -> bytes:
        """Return the message."""
        return bytes(self._data)


def _header(stamp_ns: int, frame_id: str) -> CdrWriter:
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    return CdrWriter().put('i', sec).put('I', nanosec).text(frame_id)


def pose_stamped_to_cdr(stamp_ns: int, frame_id: str, x: float, y: float, yaw: float) -> bytes:
    """Return a PoseStamped message; ``yaw`` in [rad]."""
    turn = 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)
    return _header(stamp_ns, frame_id).put('d', x, y, 0.0, *turn).message()


def neighbourhood_to_cdr(
    stamp_ns: int, cells: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid,
) -> bytes:
    """Return a 3x3 OccupancyGrid message, ``cells`` around ``cell`` of ``grid``."""
    low_x = grid.origin_x + (cell[1] - 1) * grid.resolution
    low_y = grid.origin_y + (cell[0] - 1) * grid.resolution
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    msg = _header(stamp_ns, grid.frame_id).put('i', sec).put('I', nanosec)
    msg.put('f', grid.resolution).put('I', 3, 3).put('d', low_x, low_y, 0.0, 0.0, 0.0, 0.0, 1.0)
    return msg.raw(np.ascontiguousarray(cells, dtype=np.int8).tobytes()).message()
