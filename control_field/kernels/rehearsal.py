"""
Rehearsal over a whole map: the cost to go, and the Q-matrix that it comes to.

Plain Python or compiled, as `kernels` says; in earnest compiled.
"""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.queues import pop, push
from control_field.kernels.steps import (
    CellMap, FloatMap, Ground, is_occupied, Preference, step_length, StepRules)

Masks = npt.NDArray[np.uint8]
Places = npt.NDArray[np.int32]
#: Least Q-value of a way to the goal, however long: the field's float32 must not make it 0.
_LEAST: Final = 1e-37
#: A way is better than another if it is shorter by this, [cells].
_BETTER: Final = 1e-12
#: Ways whose lengths differ by more have nothing to do with each other's rounding, [cells].
_NEAR: Final = 1e-8
#: Buckets of the queue; whatever lies farther ahead waits in a heap.
_N_BUCKETS: Final = 4096


class Queue(NamedTuple):
    """
    Places by their cost so far, in buckets that are narrower than the shortest step.

    Places are numbered row by row. A bucket is a list with links both ways, so that a place that
    is reached more cheaply moves to another one.

    Parameters
    ----------
    first : ndarray of int32, shape (n_buckets,)
        The first place of each bucket, -1 for none.
    after, before : ndarray of int32, shape (n_rows * n_cols,)
        Its neighbours in the list, -1 for none; ``after`` is -2 for a place in no list.
    far_costs : ndarray of float64
    far_places : ndarray of int64
        Heap of what lies beyond all buckets, also of what was reached more cheaply since.
    counts : ndarray of int64, shape (2,)
        How many places there are in the lists, and in the heap.
    per_cell : float
        Buckets a cell of cost.

    """

    first: Places
    after: Places
    before: Places
    far_costs: FloatMap
    far_places: npt.NDArray[np.int64]
    counts: npt.NDArray[np.int64]
    per_cell: float


class CostSearch(NamedTuple):
    """
    What the cost to go is reckoned from, and what it comes to; a place for each cell.

    Parameters
    ----------
    masks : ndarray of uint8
        Of `step_masks`.
    factor : ndarray of float64
        Of the ground.
    preferred : ndarray of int8
    spared : ndarray of float64
        Of the preference.
    costs : ndarray of float64
    is_near : ndarray of bool
        Where ways of nearly the same length have met.
    n_cols : int

    """

    masks: Masks
    factor: FloatMap
    preferred: CellMap
    spared: FloatMap
    costs: FloatMap
    is_near: npt.NDArray[np.bool_]
    n_cols: int


def step_masks(known: CellMap, rules: StepRules) -> Masks:
    """Return the mask of the steps that the map allows from each cell: `allowed_steps` of all."""
    corner_cutting, unknown_is_blocked, moves = rules
    rows, cols = known.shape
    free = np.zeros((rows + 2, cols + 2), dtype=np.uint8)
    clear = np.zeros((rows + 2, cols + 2), dtype=np.uint8)
    for row in range(rows):
        for col in range(cols):
            is_free = not is_occupied(known, row, col, unknown_is_blocked)
            free[row + 1, col + 1] = is_free
            clear[row + 1, col + 1] = corner_cutting or (is_free and known[row, col] <= 0)
    if corner_cutting:
        clear[:] = 1
    masks = np.zeros((rows, cols), dtype=np.uint8)
    slant = 1 if moves == 8 else 0
    for row in range(rows):
        up, at, down = free[row + 2], free[row + 1], free[row]
        above, beside, below = clear[row + 2], clear[row + 1], clear[row]
        for col in range(cols):
            here, right = col + 1, col + 2
            masks[row, col] = (
                at[right] | up[here] << 2 | at[col] << 4 | down[here] << 6
                | slant * (up[right] & above[here] & beside[right]) << 1
                | slant * (up[col] & above[here] & beside[col]) << 3
                | slant * (down[col] & below[here] & beside[col]) << 5
                | slant * (down[right] & below[here] & beside[right]) << 7)
    return masks


def shortest_step(ground: Ground, preference: Preference) -> float:
    """Return what no step counts less than, [cells]."""
    most = 0.0
    for row in range(ground.factor.shape[0]):
        for col in range(ground.factor.shape[1]):
            if preference.headings[row, col] >= 0:
                most = max(most, preference.spared[row, col])
    return float(ground.factor.min() * (1.0 - most))


def bucket_of(queue: Queue, cost: float) -> int:
    """Return the number of the bucket of a cost, counted from the goal."""
    return int(cost * queue.per_cell)


def new_queue(n_places: int, per_cell: float) -> Queue:
    """Return a queue with nothing in it."""
    # A place comes into the heap no more often than it has neighbours.
    return Queue(
        np.full(_N_BUCKETS, -1, dtype=np.int32), np.full(n_places, -2, dtype=np.int32),
        np.zeros(n_places, dtype=np.int32), np.empty(8 * n_places),
        np.empty(8 * n_places, dtype=np.int64), np.zeros(2, dtype=np.int64), per_cell)


