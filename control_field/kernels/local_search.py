"""
The cost to go, mended around the robot: local search space LRTA* (Koenig and Sun 2009).

Laid out in arrays, which compiled code is fastest with; plain Python takes the same numbers in the
same order. Places are numbered row by row within the part of the map that can be looked at, so
that they compare as ``(row, col)`` do.
"""

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.steps import allowed_steps, FloatMap, Ground

Places = npt.NDArray[np.int64]
#: Mask of the allowed steps of a place that was looked at; what else a place can be:
Masks = npt.NDArray[np.int16]
_FAR, _RIM = -2, -1


def push(costs: FloatMap, places: Places, n: int, cost: float, place: int) -> int:
    """Put an entry into a heap of n entries that is kept in two arrays; return n + 1."""
    at = n
    while at > 0:
        above = (at - 1) // 2
        if costs[above] < cost or (costs[above] == cost and places[above] <= place):
            break
        costs[at], places[at] = costs[above], places[above]
        at = above
    costs[at], places[at] = cost, place
    return n + 1


def pop(costs: FloatMap, places: Places, n: int) -> tuple[float, int]:
    """Take the least entry out of a heap of n entries, of which n - 1 are left."""
    least: tuple[float, int] = costs[0], places[0]
    cost, place = costs[n - 1], places[n - 1]
    at, below = 0, 1
    while below < n - 1:
        if below + 1 < n - 1 and (
                costs[below + 1] < costs[below]
                or (costs[below + 1] == costs[below] and places[below + 1] < places[below])):
            below += 1
        if cost < costs[below] or (cost == costs[below] and place <= places[below]):
            break
        costs[at], places[at] = costs[below], places[below]
        at, below = below, 2 * below + 1
    costs[at], places[at] = cost, place
    return least


def look_around(
    ground: Ground, row: int, col: int, goal: tuple[int, int], n_backups: int,
) -> tuple[Masks, Places, int, int]:
    """
    Look at the cells nearest to the robot on the way, at most ``n_backups``.

    Stops at the goal, which stays on the rim of what was looked at.

    Returns
    -------
    noted : ndarray of int16
        Of a part of the map: the mask of the allowed steps of a cell looked at, -1 on the rim of
        what was looked at, -2 elsewhere.
    touched : ndarray of int64
        Places that are not -2.
    top, left : int
        Cell of the map at ``noted[0, 0]``.

    """
    known, factor, rules = ground
    top, left = max(0, row - n_backups - 1), max(0, col - n_backups - 1)
    width = min(known.shape[1], col + n_backups + 2) - left
    shape = (min(known.shape[0], row + n_backups + 2) - top, width)
    noted = np.full(shape, _FAR, dtype=np.int16)
    reach = np.full(shape, np.inf)
    # A cell looked at reaches eight others at most.
    costs = np.empty(8 * n_backups + 1)
    places = np.empty(8 * n_backups + 1, dtype=np.int64)
    touched = np.empty(8 * n_backups + 1, dtype=np.int64)
    reach[row - top, col - left], noted[row - top, col - left] = 0.0, _RIM
    touched[0] = (row - top) * width + col - left
    n_heap, n_touched, n = push(costs, places, 0, 0.0, touched[0]), 1, 0
    while n_heap > 0 and n < n_backups:
        at, place = pop(costs, places, n_heap)
        n_heap -= 1
        r, c = place // width + top, place % width + left
        if noted[r - top, c - left] >= 0:
            continue
        if r == goal[0] and c == goal[1]:
            break
        allowed = allowed_steps(known, r, c, rules)
        noted[r - top, c - left] = allowed
        n += 1
        for heading in range(8):
            if not allowed >> heading & 1:
                continue
            nr, nc = r + STEP_ROW[heading], c + STEP_COL[heading]
            length = at + STEP_LENGTH[heading] * factor[nr, nc]
            if length < reach[nr - top, nc - left] - 1e-12:
                place = (nr - top) * width + nc - left
                if noted[nr - top, nc - left] == _FAR:
                    touched[n_touched] = place
                    n_touched += 1
                reach[nr - top, nc - left], noted[nr - top, nc - left] = length, _RIM
                n_heap = push(costs, places, n_heap, length, place)
    return noted, touched[:n_touched], top, left


def rim_around(
    cost: FloatMap, noted: Masks, touched: Places, top: int, left: int,
) -> tuple[FloatMap, Places, int]:
    """Forget the cost of the cells looked at; return the heap of those on the rim."""
    # Besides the rim, every cell looked at is put in by its neighbours, eight times at most.
    costs = np.zeros(9 * touched.shape[0])
    places = np.zeros(9 * touched.shape[0], dtype=np.int64)
    n = 0
    for place in touched:
        r, c = place // noted.shape[1], place % noted.shape[1]
        if noted[r, c] >= 0:
            cost[r + top, c + left] = np.inf
        elif cost[r + top, c + left] < np.inf:
            n = push(costs, places, n, cost[r + top, c + left], place)
    return costs, places, n


def rehearse_locally(
    ground: Ground, cost: FloatMap, row: int, col: int, goal: tuple[int, int], n_backups: int,
) -> None:
    """
    Mend the cost to go around the robot, in place, by at most ``n_backups`` backups each way.

    Looks ahead from the robot over the remembered map (optimistic where unseen), then carries the
    costs of the rim back through the cells looked at: eq. 6 swept in order of priority over the
    neighbourhood that matters.
    """
    noted, touched, top, left = look_around(ground, row, col, goal, n_backups)
    height, width = noted.shape
    costs, places, n = rim_around(cost, noted, touched, top, left)
    while n > 0:
        at, place = pop(costs, places, n)
        n -= 1
        r, c = place // width + top, place % width + left
        if at > cost[r, c]:
            continue
        for heading in range(8):
            nr, nc = r - STEP_ROW[heading] - top, c - STEP_COL[heading] - left
            if (nr < 0 or nc < 0 or nr >= height or nc >= width or noted[nr, nc] < 0
                    or not noted[nr, nc] >> heading & 1):
                continue
            total = at + STEP_LENGTH[heading] * ground.factor[r, c]
            if total < cost[nr + top, nc + left] - 1e-12:
                cost[nr + top, nc + left] = total
                n = push(costs, places, n, total, nr * width + nc)
