"""What is true around a cell: a part of the map, as finely as one likes, with what moves in it."""

from collections.abc import Iterable
from itertools import product
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED, cells_from_fine, FREE
from world_maps.movers import Disc
from world_maps.raster import Raster
from world_maps.world import World

#: A part that touches a pixel has no share of it, [pixels].
_TOUCH: Final = 1e-6


def true_window(
    world: World, discs: Iterable[Disc | None], row: int, col: int, reach: int = 1, fine: int = 1,
) -> npt.NDArray[np.int8]:
    """
    Return the true state of the cells around one, with what moves; outside the world is blocked.

    Where the cells are made of pixels, parts show where in a blocked cell these are. The parts of
    a free cell are free: what stands in its corners is in nobody's way. In the cell in the middle
    the robot is, whatever stands there beside it: it is free, but for its parts.

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
    window = _cut(world.occupancy, row - reach, col - reach, (side, side))
    grid, part = world.grid, world.grid.resolution / fine
    corner = (grid.origin_x + (col - reach) * grid.resolution,
              grid.origin_y + (row - reach) * grid.resolution)
    if world.drawn is None:
        window = window.repeat(fine, axis=0).repeat(fine, axis=1)
    elif fine == 1:
        window[reach, reach] = FREE
    else:
        window = _in_parts(world, window, (row - reach, col - reach), corner, fine)
    for disc in discs:
        if disc is not None:
            occupy(window, disc, corner, part)
    return window


def _cut(
    occupancy: npt.NDArray[np.int8], low: int, left: int, shape: tuple[int, int],
) -> npt.NDArray[np.int8]:
    """Cut a window out of a map; outside of it is blocked."""
    window = np.full(shape, BLOCKED, dtype=np.int8)
    rows, cols = occupancy.shape
    bottom, top = max(low, 0), min(low + shape[0], rows)
    first, last = max(left, 0), min(left + shape[1], cols)
    if bottom < top and first < last:
        window[bottom - low:top - low, first - left:last - left] = (
            occupancy[bottom:top, first:last])
    return window


def _in_parts(
    world: World, cells: npt.NDArray[np.int8], low: tuple[int, int],
    corner: tuple[float, float], fine: int,
) -> npt.NDArray[np.int8]:
    """
    Return cells in parts: of a blocked one those are in which a pixel is, of the others none.

    Where no pixel is in it, something beside a cell blocks it, which is shown there. Of the cells
    around the robot's that part is left then that is farthest from where a robot may be. All that
    depends on the map alone: what is shown does not move when the robot does.
    """
    blocked = cells.repeat(fine, axis=0).repeat(fine, axis=1)
    shown = np.minimum(_parts(
        world.pixels, corner, world.grid.resolution / fine, len(blocked)), blocked)
    reach = len(cells) // 2
    for i, j in product((reach - 1, reach, reach + 1), repeat=2):
        part = shown[i * fine:(i + 1) * fine, j * fine:(j + 1) * fine]
        if cells[i, j] != FREE and (i, j) != (reach, reach) and not part.any():
            part[_part_in_nobodys_way(world, low[0] + i, low[1] + j, fine)] = BLOCKED
    none = cells_from_fine(shown, fine) == FREE
    none[reach - 1:reach + 2, reach - 1:reach + 2] = False
    return np.where(none.repeat(fine, axis=0).repeat(fine, axis=1), blocked, shown)


def _part_in_nobodys_way(world: World, row: int, col: int, fine: int) -> tuple[int, int]:
    """Return the part of a cell that is farthest from the centres of the free cells around it."""
    free = np.argwhere(_cut(world.occupancy, row - 1, col - 1, (3, 3)) == FREE) - 1.0
    middles = (np.indices((fine, fine)) + 0.5) / fine - 0.5
    away = np.hypot(*(middles[..., np.newaxis] - free.T[:, np.newaxis, np.newaxis]))
    i, j = divmod(int(away.min(axis=2, initial=fine).argmax()), fine)
    return i, j


def _parts(
    pixels: Raster, corner: tuple[float, float], part: float, n: int,
) -> npt.NDArray[np.int8]:
    """Return which of n x n parts of a side from a corner on have a blocked pixel in them."""
    size = pixels.grid.resolution
    (first_col, end_col), (first_row, end_row) = (
        _overlapped((low - start) / size, part / size, n)
        for low, start in zip(corner, pixels.extent[:2], strict=True))
    bottom, left = int(first_row[0]), int(first_col[0])
    patch = _cut(pixels.occupancy, bottom, left,
                 (int(end_row[-1]) - bottom, int(end_col[-1]) - left)) != FREE
    sums = np.zeros((patch.shape[0] + 1, patch.shape[1] + 1), dtype=np.int32)
    np.cumsum(np.cumsum(patch, axis=0), axis=1, out=sums[1:, 1:])
    along = sums[end_row - bottom] - sums[first_row - bottom]
    holds = along[:, end_col - left] > along[:, first_col - left]
    return np.where(holds, BLOCKED, FREE).astype(np.int8)


def _overlapped(
    low: float, part: float, n_parts: int,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the first pixel and one past the last that each of a row of parts has a share of."""
    edges = low + np.arange(n_parts + 1) * part
    first = np.floor(edges[:-1] + _TOUCH).astype(np.int64)
    return first, np.maximum(np.ceil(edges[1:] - _TOUCH).astype(np.int64), first + 1)


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
