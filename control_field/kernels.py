"""
The loops of the method, written once for two executions.

Plain Python over NumPy arrays: the robot runs these functions as they stand, the learner's side
runs the same source through numba (`control_field.compiled`). So they keep to what numba
understands: scalars, arrays, tuples, `heapq`, and one another.
"""

import heapq
import math

import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.records import Kind
from control_field.sight import BLOCKED, UNKNOWN

_BLOCKED = int(BLOCKED)
_UNKNOWN = int(UNKNOWN)
_FIELD, _BLOCKED_KIND, _AVOID = int(Kind.FIELD), int(Kind.BLOCKED), int(Kind.AVOID)
_EXPLORE, _DETOUR = int(Kind.EXPLORE), int(Kind.DETOUR)


def is_barred(known, row, col, unknown_is_blocked):
    """Tell whether a cell lies outside or is known (or held) to be blocked."""
    if row < 0 or col < 0 or row >= known.shape[0] or col >= known.shape[1]:
        return True
    state = known[row, col]
    return state == _BLOCKED or (unknown_is_blocked and state == _UNKNOWN)


def step_allowed(known, row, col, heading, rules):
    """
    Tell whether the map allows a step.

    ``rules`` is ``(corner_cutting, unknown_is_blocked, moves)`` here and everywhere below.
    """
    corner_cutting, unknown_is_blocked, moves = rules
    if heading % 2 == 1:
        if moves == 4:
            return False
        if not corner_cutting and (
                is_barred(known, row + STEP_ROW[heading], col, unknown_is_blocked)
                or is_barred(known, row, col + STEP_COL[heading], unknown_is_blocked)):
            return False
    return not is_barred(
        known, row + STEP_ROW[heading], col + STEP_COL[heading], unknown_is_blocked)


def allowed_steps(known, row, col, rules):
    """Return the mask of the steps that the map allows."""
    mask = 0
    for heading in range(8):
        if step_allowed(known, row, col, heading, rules):
            mask |= 1 << heading
    return mask


def remember_sight(known, row, col, blocked, unknown):
    """Write a 3x3 sight into the remembered map; return how many cells it newly barred."""
    known[row, col] = 0
    n_barred = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if 0 <= r < known.shape[0] and 0 <= c < known.shape[1] and not unknown >> heading & 1:
            state = _BLOCKED if blocked >> heading & 1 else 0
            if state == _BLOCKED and known[r, c] != _BLOCKED:
                n_barred += 1
            known[r, c] = state
    return n_barred