def put_in(queue: Queue, cost: float, place: int) -> None:
    """Put a place that is in no list into its bucket."""
    at = bucket_of(queue, cost) % queue.first.shape[0]
    head = queue.first[at]
    queue.first[at], queue.after[place], queue.before[place] = place, head, -1
    if head >= 0:
        queue.before[head] = place
    queue.counts[0] += 1


def put_far(queue: Queue, cost: float, place: int) -> None:
    """Put a place into the heap."""
    queue.counts[1] = push(queue.far_costs, queue.far_places, queue.counts[1], cost, place)


def take_out(queue: Queue, cost: float, place: int) -> None:
    """Take a place out of its bucket."""
    before, after = queue.before[place], queue.after[place]
    if before >= 0:
        queue.after[before] = after
    else:
        queue.first[bucket_of(queue, cost) % queue.first.shape[0]] = after
    if after >= 0:
        queue.before[after] = before
    queue.after[place] = -2
    queue.counts[0] -= 1


def take_bucket(queue: Queue, number: int, costs: FloatMap, due: Places) -> int:
    """Take all places out of a bucket, into ``due``; return how many."""
    at = number % queue.first.shape[0]
    n, place = 0, queue.first[at]
    while place >= 0:
        due[n] = place
        n += 1
        place = queue.after[place]
        queue.after[due[n - 1]] = -2
    queue.first[at] = -1
    queue.counts[0] -= n
    while queue.counts[1] > 0 and bucket_of(queue, queue.far_costs[0]) <= number:
        cost, place = pop(queue.far_costs, queue.far_places, queue.counts[1])
        queue.counts[1] -= 1
        if costs[place] == cost:
            due[n] = place
            n += 1
    return n


def cost_to_go(ground: Ground, goal: tuple[int, int], preference: Preference) -> FloatMap:
    """
    Return the least cost from every cell to the goal, in cells: eq. 6 run to its fixed point.

    With learning rate 1 in a deterministic world the fixed point of eq. 6 is
    ``V(s) = max_a discount ** length(a) * V(s')``; its logarithm is a least cost, and sweeping the
    backups in order of priority is Dijkstra's order. Cells without a way to the goal cost inf.

    Cells are taken bucket by bucket, in any order within: no step is shorter than a bucket is
    wide. Where ways of nearly the same length meet, `cost_by` goes through them as they would
    have come cell by cell, ``(cost, row, col)`` ascending; so rounding is the same.
    """
    rows, cols = ground.known.shape
    cost, n_places = np.full((rows, cols), np.inf), rows * cols
    cost[goal[0], goal[1]] = 0.0
    if is_occupied(ground.known, goal[0], goal[1], ground.rules.unknown_is_blocked):
        return cost
    search = CostSearch(
        step_masks(ground.known, ground.rules).reshape(-1), ground.factor.reshape(-1),
        preference.headings.reshape(-1), preference.spared.reshape(-1), cost.reshape(-1),
        np.zeros(n_places, dtype=np.bool_), cols)
    queue = new_queue(n_places, 1.001 / shortest_step(ground, preference))
    put_in(queue, 0.0, goal[0] * cols + goal[1])
    due, number = np.zeros(n_places, dtype=np.int32), 0
    while queue.counts.sum() > 0:
        if queue.counts[0] == 0:
            number = max(number, bucket_of(queue, queue.far_costs[0]))
        n_due = take_bucket(queue, number, search.costs, due)
        reach_neighbours(search, queue, number, due[:n_due])
        number += 1
    return cost


def reach_neighbours(search: CostSearch, queue: Queue, number: int, due: Places) -> None:
    """Settle the cost of the places of the bucket ``number``, and reach their neighbours."""
    costs, cols = search.costs, search.n_cols
    for place in due:
        if search.is_near[place]:
            costs[place] = cost_by(search, place)
        for way in range(8):
            if not search.masks[place] >> way & 1:
                continue
            there = place + STEP_ROW[way] * cols + STEP_COL[way]
            length = STEP_LENGTH[way] * search.factor[place]
            if search.preferred[there] == (way + 4) % 8:
                length *= 1.0 - search.spared[there]
            total, before = costs[place] + length, costs[there]
            if total > before + _NEAR:
                continue
            search.is_near[there] = total >= before - _NEAR
            if total < before:
                if queue.after[there] != -2:
                    take_out(queue, before, there)
                costs[there] = total
                if bucket_of(queue, total) - number < _N_BUCKETS:
                    put_in(queue, total, there)
                else:
                    put_far(queue, total, there)


def cost_by(search: CostSearch, place: int) -> float:
    """
    Return the cost of a place by its neighbours, in the order in which Dijkstra meets them.

    A later one counts only if it is better than those before it by more than rounding.
    """
    totals, least = np.full(8, np.inf), np.inf
    for heading in range(8):
        if search.masks[place] >> heading & 1:
            there = place + STEP_ROW[heading] * search.n_cols + STEP_COL[heading]
            length = STEP_LENGTH[heading] * search.factor[there]
            if search.preferred[place] == heading:
                length *= 1.0 - search.spared[place]
            totals[heading] = search.costs[there] + length
            least = min(least, totals[heading])
    best = np.inf
    while True:
        first = first_met(search, place, totals, least + _NEAR)
        if first < 0:
            return best
        if totals[first] < best - _BETTER:
            best = totals[first]
        totals[first] = np.inf


