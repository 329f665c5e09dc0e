"""The workspace: a grid of square cells, and the one place where world and cell are converted."""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np
import numpy.typing as npt

#: What no integer holds is far outside all the same.
_FAR = 2.0**62
#: What fits into memory, field, Q-matrix and all; 4096 x 4096.
MOST_CELLS: Final = 2**24
#: Longest name of a frame; it stands in messages for people.
LONGEST_FRAME: Final = 255


@dataclass(frozen=True)
class Grid:
    """
    A rectangle of square cells in a fixed frame.

    Cells are named ``(row, col)``; row 0 is the lowest y, column 0 the lowest x. A cell holds its
    lower and left edge, not its upper and right one.

    Parameters
    ----------
    n_rows, n_cols : int
        At least 1 each.
    resolution : float
        Side of a cell, [m], positive.
    origin_x, origin_y : float
        Lower left corner of cell (0, 0), [m].
    frame_id : str
        The frame these coordinates are given in.

    Raises
    ------
    ValueError
        If a size is out of range; the message names it.

    """

    n_rows: int
    n_cols: int
    resolution: float
    origin_x: float = 0.0
    origin_y: float = 0.0
    frame_id: str = 'odom'

    def __post_init__(self) -> None:
        """Refuse what is no grid."""
        for name in ('n_rows', 'n_cols'):
            if not 1 <= getattr(self, name) <= 100_000:
                raise ValueError(f'grid: {name} is {getattr(self, name)}, must be 1 to 100000')
        if self.n_rows * self.n_cols > MOST_CELLS:
            raise ValueError(f'grid: {self.n_rows} x {self.n_cols} cells are more than '
                             f'{MOST_CELLS}')
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f'grid: resolution is {self.resolution} m, must be above 0')
        if not (math.isfinite(self.origin_x) and math.isfinite(self.origin_y)):
            raise ValueError(f'grid: origin ({self.origin_x}, {self.origin_y}) is not finite')
        if len(self.frame_id) > LONGEST_FRAME or not self.frame_id.isprintable():
            raise ValueError(f'grid: frame_id is {self.frame_id[:40]!r}, must be at most '
                             f'{LONGEST_FRAME} characters that can be printed')

    def __str__(self) -> str:
        """Say it to people."""
        return (f'{self.n_rows} x {self.n_cols} cells of {self.resolution:g} m from '
                f'({self.origin_x:g}, {self.origin_y:g}) in {self.frame_id!r}')

    @property
    def size(self) -> str:
        """Say how large it is: rows x columns, and in x and y where these are not the same."""
        sides = '' if self.n_rows == self.n_cols else (
            f' (rows x columns: {self.n_cols * self.resolution:g} m in x, '
            f'{self.n_rows * self.resolution:g} m in y)')
        return f'{self.n_rows} x {self.n_cols} cells of {self.resolution:g} m{sides}'

    @property
    def shape(self) -> tuple[int, int]:
        """Return ``(n_rows, n_cols)``."""
        return self.n_rows, self.n_cols

    def contains(self, row: int, col: int) -> bool:
        """Return whether a cell lies in the workspace."""
        return 0 <= row < self.n_rows and 0 <= col < self.n_cols

    def cell_from_world(self, x: float, y: float) -> tuple[int, int]:
        """
        Return the cell that holds a point; it may lie outside the workspace.

        Raises
        ------
        ValueError
            If a coordinate is not finite, or so great that its cell has no number.

        """
        row, col = (y - self.origin_y) / self.resolution, (x - self.origin_x) / self.resolution
        if not (math.isfinite(row) and math.isfinite(col)):
            raise ValueError(f'({x}, {y}) is not a point')
        return math.floor(row), math.floor(col)

    def world_from_cell(self, row: int, col: int) -> tuple[float, float]:
        """Return the centre ``(x, y)`` of a cell, [m]."""
        return (self.origin_x + (col + 0.5) * self.resolution,
                self.origin_y + (row + 0.5) * self.resolution)

    def cells_from_world(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
        """
        Return the cells that hold points.

        Parameters
        ----------
        points : ndarray, shape (n, 2), [m]
            ``(x, y)``, finite.

        Returns
        -------
        ndarray of int64, shape (n, 2)
            ``(row, col)``; they may lie outside the workspace.

        """
        origin = np.array([self.origin_x, self.origin_y])
        col_row = np.floor((np.asarray(points, dtype=np.float64) - origin) / self.resolution)
        col_row = np.clip(col_row, -_FAR, _FAR)
        cells: npt.NDArray[np.int64] = col_row[:, ::-1].astype(np.int64)
        return cells

    def world_from_cells(self, cells: npt.NDArray[np.integer]) -> npt.NDArray[np.float64]:
        """
        Return the centres of cells.

        Parameters
        ----------
        cells : ndarray, shape (n, 2)
            ``(row, col)``.

        Returns
        -------
        ndarray, shape (n, 2), [m]
            ``(x, y)``.

        """
        origin = np.array([self.origin_x, self.origin_y])
        col_row = np.asarray(cells)[:, ::-1]
        return origin + (col_row + 0.5) * self.resolution
