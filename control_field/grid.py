"""
The workspace: a grid of square cells, and the one place where world and cell are converted.

A workspace is a rectangle of an endless lattice of cells. One that fits itself grows on its
lattice, so that every cell stays where it was (``doc/adr/0037``).
"""

from dataclasses import dataclass
import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

#: What no integer holds is far outside all the same.
_FAR = 2.0**62
#: What fits into memory, field, Q-matrix and all; 4096 x 4096.
MOST_CELLS: Final = 2**24
#: Rows, and columns.
_MOST_ALONG: Final = 100_000
#: Longest name of a frame; it stands in messages for people.
LONGEST_FRAME: Final = 255

#: Room that the disc of a robot is left on each side in a cell, [m].
CLEARANCE: Final = 0.02
#: The cells of robots are multiples of so much, [m].
_SIDE_STEP: Final = 0.05
#: How far the cells of one lattice may lie off each other, in cells, and their sides, as a share.
_SAME_PLACE, _SAME_SIDE = 1e-3, 1e-9
#: Origins that are reckoned have so many decimals of a metre.
_DECIMALS: Final = 9
#: A workspace that fits itself holds so many cells around each where the robot was, and around
#: each that was seen, rounded outwards to multiples of so many cells of its lattice.
AROUND_ROBOT, AROUND_SEEN, MULTIPLE = 8, 1, 8


class CellBox(NamedTuple):
    """A rectangle of cells, its last row and column included; they may be negative."""

    low_row: int
    low_col: int
    high_row: int
    high_col: int

    @classmethod
    def of(cls, cells: npt.NDArray[np.integer]) -> 'CellBox':
        """Return the smallest one that holds cells ``(row, col)``, shape (n, 2), n above 0."""
        return cls(*cells.min(axis=0).tolist(), *cells.max(axis=0).tolist())

    def widened(self, n: int) -> 'CellBox':
        """Return it with ``n`` more cells on each side."""
        return CellBox(self.low_row - n, self.low_col - n, self.high_row + n, self.high_col + n)

    def shifted(self, rows: int, cols: int) -> 'CellBox':
        """Return it so many rows and columns farther up."""
        return CellBox(self.low_row + rows, self.low_col + cols,
                       self.high_row + rows, self.high_col + cols)

    def union(self, other: 'CellBox') -> 'CellBox':
        """Return the smallest one that holds both."""
        return CellBox(min(self.low_row, other.low_row), min(self.low_col, other.low_col),
                       max(self.high_row, other.high_row), max(self.high_col, other.high_col))


class TooLargeError(ValueError):
    """No workspace has so many cells; the message says which resolution would fit."""


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
            if not 1 <= getattr(self, name) <= _MOST_ALONG:
                raise ValueError(f'grid: {name} is {getattr(self, name)}, must be 1 to '
                                 f'{_MOST_ALONG}')
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
                f'({self.origin_x:.10g}, {self.origin_y:.10g}) in {self.frame_id!r}')

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

    @property
    def box(self) -> CellBox:
        """Return all of its cells."""
        return CellBox(0, 0, self.n_rows - 1, self.n_cols - 1)

    @property
    def lattice(self) -> 'Grid':
        """Return the cell of its lattice that holds (0, 0) of its frame, a grid of one cell."""
        row, col = (math.floor(-origin / self.resolution + _SAME_PLACE)
                    for origin in (self.origin_y, self.origin_x))
        return self._at(CellBox(row, col, row, col))

    def offset_to(self, other: 'Grid') -> tuple[int, int] | None:
        """
        Return what to add to a cell of this grid to have the same place as a cell of another.

        Returns
        -------
        tuple of int or None
            Rows and columns; None if the two are not of one lattice: cells of another size, in
            another frame, or not upon each other.

        """
        if self.frame_id != other.frame_id or not math.isclose(
                self.resolution, other.resolution, rel_tol=_SAME_SIDE):
            return None
        rows, cols = ((ours - theirs) / self.resolution for ours, theirs in (
            (self.origin_y, other.origin_y), (self.origin_x, other.origin_x)))
        if max(abs(rows - round(rows)), abs(cols - round(cols))) > _SAME_PLACE:
            return None
        return round(rows), round(cols)

    def window(self, box: CellBox) -> 'Grid':
        """
        Return a rectangle of its lattice, by its own cells; the grid itself if it is all of them.

        Whoever grows a grid again and again takes each window from the first one: then nothing is
        rounded twice.

        Raises
        ------
        TooLargeError
            If no workspace has so many cells; the message says which resolution would fit.

        """
        return self if box == self.box else self._at(box)

    def _at(self, box: CellBox) -> 'Grid':
        rows, cols = box.high_row - box.low_row + 1, box.high_col - box.low_col + 1
        if rows * cols > MOST_CELLS or max(rows, cols) > _MOST_ALONG:
            raise TooLargeError(
                f'{rows} x {cols} cells of {self.resolution:g} m are more than a workspace has '
                f'({MOST_CELLS} in all, {_MOST_ALONG} along a side); with resolution '
                f'{_fitting_resolution(rows, cols, self.resolution):g} it would fit')
        return Grid(rows, cols, self.resolution,
                    round(self.origin_x + box.low_col * self.resolution, _DECIMALS),
                    round(self.origin_y + box.low_row * self.resolution, _DECIMALS),
                    self.frame_id)


