"""The neighbourhood from a larger OccupancyGrid, such as Nav2's local costmap."""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from control_field.rays import rays_within, visible_cells
from msgs_bridge.messages.poses import check_frame
from msgs_bridge.sensing.local_grid_from_scan import bounded, corner_of, Extent, NINE

#: How much of a costmap's cell may lie over an edge before it counts on the other side.
_OVERLAP: Final = 1e-3


def neighbourhood_from_costmap(
    costmap: Grid, values: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid, *,
    lethal: int = 65, radius: float = 0.0, seen_share: float = 0.5, extent: Extent = NINE,
    name: str = 'costmap',
) -> npt.NDArray[np.int8]:
    """
    Return what a costmap shows of a cell and those around it.

    A cell is blocked when one of the costmap's cells is lethal that overlaps it, or that the
    robot's disc would touch on the cell's centre; free when enough of it is known; else unknown.
    Beyond the nine in the middle, which are the same for every extent, what lies behind something
    is unknown, for many a costmap is free where nobody has looked.

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
    extent : Extent
        How much to look at.
    name : str
        What an error calls it.

    Returns
    -------
    ndarray of int8, shape (n * k, n * k)

    Raises
    ------
    ValueError
        If it is in another frame than ``grid``, or the shape is not the costmap's.

    """
    check_frame(costmap.frame_id, grid.frame_id, name)
    if values.shape != costmap.shape:
        raise ValueError(f'{name}: shape is {values.shape}, must be {costmap.shape}')
    n, k = extent.n, extent.k
    squares = _Squares(*corner_of(cell, grid, n), grid.resolution / k, n * k)
    # A disc on the centre of a cell is what one on the centre of its middle finer cell is.
    cells = squares.states(costmap, values, lethal, 0.0 if k > 1 else radius, seen_share)
    if k > 1 and radius > 0.0:
        middles = _Squares(squares.x, squares.y, grid.resolution, n)
        cells[k // 2::k, k // 2::k][middles.touched(costmap, values, lethal, radius)] = BLOCKED
    cells = _bounded(cells, cell, grid, k)
    if n > 3:
        nine = slice((n // 2 - 1) * k, (n // 2 + 2) * k)
        seen = visible_cells(cells, rays_within(n * k // 2, extent.radius / squares.side))
        seen[nine, nine] = cells[nine, nine]
        cells = seen
    return cells


def _bounded(
    cells: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid, k: int,
) -> npt.NDArray[np.int8]:
    """Return finer cells with what lies outside the workspace blocked."""
    if k == 1:
        return bounded(cells, cell, grid)
    fine = Grid(grid.n_rows * k, grid.n_cols * k, grid.resolution / k)
    return bounded(cells, (cell[0] * k + k // 2, cell[1] * k + k // 2), fine)


class _Squares(NamedTuple):
    """``n`` x ``n`` squares: the lower left corner and the side of each, [m]."""

    x: float
    y: float
    side: float
    n: int

    def states(
        self, costmap: Grid, values: npt.NDArray[np.int8], lethal: int, radius: float,
        seen_share: float,
    ) -> npt.NDArray[np.int8]:
        """Return their states."""
        rows, along = self._overlaps(self.y, costmap.origin_y, costmap.n_rows, costmap.resolution)
        cols, across = self._overlaps(self.x, costmap.origin_x, costmap.n_cols, costmap.resolution)
        part = values[rows, cols]
        known = along @ (part != UNKNOWN) @ across.T / self.side ** 2
        cells = np.where(known >= seen_share - 1e-9, FREE, UNKNOWN).astype(np.int8)
        least = _OVERLAP * costmap.resolution
        holds = (along > least).astype(np.float64) @ (part >= lethal) @ (across > least).T
        cells[holds > 0.0] = BLOCKED
        if radius > self.side / 2.0:
            cells[self.touched(costmap, values, lethal, radius)] = BLOCKED
        return cells

    def touched(
        self, costmap: Grid, values: npt.NDArray[np.int8], lethal: int, radius: float,
    ) -> npt.NDArray[np.bool_]:
        """Return on the centre of which squares a disc would touch a lethal cell."""
        at = np.argwhere(values >= lethal)
        low = np.array([costmap.origin_y, costmap.origin_x]) + at * costmap.resolution
        corner, width = np.array([self.y, self.x]), self.n * self.side
        near = ((low + costmap.resolution > corner - radius)
                & (low < corner + width + radius)).all(axis=1)
        centres = corner[:, np.newaxis] + (np.arange(self.n) + 0.5) * self.side
        touched = np.zeros((self.n, self.n), dtype=np.bool_)
        for y, x in low[near].tolist():
            gap_y, gap_x = (_gap(at - centre, at - centre + costmap.resolution)
                            for at, centre in zip((y, x), centres, strict=True))
            touched |= np.hypot(gap_y[:, np.newaxis], gap_x) < radius - _OVERLAP * (
                costmap.resolution)
        return touched

    def _overlaps(
        self, low: float, origin: float, n_cells: int, resolution: float,
    ) -> tuple[slice, npt.NDArray[np.float64]]:
        """Return which cells of an axis lie within, and what each square shares with each."""
        first = math.floor((low - origin) / resolution)
        last = math.ceil((low + self.n * self.side - origin) / resolution)
        first, last = min(max(first, 0), n_cells), min(max(last, 0), n_cells)
        begins = origin + resolution * np.arange(first, last, dtype=np.float64)
        squares = (low + self.side * np.arange(self.n, dtype=np.float64))[:, np.newaxis]
        shared = np.minimum(begins + resolution, squares + self.side) - np.maximum(begins, squares)
        return slice(first, last), np.maximum(shared, 0.0)


def _gap(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return the distance of spans from 0; 0 where they hold it."""
    gap: npt.NDArray[np.float64] = np.maximum(np.maximum(low, -high), 0.0)
    return gap
