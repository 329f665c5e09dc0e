"""
Steps, costs and choices: the loops of the method, written once for two executions.

Plain Python over NumPy arrays: the robot runs these functions as they stand, the learner's side
runs the same source through numba (`control_field.kernels.compiled`). So they keep to what numba
understands: scalars, arrays, tuples, `heapq`, and one another.
"""

import heapq
import math

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.local_grid import BLOCKED, UNKNOWN

CellMap = npt.NDArray[np.int8]
IntMap = npt.NDArray[np.int32] | npt.NDArray[np.int64]
BoolMap = npt.NDArray[np.bool_]
FloatMap = npt.NDArray[np.float64]
#: ``(corner_cutting, unknown_is_blocked, moves)``
StepRules = tuple[bool, bool, int]

_BLOCKED = int(BLOCKED)
_UNKNOWN = int(UNKNOWN)
#: Least Q-value of a way to the goal, however long: the field's float32 must not make it 0.
_LEAST = 1e-37


def is_occupied(known: CellMap, row: int, col: int, unknown_is_blocked: bool) -> bool:
    """Tell whether a cell lies outside or is known (or held) to be blocked."""
    if row < 0 or col < 0 or row >= known.shape[0] or col >= known.shape[1]:
        return True
    state = known[row, col]
    return state == _BLOCKED or (unknown_is_blocked and state == _UNKNOWN)


def step_allowed(known: CellMap, row: int, col: int, heading: int, rules: StepRules) -> bool:
    """
    Tell whether the map allows a step.

    ``rules`` is ``(corner_cutting, unknown_is_blocked, moves)`` here and everywhere below.
    """
    corner_cutting, unknown_is_blocked, moves = rules
    if heading % 2 == 1:
        if moves == 4:
            return False
        if not corner_cutting and (
                is_occupied(known, row + STEP_ROW[heading], col, unknown_is_blocked)
                or is_occupied(known, row, col + STEP_COL[heading], unknown_is_blocked)):
            return False
    return not is_occupied(
        known, row + STEP_ROW[heading], col + STEP_COL[heading], unknown_is_blocked)


def allowed_steps(known: CellMap, row: int, col: int, rules: StepRules) -> int:
    """Return the mask of the steps that the map allows: `step_allowed` for all of them at once."""
    corner_cutting, unknown_is_blocked, moves = rules
    free = 0
    for heading in range(8):
        if not is_occupied(known, row + STEP_ROW[heading], col + STEP_COL[heading],
                         unknown_is_blocked):
            free |= 1 << heading
    straight = free & 0b01010101
    if moves == 4:
        return straight
    if corner_cutting:
        return free
    # Bit h of these is the straight neighbour before heading h, and the one after it.
    before, after = straight << 1, straight >> 1 | straight << 7
    return straight | (free & before & after & 0b10101010)


def remember_local_grid(known: CellMap, row: int, col: int, blocked: int, unknown: int) -> int:
    """Write a 3x3 local grid into the remembered map; return how many cells it newly occupied."""
    known[row, col] = 0
    n_occupied = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if 0 <= r < known.shape[0] and 0 <= c < known.shape[1] and not unknown >> heading & 1:
            state = _BLOCKED if blocked >> heading & 1 else 0
            if state == _BLOCKED and known[r, c] != _BLOCKED:
                n_occupied += 1
            known[r, c] = state
    return n_occupied


def cost_to_go(
    known: CellMap, goal_row: int, goal_col: int, preferred: CellMap, spared: FloatMap,
    factor: FloatMap, rules: StepRules,
) -> FloatMap:
    """
    Return the least cost from every cell to the goal, in cells: eq. 6 run to its fixed point.

    With learning rate 1 in a deterministic world the fixed point of eq. 6 is
    ``V(s) = max_a discount ** length(a) * V(s')``; its logarithm is a least cost, and sweeping the
    backups in order of priority is Dijkstra's order. A preferred step (``preferred[row, col]``
    is its heading) is spared a share of its length; ``factor`` scales the length of steps into a
    cell.
    """
    cost = np.full(known.shape, np.inf)
    cost[goal_row, goal_col] = 0.0
    heap = [(0.0, goal_row, goal_col)]
    while len(heap) > 0:
        at, row, col = heapq.heappop(heap)
        if at > cost[row, col]:
            continue
        for heading in range(8):
            r, c = row - STEP_ROW[heading], col - STEP_COL[heading]
            if is_occupied(known, r, c, rules[1]) or not step_allowed(known, r, c, heading, rules):
                continue
            length = STEP_LENGTH[heading] * factor[row, col]
            if preferred[r, c] == heading:
                length *= 1.0 - spared[r, c]
            if at + length < cost[r, c] - 1e-12:
                cost[r, c] = at + length
                heapq.heappush(heap, (at + length, r, c))
    return cost


def q_from_cost(
    known: CellMap, cost: FloatMap, preferred: CellMap, spared: FloatMap, factor: FloatMap,
    discount: float, rules: StepRules,
) -> FloatMap:
    """Return the Q-matrix of a cost to go: -1 where a step is known to be blocked."""
    rows, cols = known.shape
    q = np.zeros((rows, cols, 8))
    for row in range(rows):
        for col in range(cols):
            if is_occupied(known, row, col, rules[1]):
                continue
            for heading in range(8):
                if not step_allowed(known, row, col, heading, rules):
                    q[row, col, heading] = -1.0
                    continue
                r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
                length = STEP_LENGTH[heading] * factor[r, c]
                if preferred[row, col] == heading:
                    length *= 1.0 - spared[row, col]
                if cost[r, c] < np.inf:
                    q[row, col, heading] = max(_LEAST, discount ** (length + cost[r, c]))
    return q


