"""The 3x3 neighbourhood from a larger OccupancyGrid, such as Nav2's local costmap."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from msgs_bridge.messages.poses import check_frame
from msgs_bridge.sensing.local_grid_from_scan import bounded, corner_of

#: How much of a costmap's cell may lie over an edge before it counts on the other side.
_OVERLAP: Final = 1e-3


def neighbourhood_from_costmap(
    costmap: Grid, values: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid, *,
    lethal: int = 65, radius: float = 0.0, seen_share: float = 0.5, name: str = 'costmap',
) -> npt.NDArray[np.int8]:
    """
    Return what a costmap shows of a cell and the eight around it.

    A cell is blocked when one of the costmap's cells is lethal that overlaps it, or that the
    robot's disc would touch on the cell's centre; free when enough of it is known; else unknown.

    Parameters
    ----------
    costmap : Grid
        Its cells, of any resolution and origin.
    values : ndarray of int8, shape (n_rows, n_cols)
        0 to 100, -1 unknown.
    cell : tuple of int
        ``(row, col)`` in the middle.
    grid : Grid
        The workspace; what lies outside it is blocked.
    lethal : int
        Least value that blocks. Nav2 writes 100 where something is, 99 within the robot's
        inscribed radius of it, less around that.
    radius : float, [m]
        Of the robot's disc; 0 where the costmap is inflated and ``lethal`` is below 100.
    seen_share : float, 0 to 1
        Share of a cell that must be known before it is called free.
    name : str
        What an error calls it.

    Raises
    ------
    ValueError
        If it is in another frame than ``grid``, or the shape is not the costmap's.

    """
    check_frame(costmap.frame_id, grid.frame_id, name)
    if values.shape != costmap.shape:
        raise ValueError(f'{name}: shape is {values.shape}, must be {costmap.shape}')
    cells = np.full((3, 3), UNKNOWN, dtype=np.int8)
    low_x, low_y = corner_of(cell, grid)
    for row in range(3):
        for col in range(3):
            x, y = low_x + col * grid.resolution, low_y + row * grid.resolution
            cells[row, col] = _state(costmap, values, x, y, grid.resolution, lethal, radius,
                                     seen_share)
    return bounded(cells, cell, grid)


def _state(
    costmap: Grid, values: npt.NDArray[np.int8], x: float, y: float, side: float, lethal: int,
    radius: float, seen_share: float,
) -> int:
    """Return the state of the square whose lower left corner is ``(x, y)``."""
    reach = max(radius, side / 2.0)
    rows, low_y, high_y = _spans(y + side / 2.0, reach, costmap.origin_y, costmap.n_rows,
                                 costmap.resolution)
    cols, low_x, high_x = _spans(x + side / 2.0, reach, costmap.origin_x, costmap.n_cols,
                                 costmap.resolution)
    part = values[rows, cols]
    across, along = _overlap(low_x, high_x, side), _overlap(low_y, high_y, side)
    shared = along[:, np.newaxis] * across
    apart = np.hypot(_gap(low_x, high_x), _gap(low_y, high_y)[:, np.newaxis])
    least = _OVERLAP * costmap.resolution
    overlaps = (along > least)[:, np.newaxis] & (across > least)
    if ((part >= lethal) & (overlaps | (apart < radius - least))).any():
        return BLOCKED
    known = float(shared[part != UNKNOWN].sum()) / (side * side)
    return FREE if known >= seen_share - 1e-9 else UNKNOWN


def _spans(
    centre: float, reach: float, origin: float, n_cells: int, resolution: float,
) -> tuple[slice, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return which cells of an axis lie within reach, and from where to where, from ``centre``."""
    first = math.floor((centre - reach - origin) / resolution)
    last = math.ceil((centre + reach - origin) / resolution)
    first, last = min(max(first, 0), n_cells), min(max(last, 0), n_cells)
    low = origin + resolution * np.arange(first, last, dtype=np.float64) - centre
    return slice(first, last), low, low + resolution


def _overlap(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], side: float,
) -> npt.NDArray[np.float64]:
    """Return the length that spans share with the one of length ``side`` around 0."""
    shared: npt.NDArray[np.float64] = np.minimum(high, side / 2.0) - np.maximum(low, -side / 2.0)
    return np.maximum(shared, 0.0)


def _gap(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return the distance of spans from 0; 0 where they hold it."""
    gap: npt.NDArray[np.float64] = np.maximum(np.maximum(low, -high), 0.0)
    return gap
