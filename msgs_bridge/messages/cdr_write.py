"""Write CDR: the few messages that are made from others, with the same bytes every time."""

from collections.abc import Mapping
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from msgs_bridge.messages.cdr import Fields, OCCUPANCY_GRID, POSE_STAMPED

_PLAIN: Final = b'\x00\x01\x00\x00'


def cdr_from_struct(fields: Fields, values: Mapping[str, Any]) -> bytes:
    """
    Return a message; the inverse of `cdr.struct_from_cdr` for messages without structs.

    Parameters
    ----------
    fields : Fields
        What it is made of.
    values : mapping
        By field; numbers that are not given are 0. Padding is 0, too.

    """
    data = bytearray(_PLAIN)

    def put(scalar: str, numbers: Any) -> None:
        array = np.asarray(numbers, f'<{scalar}')
        data.extend(bytes((4 - len(data)) % array.itemsize) + array.tobytes())

    for name, code in fields:
        kind = str(code)
        value = values.get(name, 0)
        if kind == 'str':
            value, kind = np.frombuffer(value.encode() + b'\0', np.uint8), 'u1[]'
        if kind.endswith('[]'):
            put('u4', len(value))
        put(kind.removesuffix('[]'), value)
    return bytes(data)


def pose_stamped_to_cdr(stamp_ns: int, frame_id: str, x: float, y: float, yaw: float) -> bytes:
    """Return a PoseStamped message; ``yaw`` in [rad]."""
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    return cdr_from_struct(POSE_STAMPED, {
        'sec': sec, 'nanosec': nanosec, 'frame_id': frame_id, 'x': x, 'y': y,
        'qz': math.sin(yaw / 2.0), 'qw': math.cos(yaw / 2.0)})


def neighbourhood_to_cdr(
    stamp_ns: int, cells: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid,
) -> bytes:
    """Return a 3x3 OccupancyGrid message, ``cells`` around ``cell`` of ``grid``."""
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    return cdr_from_struct(OCCUPANCY_GRID, {
        'sec': sec, 'nanosec': nanosec, 'frame_id': grid.frame_id, 'load_sec': sec,
        'load_nanosec': nanosec, 'resolution': grid.resolution, 'width': 3, 'height': 3,
        'x': grid.origin_x + (cell[1] - 1) * grid.resolution,
        'y': grid.origin_y + (cell[0] - 1) * grid.resolution, 'qw': 1.0,
        'data': np.ravel(cells)})
