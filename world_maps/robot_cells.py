"""
The cells of a robot, made of the pixels of a map: where its disc fits, and gets through.

What a disc sweeps on its way from the centre of a cell to that of a neighbour is convex: each row
of pixels meets it in one interval, and sums along the row tell whether a pixel in it is blocked.
Lengths are in pixels here, places relative to the lower left corner of the map.
"""

import math
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from control_field.grid import CellBox, CLEARANCE, default_lattice, Grid
from control_field.local_grid import BLOCKED, FREE
from world_maps.raster import Raster

Mask: TypeAlias = npt.NDArray[np.bool_]
Floats: TypeAlias = npt.NDArray[np.float64]
Integers: TypeAlias = npt.NDArray[np.int64]

#: Of a TurtleBot3 Burger, [m].
ROBOT_RADIUS: Final = 0.105
#: A disc that touches a pixel is not in it, [pixels].
_TOUCH: Final = 1e-6
#: The edge of a map that lies on one of a cell so nearly is that edge, [cells].
_SAME: Final = 1e-9
#: How many pixels are looked at, at once, to find the nearest.
_AT_ONCE: Final = 2**22


class _Way(NamedTuple):
    """From a cell to one so many rows and columns on; 0, 0: it stays."""

    rows: int
    cols: int


_STAY: Final = _Way(0, 0)
#: Ways that must be clear together, and the cells they lie between, relative to the first.
_PASSAGES: Final = (
    ([(_STAY, _Way(0, 1))], [(0, 0), (0, 1)]),
    ([(_STAY, _Way(1, 0))], [(0, 0), (1, 0)]),
    ([(_STAY, _Way(1, 1)), (_Way(0, 1), _Way(1, -1))], [(0, 0), (0, 1), (1, 0), (1, 1)]),
)


def robot_grid(pixels: Grid, side: float) -> Grid:
    """
    Return the cells of a side that cover a map; (0, 0) of the frame is the centre of one.

    Parameters
    ----------
    pixels : Grid
    side : float, [m]

    Raises
    ------
    TooLargeError
        If they are too many.

    """
    lows = (pixels.origin_y, pixels.origin_x)
    first = [math.floor(low / side + 0.5 + _SAME) for low in lows]
    last = [math.ceil((low + n * pixels.resolution) / side + 0.5 - _SAME) - 1
            for low, n in zip(lows, pixels.shape, strict=True)]
    return default_lattice(side, pixels.frame_id).window(CellBox(*first, *last))


def robot_cells(pixels: Raster, grid: Grid, radius: float) -> npt.NDArray[np.int8]:
    """
    Return in which cells a robot may be that drives from centre to centre.

    A cell is free where the robot's disc fits at its centre. Where the disc does not get from a
    free cell to the one beside it, or around the corner between four free ones, that of them with
    the least room becomes blocked. As in the cells of its size, the disc is left 2 cm all around:
    no robot drives quite straight.

    Parameters
    ----------
    pixels : Raster
        Outside of it everything is blocked.
    grid : Grid
        The cells.
    radius : float, [m]
        Of the disc.

    Returns
    -------
    ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.

    """
    scene = _Scene(pixels, grid, radius + CLEARANCE)
    free = scene.is_clear(_STAY)
    for ways, cells in _PASSAGES:
        _block_tightest(scene, free, ways, np.array(cells))
    return np.where(free, FREE, BLOCKED).astype(np.int8)


def _block_tightest(
    scene: '_Scene', free: Mask, ways: list[tuple[_Way, _Way]], cells: Integers,
) -> None:
    """Block one cell of each group, all free, between which a way is not clear; in place."""
    n_rows, n_cols = np.array(free.shape) - cells.max(axis=0)

    def at(row: int, col: int, of: Mask) -> Mask:
        return of[row:row + n_rows, col:col + n_cols]

    clear = [at(*start, scene.is_clear(way)) for start, way in ways]
    group = np.logical_and.reduce([at(row, col, free) for row, col in cells.tolist()])
    first = np.argwhere(group & ~np.logical_and.reduce(clear))
    members = first[:, np.newaxis] + cells
    rooms = scene.rooms(members.reshape(-1, 2)).reshape(members.shape[:2])
    losers = members[np.arange(len(members)), rooms.argmin(axis=1)]
    free[losers[:, 0], losers[:, 1]] = False