def first_met(search: CostSearch, place: int, totals: FloatMap, most: float) -> int:
    """Return the heading of the neighbour that is met first, of finite totals; -1 for none."""
    first, first_cost, first_there = -1, np.inf, 0
    for heading in range(8):
        if totals[heading] <= most and totals[heading] < np.inf:
            there = place + STEP_ROW[heading] * search.n_cols + STEP_COL[heading]
            cost = search.costs[there]
            if first < 0 or cost < first_cost or (cost == first_cost and there < first_there):
                first, first_cost, first_there = heading, cost, there
    return first


def reaches_unseen(ground: Ground, goal: tuple[int, int]) -> bool:
    """Return whether there is ground never seen with a way to the goal, as the map has it."""
    known, cols = ground.known.reshape(-1), ground.known.shape[1]
    masks = step_masks(ground.known, ground.rules).reshape(-1)
    stack, is_found = np.empty(known.size, dtype=np.int64), np.zeros(known.size, dtype=np.bool_)
    n, stack[0] = 1, goal[0] * cols + goal[1]
    is_found[stack[0]] = True
    if is_occupied(ground.known, goal[0], goal[1], ground.rules.unknown_is_blocked):
        n = 0
    while n > 0:
        n -= 1
        place = stack[n]
        if known[place] < 0:
            return True
        for way in range(8):
            there = place + STEP_ROW[way] * cols + STEP_COL[way]
            if masks[place] >> way & 1 and not is_found[there]:
                is_found[there] = True
                stack[n] = there
                n += 1
    return False


def q_of_steps_into(
    ground: Ground, cost: FloatMap, length: float, discount: float,
) -> FloatMap:
    """
    Return the Q-value of a step of some length into each cell; 0 where there is no way on.

    Parameters
    ----------
    length : float, [cells]
        Before the factor of the cell.

    """
    far = math.log(_LEAST) / math.log(discount) + 1.0
    q = np.zeros(cost.shape)
    for row in range(cost.shape[0]):
        for col in range(cost.shape[1]):
            total = length * ground.factor[row, col] + cost[row, col]
            if total < np.inf:
                q[row, col] = _LEAST if total > far else max(_LEAST, discount ** total)
    return q


def q_from_cost(
    ground: Ground, cost: FloatMap, preference: Preference, discount: float,
) -> FloatMap:
    """Return the Q-matrix of a cost to go: -1 where a step is known to be blocked."""
    known, rules = ground.known, ground.rules
    rows, cols = known.shape
    masks = step_masks(known, rules)
    straight = q_of_steps_into(ground, cost, 1.0, discount)
    slanting = q_of_steps_into(ground, cost, STEP_LENGTH[1], discount)
    q = np.zeros((rows, cols, 8))
    for row in range(rows):
        for col in range(cols):
            if is_occupied(known, row, col, rules.unknown_is_blocked):
                continue
            for heading in range(8):
                if not masks[row, col] >> heading & 1:
                    q[row, col, heading] = -1.0
                    continue
                r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
                if preference.headings[row, col] != heading:
                    q[row, col, heading] = slanting[r, c] if heading % 2 else straight[r, c]
                elif cost[r, c] < np.inf:
                    length = step_length(ground, preference, row, col, heading)
                    q[row, col, heading] = max(_LEAST, discount ** (length + cost[r, c]))
    return q


def best_steps(ground: Ground, cost: FloatMap) -> tuple[CellMap, Masks]:
    """
    Return the step of least cost to go from each cell, and those that are as good or nearly so.

    Returns
    -------
    headings : ndarray of int8, shape (n_rows, n_cols)
        As `best_step` has it without a heading to go by; -1 for none, in the goal, and for cells
        that are occupied.
    ties : ndarray of uint8, shape (n_rows, n_cols)
        Masks of the steps to choose among where there are several, else 0.

    """
    known, factor, rules = ground
    rows, cols = known.shape
    masks = step_masks(known, rules)
    headings = np.full((rows, cols), -1, dtype=np.int8)
    ties = np.zeros((rows, cols), dtype=np.uint8)
    for row in range(rows):
        for col in range(cols):
            if is_occupied(known, row, col, rules.unknown_is_blocked) or not cost[row, col] > 0.0:
                continue
            best, best_cost, least, near = -1, np.inf, np.inf, 0
            for heading in range(8):
                if not masks[row, col] >> heading & 1:
                    continue
                r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
                total = cost[r, c] + STEP_LENGTH[heading] * factor[r, c]
                if total < best_cost - 1e-9:
                    best, best_cost = heading, total
                if total < least - _NEAR:
                    near = 1 << heading
                elif total < least + _NEAR:
                    near |= 1 << heading
                least = min(least, total)
            headings[row, col] = best
            if near & (near - 1):
                ties[row, col] = near
    return headings, ties
