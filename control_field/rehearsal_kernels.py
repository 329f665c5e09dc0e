"""
The rehearsal of `kernels`, laid out for compiled code.

The robot's plain Python is fastest with dictionaries, compiled code with arrays. Both push the
same numbers in the same order, so the results are equal to the last bit; a test holds them to it.
"""

import heapq

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import CellMap, FloatMap, Rules, step_allowed


def look_around(
    known: CellMap, factor: FloatMap, row: int, col: int, goal_row: int, goal_col: int,
    n_backups: int, rules: Rules,
) -> tuple[npt.NDArray[np.int8], int, int]:
    """
    Look at the cells nearest to the robot on the way, at most ``n_backups``; `kernels.look_ahead`.

    Returns
    -------
    settled : ndarray of int8
        Of a part of the map: 1 looked at, 0 on the rim of what was looked at, -1 neither.
    top, left : int
        Cell of the map at ``settled[0, 0]``.

    """
    top, left = max(0, row - n_backups - 1), max(0, col - n_backups - 1)
    shape = (min(known.shape[0], row + n_backups + 2) - top,
             min(known.shape[1], col + n_backups + 2) - left)
    settled = np.full(shape, -1, dtype=np.int8)
    reach = np.full(shape, np.inf)
    reach[row - top, col - left] = 0.0
    settled[row - top, col - left] = 0
    heap = [(0.0, row, col)]
    n = 0
    while len(heap) > 0 and n < n_backups:
        at, r, c = heapq.heappop(heap)
        if settled[r - top, c - left] == 1:
            continue
        if r == goal_row and c == goal_col:
            break
        settled[r - top, c - left] = 1
        n += 1
        for heading in range(8):
            if not step_allowed(known, r, c, heading, rules):
                continue
            nr, nc = r + STEP_ROW[heading], c + STEP_COL[heading]
            length = at + STEP_LENGTH[heading] * factor[nr, nc]
            if length < reach[nr - top, nc - left] - 1e-12:
                reach[nr - top, nc - left] = length
                settled[nr - top, nc - left] = 0
                heapq.heappush(heap, (length, nr, nc))
    return settled, top, left


def rim_around(
    cost: FloatMap, settled: npt.NDArray[np.int8], top: int, left: int,
) -> list[tuple[float, int, int]]:
    """Forget the cost of the cells looked at; return the heap of those on the rim."""
    rim = [(0.0, 0, 0)]
    rim.pop()
    for r in range(top, top + settled.shape[0]):
        for c in range(left, left + settled.shape[1]):
            if settled[r - top, c - left] == 1:
                cost[r, c] = np.inf
            elif settled[r - top, c - left] == 0 and cost[r, c] < np.inf:
                heapq.heappush(rim, (cost[r, c], r, c))
    return rim


def rehearse_locally(
    known: CellMap, cost: FloatMap, factor: FloatMap, row: int, col: int, goal_row: int,
    goal_col: int, n_backups: int, rules: Rules,
) -> None:
    """Mend the cost to go around the robot, in place; `kernels.rehearse_locally`."""
    settled, top, left = look_around(
        known, factor, row, col, goal_row, goal_col, n_backups, rules)
    rim = rim_around(cost, settled, top, left)
    while len(rim) > 0:
        at, r, c = heapq.heappop(rim)
        if at > cost[r, c]:
            continue
        for heading in range(8):
            nr, nc = r - STEP_ROW[heading] - top, c - STEP_COL[heading] - left
            if (nr < 0 or nc < 0 or nr >= settled.shape[0] or nc >= settled.shape[1]
                    or settled[nr, nc] != 1):
                continue
            if not step_allowed(known, nr + top, nc + left, heading, rules):
                continue
            total = at + STEP_LENGTH[heading] * factor[r, c]
            if total < cost[nr + top, nc + left] - 1e-12:
                cost[nr + top, nc + left] = total
                heapq.heappush(rim, (total, nr + top, nc + left))