def cost_to_go(known, goal_row, goal_col, shown, advantage, factor, rules):
    """
    Return the least cost from every cell to the goal, in cells: eq. 6 run to its fixed point.

    With learning rate 1 in a deterministic world the fixed point of eq. 6 is
    ``V(s) = max_a discount ** length(a) * V(s')``; its logarithm is a least cost, and sweeping the
    backups in order of priority is Dijkstra's order. A demonstrated step (``shown[row, col]`` is
    its heading) costs ``1 - advantage`` of its length; ``factor`` scales the length of steps into a
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
            if is_barred(known, r, c, rules[1]) or not step_allowed(known, r, c, heading, rules):
                continue
            length = STEP_LENGTH[heading] * factor[row, col]
            if shown[r, c] == heading:
                length *= 1.0 - advantage
            if at + length < cost[r, c] - 1e-12:
                cost[r, c] = at + length
                heapq.heappush(heap, (at + length, r, c))
    return cost


def q_from_cost(known, cost, shown, advantage, factor, discount, rules):
    """Return the Q-matrix of a cost to go: -1 where a step is known to be blocked."""
    rows, cols = known.shape
    q = np.zeros((rows, cols, 8))
    for row in range(rows):
        for col in range(cols):
            if is_barred(known, row, col, rules[1]):
                continue
            for heading in range(8):
                if not step_allowed(known, row, col, heading, rules):
                    q[row, col, heading] = -1.0
                    continue
                r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
                length = STEP_LENGTH[heading] * factor[r, c]
                if shown[row, col] == heading:
                    length *= 1.0 - advantage
                if cost[r, c] < np.inf:
                    q[row, col, heading] = discount ** (length + cost[r, c])
    return q


def best_step(known, cost, factor, row, col, course, rules):
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


def flow_reaches(known, headings, row, col, goal_row, goal_col, rules):
    """
    Follow the field over the remembered map; tell whether it reaches the goal.

    Returns
    -------
    int
        Steps to the goal, or -1 if the flow ends in something barred, in a cell without a course
        or in a loop (more steps than cells).

    """
    limit = known.shape[0] * known.shape[1]
    for step in range(limit + 1):
        if row == goal_row and col == goal_col:
            return step
        heading = headings[row, col]
        if heading < 0 or not step_allowed(known, row, col, heading, rules):
            return -1
        row += STEP_ROW[heading]
        col += STEP_COL[heading]
    return -1


def flow_basin(known, headings, goal_row, goal_col, rules):
    """
    Follow the field from every cell at once.

    Returns
    -------
    ndarray of int8, shape (n_rows, n_cols)
        1: reaches the goal; 2: leads into a loop; 3: leads into a cell whose course is barred or
        missing; 0: the cell itself is barred.

    """
    rows, cols = known.shape
    state = np.zeros((rows, cols), dtype=np.int8)
    path = np.empty((rows * cols, 2), dtype=np.int64)
    for first_row in range(rows):
        for first_col in range(cols):
            if state[first_row, first_col] or is_barred(known, first_row, first_col, rules[1]):
                continue
            n, row, col, verdict = 0, first_row, first_col, 0
            while verdict == 0:
                heading = headings[row, col]
                if state[row, col] == 9:
                    verdict = 2
                elif state[row, col] != 0:
                    verdict = state[row, col]
                elif row == goal_row and col == goal_col:
                    state[row, col] = 1
                    verdict = 1
                elif heading < 0 or not step_allowed(known, row, col, heading, rules):
                    state[row, col] = 3
                    verdict = 3
                else:
                    state[row, col] = 9
                    path[n, 0], path[n, 1] = row, col
                    n += 1
                    row += STEP_ROW[heading]
                    col += STEP_COL[heading]
            for i in range(n):
                state[path[i, 0], path[i, 1]] = verdict
    return state


def rehearse_locally(known, cost, factor, row, col, goal_row, goal_col, n_backups, rules):
    """
    Mend the cost to go around the robot, in place, by at most ``n_backups`` backups each way.

    Looks ahead from the robot over the remembered map (optimistic where unseen), then carries the
    costs of the rim back through the cells looked at: eq. 6 swept in order of priority over the
    neighbourhood that matters (local search space LRTA*, Koenig and Sun 2009).
    """
    reach = {(row, col): 0.0}
    settled = {(row, col): False}
    heap = [(0.0, row, col)]
    n = 0
    while len(heap) > 0 and n < n_backups:
        at, r, c = heapq.heappop(heap)
        if at > reach[(r, c)] or settled[(r, c)]:
            continue
        if r == goal_row and c == goal_col:
            heapq.heappush(heap, (at, r, c))
            break
        settled[(r, c)] = True
        n += 1
        for heading in range(8):
            if not step_allowed(known, r, c, heading, rules):
                continue
            nr, nc = r + STEP_ROW[heading], c + STEP_COL[heading]
            length = at + STEP_LENGTH[heading] * factor[nr, nc]
            if (nr, nc) not in reach or length < reach[(nr, nc)] - 1e-12:
                if (nr, nc) not in reach:
                    settled[(nr, nc)] = False
                reach[(nr, nc)] = length
                heapq.heappush(heap, (length, nr, nc))
    rim = [(0.0, 0, 0)]
    rim.pop()
    for place in reach:
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
            if (nr, nc) not in reach or not settled[(nr, nc)]:
                continue
            if not step_allowed(known, nr, nc, heading, rules):
                continue
            total = at + STEP_LENGTH[heading] * factor[r, c]
            if total < cost[nr, nc] - 1e-12:
                cost[nr, nc] = total
                heapq.heappush(rim, (total, nr, nc))


def least_chosen(counts, row, col, allowed, rng):
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


def window_values(q, row, col, window, power):
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


def next_highest(values, counts, entered, row, col, course, allowed):
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