def best_step(
    known: CellMap, cost: FloatMap, factor: FloatMap, row: int, col: int, course: int,
    rules: StepRules,
) -> int:
    """
    Return the allowed step of least cost to go; ties go to the one nearest the field's course.

    Returns -1 where no step leads to the goal. ``course`` is a heading or -1.
    """
    best, best_cost, best_turn = -1, np.inf, 9
    for heading in range(8):
        if not step_allowed(known, row, col, heading, rules):
            continue
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        total = cost[r, c] + STEP_LENGTH[heading] * factor[r, c]
        turn = 0
        if course >= 0:
            turn = abs((heading - course + 4) % 8 - 4)
        if total < best_cost - 1e-9 or (total < best_cost + 1e-9 and turn < best_turn):
            best, best_cost, best_turn = heading, total, turn
    return best


def look_ahead(
    known: CellMap, factor: FloatMap, row: int, col: int, goal_row: int, goal_col: int,
    n_backups: int, rules: StepRules,
) -> dict[tuple[int, int], bool]:
    """
    Look at the cells nearest to the robot on the way, at most ``n_backups``.

    Returns
    -------
    dict
        True: looked at; False: on the rim of what was looked at. Stops at the goal, on the rim.

    """
    reach = {(row, col): 0.0}
    settled = {(row, col): False}
    heap = [(0.0, row, col)]
    n = 0
    while len(heap) > 0 and n < n_backups:
        at, r, c = heapq.heappop(heap)
        if settled[(r, c)]:
            continue
        if r == goal_row and c == goal_col:
            break
        settled[(r, c)] = True
        n += 1
        for heading in range(8):
            if not step_allowed(known, r, c, heading, rules):
                continue
            nr, nc = r + STEP_ROW[heading], c + STEP_COL[heading]
            length = at + STEP_LENGTH[heading] * factor[nr, nc]
            if (nr, nc) not in reach or length < reach[(nr, nc)] - 1e-12:
                reach[(nr, nc)] = length
                settled[(nr, nc)] = False
                heapq.heappush(heap, (length, nr, nc))
    return settled


def rehearse_locally(
    known: CellMap, cost: FloatMap, factor: FloatMap, row: int, col: int, goal_row: int,
    goal_col: int, n_backups: int, rules: StepRules,
) -> None:
    """
    Mend the cost to go around the robot, in place, by at most ``n_backups`` backups each way.

    Looks ahead from the robot over the remembered map (optimistic where unseen), then carries the
    costs of the rim back through the cells looked at: eq. 6 swept in order of priority over the
    neighbourhood that matters (local search space LRTA*, Koenig and Sun 2009).
    """
    settled = look_ahead(known, factor, row, col, goal_row, goal_col, n_backups, rules)
    rim = [(0.0, 0, 0)]
    rim.pop()
    for place in settled:
        if settled[place]:
            cost[place[0], place[1]] = np.inf
        elif cost[place[0], place[1]] < np.inf:
            heapq.heappush(rim, (cost[place[0], place[1]], place[0], place[1]))
    while len(rim) > 0:
        at, r, c = heapq.heappop(rim)
        if at > cost[r, c]:
            continue
        for heading in range(8):
            nr, nc = r - STEP_ROW[heading], c - STEP_COL[heading]
            if (nr, nc) not in settled or not settled[(nr, nc)]:
                continue
            if not step_allowed(known, nr, nc, heading, rules):
                continue
            total = at + STEP_LENGTH[heading] * factor[r, c]
            if total < cost[nr, nc] - 1e-12:
                cost[nr, nc] = total
                heapq.heappush(rim, (total, nr, nc))


def least_chosen(
    counts: IntMap, row: int, col: int, allowed: int, rng: np.random.Generator,
) -> int:
    """Return a random one of the allowed headings that were chosen least often here."""
    fewest = 1 << 30
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] < fewest:
            fewest = counts[row, col, heading]
    n = 0
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] == fewest:
            n += 1
    pick = int(rng.random() * n)
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] == fewest:
            if pick == 0:
                return heading
            pick -= 1
    return -1


def window_values(q: FloatMap, row: int, col: int, window: float, power: float) -> FloatMap:
    """
    Return the Q-values of the eight actions as the effective window sees them.

    Inverse-distance sum of ``Q(c, a)`` over the cells c of the window; the cell itself counts as
    half a cell away. Only their order matters, so the common denominator is left out.
    """
    values = np.zeros(8)
    reach = int(window)
    for r in range(max(0, row - reach), min(q.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(q.shape[1], col + reach + 1)):
            d = math.hypot(r - row, c - col)
            if d > window:
                continue
            w = 1.0 / max(d, 0.5) ** power
            for heading in range(8):
                if q[r, c, heading] != 0.0:
                    values[heading] += w * q[r, c, heading]
    return values


def next_highest(
    values: FloatMap, counts: IntMap, entered: IntMap, row: int, col: int, course: int,
    allowed: int,
) -> int:
    """
    Return the free action with the next highest Q-value (Case 1).

    Ties: nearest to the field's course, then least often chosen, then the cell least often
    entered, then counter-clockwise.
    """
    best = -1
    best_key = (0.0, 0, 0, 0)
    for heading in range(8):
        if not allowed >> heading & 1:
            continue
        turn = 0
        if course >= 0:
            turn = abs((heading - course + 4) % 8 - 4)
        visits = entered[row + STEP_ROW[heading], col + STEP_COL[heading]]
        key = (-round(values[heading], 9), turn, counts[row, col, heading], visits)
        if best < 0 or key < best_key:
            best, best_key = heading, key
    return best
