"""What is true around a cell: a part of the map, as finely as one likes, with what moves in it."""

from collections.abc import Iterable
import math

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED
from world_maps.movers import Disc
from world_maps.world import World


def true_window(
    world: World, discs: Iterable[Disc | None], row: int, col: int, reach: int = 1, fine: int = 1,
) -> npt.NDArray[np.int8]:
    """
    Return the true state of the cells around one, with what moves; outside the world is blocked.

    Parameters
    ----------
    world : World
    discs : iterable of Disc or None
        What moves: it occupies every cell that it reaches into, the middle one as well.
    row, col : int
        The cell in the middle.
    reach : int
        Cells to each side of it.
    fine : int
        Parts that each cell is divided into, each way.

    Returns
    -------
    ndarray of int8, shape (n, n) with ``n = (2 * reach + 1) * fine``
        0 free, 100 blocked; row 0 at the lowest y.

    """
    side = 2 * reach + 1
    window = np.full((side, side), BLOCKED, dtype=np.int8)
    rows, cols = world.grid.shape
    low, left = row - reach, col - reach
    bottom, top = max(low, 0), min(low + side, rows)
    first, last = max(left, 0), min(left + side, cols)
    if bottom < top and first < last:
        window[bottom - low:top - low, first - left:last - left] = (
            world.occupancy[bottom:top, first:last])
    if fine > 1:
        window = window.repeat(fine, axis=0).repeat(fine, axis=1)
    grid, part = world.grid, world.grid.resolution / fine
    corner = (grid.origin_x + left * grid.resolution, grid.origin_y + low * grid.resolution)
    for disc in discs:
        if disc is not None:
            occupy(window, disc, corner, part)
    return window


def occupy(
    cells: npt.NDArray[np.int8], disc: Disc, corner: tuple[float, float], side: float,
) -> None:
    """
    Mark the cells that a disc reaches into as blocked, in place.

    Parameters
    ----------
    cells : ndarray of int8, shape (n_rows, n_cols)
    disc : Disc
        May lie outside of them.
    corner : tuple of float
        (x, y) of the lower left corner of cell (0, 0), [m].
    side : float, [m]
        Of a cell.

    """
    x, y, reach = (disc.x - corner[0]) / side, (disc.y - corner[1]) / side, disc.radius / side
    bottom, top = _span(y, reach, cells.shape[0])
    first, last = _span(x, reach, cells.shape[1])
    for row in range(bottom, top):
        away_y = max(row - y, 0.0, y - row - 1.0)
        for col in range(first, last):
            if math.hypot(max(col - x, 0.0, x - col - 1.0), away_y) < reach:
                cells[row, col] = BLOCKED


def _span(middle: float, reach: float, count: int) -> tuple[int, int]:
    """Return the half-open range of the rows or columns that may be reached."""
    low, high = math.floor(middle - reach), math.floor(middle + reach) + 1
    return min(max(low, 0), count), min(max(high, 0), count)
