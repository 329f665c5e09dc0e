"""
What a trial does where no way is left: it doubts walls it has not seen itself, and goes to look.

Plain Python or compiled, as `kernels` says. What goes over the whole map is written twice: in
NumPy expressions, which plain Python is fast with, and cell by cell, which compiles in no time.
"""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.seen import SeenMap
from control_field.kernels.steps import _BLOCKED, BoolMap, FloatMap, Ground, is_occupied

#: How much longer a doubted wall counts at the last resort, in cells for each of its confidence.
PRICE: Final = 0.1
_DIAGONAL: Final = math.sqrt(2.0) - 1.0
#: In place of where a search begins: a way to the goal is known to be left.
CERTAIN: Final = -1


class Flood(NamedTuple):
    """
    A search for the goal that goes on from decision to decision, so that none takes long.

    Parameters
    ----------
    reached : ndarray of uint8, shape (n_rows, n_cols)
        1 for the cells that a way from the robot was found to.
    queue : ndarray of int64, shape (n_rows * n_cols,)
        Places whose neighbours are to be looked at, row by row.
    ends : ndarray of int64, shape (3,)
        Where it begins and ends; both 0 before the search has begun, the first `CERTAIN` where
        there is nothing to search for, as there is a way. And how many places are reached that
        have to be forgotten before it begins anew.

    """

    reached: SeenMap
    queue: npt.NDArray[np.int64]
    ends: npt.NDArray[np.int64]


def new_flood(shape: tuple[int, int]) -> Flood:
    """Return a search that has not begun."""
    return Flood(np.zeros(shape, dtype=np.uint8), np.zeros(shape[0] * shape[1], dtype=np.int64),
                 np.zeros(3, dtype=np.int64))


def is_shut_off(
    ground: Ground, flood: Flood, row: int, col: int, goal: tuple[int, int], n_cells: int,
) -> bool:
    """
    Return whether the map is known to leave no way from a cell to the goal.

    Looks at ``n_cells`` cells, and goes on with the others when it is called next: False until
    all that can be reached was looked at. Once the goal was found it begins anew; where a wall is
    seen to be gone meanwhile, `search_anew` must be told.
    """
    reached, queue, ends = flood
    n_cols = reached.shape[1]
    if ends[0] == CERTAIN:
        return False
    if ends[1] == 0:
        for i in range(ends[2]):
            reached[queue[i] // n_cols, queue[i] % n_cols] = 0
        reached[row, col], queue[0], ends[1], ends[2] = 1, row * n_cols + col, 1, 1
    first, last = ends[0], ends[1]
    every = 1 if ground.rules.corner_cutting else 2
    for _ in range(n_cells):
        if first == last:
            ends[2] = max(ends[2], last)
            return True
        r, c = queue[first] // n_cols, queue[first] % n_cols
        first += 1
        if r == goal[0] and c == goal[1]:
            ends[0], ends[1], ends[2] = 0, 0, last
            return False
        for heading in range(0, 8, every):
            nr, nc = r + STEP_ROW[heading], c + STEP_COL[heading]
            if not is_occupied(ground.known, nr, nc, ground.rules.unknown_is_blocked) and (
                    reached[nr, nc] == 0):
                reached[nr, nc], queue[last] = 1, nr * n_cols + nc
                last += 1
    ends[0], ends[1], ends[2] = first, last, max(ends[2], last)
    return False


def search_anew(flood: Flood) -> None:
    """Let the search begin anew when it is asked for next."""
    flood.ends[0], flood.ends[1] = 0, 0


def doubt_unseen(ground: Ground, cost: FloatMap, seen: BoolMap, goal: tuple[int, int]) -> int:
    """
    Doubt every remembered wall that was not seen in this trial, in place; return how many.

    What is doubted already costs less to look at than what was certain. The cost to go begins
    anew, with what it is at least.
    """
    known, factor, _ = ground
    unseen = (known == _BLOCKED) & ~seen
    n_doubted = int(np.sum(unseen))
    if n_doubted == 0:
        return 0
    known[:] = known - unseen
    doubted = np.flatnonzero((known > 0) & (known < _BLOCKED))
    factor.reshape(-1)[doubted] = 1.0 + PRICE * known.reshape(-1)[doubted]
    rows = np.abs(np.arange(cost.shape[0]) - goal[0]).reshape(-1, 1)
    cols = np.abs(np.arange(cost.shape[1]) - goal[1]).reshape(1, -1)
    cost[:] = np.maximum(rows, cols) + _DIAGONAL * np.minimum(rows, cols)
    return n_doubted


def doubt_unseen_by_cells(
    ground: Ground, cost: FloatMap, seen: BoolMap, goal: tuple[int, int],
) -> int:
    """Do what `doubt_unseen` does, which is compiled from this."""
    known, factor, _ = ground
    n_doubted = 0
    for row in range(known.shape[0]):
        for col in range(known.shape[1]):
            if known[row, col] == _BLOCKED and not seen[row, col]:
                known[row, col] = _BLOCKED - 1
                n_doubted += 1
    if n_doubted == 0:
        return 0
    for row in range(known.shape[0]):
        for col in range(known.shape[1]):
            if 0 < known[row, col] < _BLOCKED:
                factor[row, col] = 1.0 + PRICE * known[row, col]
            r, c = abs(row - goal[0]), abs(col - goal[1])
            cost[row, col] = max(r, c) + _DIAGONAL * min(r, c)
    return n_doubted