def _fitting_resolution(rows: int, cols: int, resolution: float) -> float:
    """Return cells so large, [m], that a place of so many smaller ones is a workspace."""
    larger = max(math.sqrt(rows * cols / MOST_CELLS), max(rows, cols) / _MOST_ALONG)
    # What is rounded outwards takes more room than its share.
    return round(math.ceil(1.1 * larger * resolution / _SIDE_STEP) * _SIDE_STEP, 2)


def cell_side(radius: float) -> float:
    """
    Return the side of the cells for a robot, [m]: the smallest multiple of 0.05 that holds it.

    Parameters
    ----------
    radius : float, [m]
        Of the smallest circle around its turning point that holds the robot; 2 cm are left free
        on each side of it.

    Raises
    ------
    ValueError
        If it is not above 0, or no number.

    """
    if not 0.0 < radius < math.inf:
        raise ValueError(f'the radius of the robot is {radius} m, must be above 0')
    n = math.ceil(2.0 * (radius + CLEARANCE) / _SIDE_STEP - 1e-9)
    return round(n * _SIDE_STEP, 2)


def default_lattice(resolution: float, frame_id: str = 'odom') -> Grid:
    """
    Return the lattice of which (0, 0) is the centre of a cell, as a grid of that one cell.

    A robot whose odometry begins at (0, 0) stands in the middle of it.
    """
    return Grid(1, 1, resolution, -resolution / 2.0, -resolution / 2.0, frame_id)


def fitted_box(been: CellBox | None, seen: CellBox | None = None) -> CellBox | None:
    """
    Return the cells of a workspace that fits itself.

    Parameters
    ----------
    been, seen : CellBox or None
        Where the robot was, and what was seen, in cells of `Grid.lattice`; None for nothing.

    Returns
    -------
    CellBox or None
        8 cells around the one, 1 around the other, rounded outwards to multiples of 8.

    """
    held = [box.widened(n) for box, n in ((been, AROUND_ROBOT), (seen, AROUND_SEEN)) if box]
    if not held:
        return None
    box = held[0].union(held[-1])
    return CellBox(*(edge // MULTIPLE * MULTIPLE for edge in box[:2]),
                   *(edge // MULTIPLE * MULTIPLE + MULTIPLE - 1 for edge in box[2:]))


def fitted_workspace(lattice: Grid, xy: npt.NDArray[np.float64]) -> Grid:
    """
    Return the smallest workspace that fits itself around places where the robot was.

    Parameters
    ----------
    lattice : Grid
        Any grid of the lattice.
    xy : ndarray, shape (n, 2), [m]
        Finite, at least one.

    Raises
    ------
    TooLargeError
        If no workspace holds them; the message says which resolution would.

    """
    anchor = lattice.lattice
    box = fitted_box(CellBox.of(anchor.cells_from_world(xy)))
    assert box is not None
    return anchor.window(box)