class _Scene:
    """The pixels as sums along their rows, and the centres of the cells among them."""

    def __init__(self, pixels: Raster, grid: Grid, radius: float) -> None:
        size = pixels.grid.resolution
        self.side, self.radius = grid.resolution / size, radius / size - _TOUCH
        self.x, self.y = (
            ((np.arange(n) + 0.5) * grid.resolution + low - corner) / size
            for n, low, corner in ((grid.n_cols, grid.origin_x, pixels.grid.origin_x),
                                   (grid.n_rows, grid.origin_y, pixels.grid.origin_y)))
        self._blocked = np.pad(pixels.occupancy != FREE, 1, constant_values=True)
        self._sums = np.zeros((self._blocked.shape[0], self._blocked.shape[1] + 1), np.int32)
        np.cumsum(self._blocked, axis=1, out=self._sums[:, 1:])

    def is_clear(self, way: _Way) -> Mask:
        """Return for each cell whether the disc can go a way from its centre."""
        clear = np.ones((len(self.y), len(self.x)), dtype=bool)
        low, high = -self.radius, self.radius + way.rows * self.side
        first = np.floor(self.y + low).astype(np.int64)
        for step in range(math.ceil(high - low) + 1):
            row = first + step
            left, right = self._interval(way, row - self.y, row + 1 - self.y)
            clear &= ~self._is_blocked(row, left, right)
        return clear

    def _interval(self, way: _Way, bottom: Floats, top: Floats) -> tuple[Floats, Floats]:
        """Return from where to where the disc comes in rows of pixels; NaN where it does not."""
        length = way.rows * self.side
        slant = way.rows * abs(way.cols)
        left = self._edge(slant, length, np.clip(0.0, bottom, top))
        # By half a turn about its middle the shape becomes itself.
        right = abs(way.cols) * self.side - self._edge(
            slant, length, length - np.clip(length, bottom, top))
        if way.cols < 0:
            left, right = -right, -left
        outside = (top <= -self.radius) | (bottom >= length + self.radius)
        return np.where(outside, np.nan, left), np.where(outside, np.nan, right)

    def _edge(self, slant: int, length: float, y: Floats) -> Floats:
        """Return how far left the disc comes at a height; ``slant`` is 1 for a diagonal."""
        at = np.clip(y - slant * self.radius * math.sqrt(0.5), 0.0, length)
        return np.asarray(slant * at - np.sqrt(np.maximum(self.radius**2 - (y - at)**2, 0.0)))

    def _is_blocked(self, row: Integers, left: Floats, right: Floats) -> Mask:
        """Return where a pixel is blocked in an interval of a row, beside each centre in x."""
        sums, width = self._sums, self._sums.shape[1] - 1
        inside = ~np.isnan(left)
        rows = np.clip(row + 1, 0, len(sums) - 1)[:, np.newaxis]
        left, right = (np.nan_to_num(edge)[:, np.newaxis] + self.x for edge in (left, right))
        first = np.clip(np.floor(left).astype(np.int64) + 1, 0, width - 1)
        end = np.clip(np.ceil(right).astype(np.int64) + 1, first + 1, width)
        return np.asarray((sums[rows, end] > sums[rows, first]) & inside[:, np.newaxis])

    def rooms(self, cells: Integers) -> Floats:
        """Return how far from each centre the nearest blocked pixel is, as far as it matters."""
        reach = math.ceil(self.side + self.radius) + 1
        window = np.arange(-reach, reach + 1)
        found = [self._nearest(part, window) for part in np.array_split(
            cells, len(cells) * len(window)**2 // _AT_ONCE + 1)]
        return np.concatenate(found)

    def _nearest(self, cells: Integers, window: Integers) -> Floats:
        centres = np.stack([self.y[cells[:, 0]], self.x[cells[:, 1]]])
        pixels = np.floor(centres)[:, :, np.newaxis].astype(np.int64) + window
        away = pixels - centres[:, :, np.newaxis]
        y, x = np.maximum(np.maximum(away, -away - 1.0), 0.0)**2
        rows, cols = (np.clip(places + 1, 0, size - 1) for places, size in zip(
            pixels, self._blocked.shape, strict=True))
        blocked = self._blocked[rows[:, :, np.newaxis], cols[:, np.newaxis]]
        squares = np.where(blocked, y[:, :, np.newaxis] + x[:, np.newaxis], np.inf)
        # Rounded: of two that have the same room it is always the first.
        return np.asarray(squares.min(axis=(1, 2), initial=np.inf).round(6))
