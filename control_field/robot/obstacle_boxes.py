"""What a local grid says about where the robot's disc may be: boxes that it must not touch."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import FREE, UNKNOWN

#: A box is (x_low, y_low, x_high, y_high), [m].
Box = tuple[float, float, float, float]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class LocalGrid:
    """
    What the cells around the robot say about where its disc may be.

    Parameters
    ----------
    boxes : tuple of (x_low, y_low, x_high, y_high), [m]
        What is blocked.
    seen : tuple of (x_low, y_low, x_high, y_high), [m]
        The square of all nine cells.
    is_entered : bool
        Whether something is in the robot's own cell, nobody knows where.
    moving : tuple of (x_low, y_low, x_high, y_high), [m]
        Those of the boxes that have come a short while ago, and may come nearer.
    mover_speed : float, [m/s]
        How fast they may.
    backs_off : bool
        Whether the robot may drive away from what comes too near, or stands.

    """

    boxes: tuple[Box, ...]
    seen: Box
    is_entered: bool = False
    moving: tuple[Box, ...] = ()
    mover_speed: float = 0.0
    backs_off: bool = False


def local_grid_from_cells(
    cells: Sequence[Sequence[int]] | npt.NDArray[np.int8], row: int, col: int, grid: Grid,
    unknown_is_blocked: bool = False, own_cell: bool = False, *,
    fine: npt.NDArray[np.int8] | None = None, moving: Mask | None = None,
    mover_speed: float = 0.0, backs_off: bool = False, bounded: bool = True,
) -> LocalGrid:
    """
    Place a neighbourhood in the world.

    Parameters
    ----------
    cells : 3 by 3 numbers
        0 free, -1 unknown, anything else blocked; row 0 at the lowest y. The robot stands in the
        middle one: that it is unknown says nothing.
    row, col : int
        Cell in the middle.
    grid : Grid
        The workspace.
    unknown_is_blocked : bool
        Whether to keep out of unknown cells.
    own_cell : bool
        Whether a blocked middle means that something reaches in; some sensors mark the robot.
    fine : ndarray of int8, shape (3 * k, 3 * k), optional
        The same in finer cells: they say where in a cell something is.
    moving : ndarray of bool, shape of the finest cells, optional
        What has come a short while ago.
    mover_speed : float, [m/s]
        How fast that may be.
    backs_off : bool
        Whether the robot may drive away from it.
    bounded : bool
        Whether what lies outside the workspace is blocked; else it is what the cells say.

    """
    nine = np.asarray(cells)
    k = 1 if fine is None else len(fine) // 3
    blocked = _blocked(nine, fine, k, unknown_is_blocked)
    if bounded:
        blocked |= _outside(row, col, grid).repeat(k, axis=0).repeat(k, axis=1)
    middle = slice(k, 2 * k)
    is_entered = own_cell and fine is None and nine[1, 1] not in (FREE, UNKNOWN)
    if fine is None or not own_cell:
        blocked[middle, middle] = False
    side, part = grid.resolution, grid.resolution / k
    corner = (grid.origin_x + (col - 1) * side, grid.origin_y + (row - 1) * side)
    seen = (*corner, corner[0] + 3 * side, corner[1] + 3 * side)
    moves = np.zeros_like(blocked) if moving is None or not mover_speed else blocked & moving
    coming = tuple(_boxes(moves, corner, part))
    return LocalGrid(
        (*_boxes(blocked & ~moves, corner, part), *coming), seen, is_entered, coming, mover_speed,
        backs_off)


def _blocked(
    nine: npt.NDArray[Any], fine: npt.NDArray[np.int8] | None, k: int, unknown_is_blocked: bool,
) -> Mask:
    """Return which of the finest cells are blocked; the unknown of the middle cell never are."""
    finest = nine if fine is None else fine
    blocked: Mask = (finest != FREE) & (finest != UNKNOWN)
    if unknown_is_blocked:
        unknown = (finest == UNKNOWN) | (nine == UNKNOWN).repeat(k, axis=0).repeat(k, axis=1)
        unknown[k:2 * k, k:2 * k] = False
        blocked |= unknown
    return blocked


def _outside(row: int, col: int, grid: Grid) -> Mask:
    """Return which of the eight cells around one lie outside the workspace, shape (3, 3)."""
    if 0 < row < grid.n_rows - 1 and 0 < col < grid.n_cols - 1:
        return np.zeros((3, 3), dtype=np.bool_)
    return np.array([[(i, j) != (1, 1) and not grid.contains(row + i - 1, col + j - 1)
                      for j in range(3)] for i in range(3)])


def _boxes(blocked: Mask, corner: tuple[float, float], side: float) -> Iterator[Box]:
    """Yield boxes that cover cells of some side, [m], and nothing else."""
    left = {(int(i), int(j)) for i, j in np.argwhere(blocked)}
    for i, j in sorted(left):
        if (i, j) not in left:
            continue
        right, top = j + 1, i + 1
        if len(blocked) > 3:  # finer cells are many, and are put together
            while (i, right) in left:
                right += 1
            while all((top, col) in left for col in range(j, right)):
                top += 1
        left -= {(row, col) for row in range(i, top) for col in range(j, right)}
        yield (corner[0] + j * side, corner[1] + i * side,
               corner[0] + right * side, corner[1] + top * side)


def distance_to_box(x: float, y: float, box: Box) -> float:
    """Return the distance of a point from a box, [m]; negative inside (to the nearest edge)."""
    dx = max(box[0] - x, x - box[2])
    dy = max(box[1] - y, y - box[3])
    if dx > 0.0 and dy > 0.0:
        return math.hypot(dx, dy)
    return max(dx, dy)


def distance_to_edge(x: float, y: float, seen: Box) -> float:
    """Return how deep inside a box a point lies, [m]; negative outside."""
    return min(x - seen[0], y - seen[1], seen[2] - x, seen[3] - y)
