"""
The cost to go, mended around the robot: local search space LRTA* (Koenig and Sun 2009).

Laid out in arrays, which compiled code is fastest with; plain Python takes the same numbers in the
same order. Places are numbered row by row, so that they compare as ``(row, col)`` do, and a step
from one that the map allows is a difference of numbers.
"""

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.steps import allowed_steps, FloatMap, Ground

Places = npt.NDArray[np.int64]
Marks = npt.NDArray[np.int16]
#: What a place can be: elsewhere, on the rim of what was looked at, or looked at; then this and
#: the mask of its allowed steps.
ELSEWHERE, RIM, LOOKED_AT = 0, 1, 2
#: In a memo: on the rim, and so far from the goal that no cost comes from there.
_BEYOND: Final = -1
#: Costs that differ by more have nothing to do with each other's rounding, [cells].
_APART: Final = 1e-9
#: Rehearsals that are kept for each place, for all of a map, and how large they may be, [places].
_N_WAYS: Final = 8
_N_REHEARSALS: Final = 4096
_LARGEST: Final = 640


class Memo(NamedTuple):
    """
    Rehearsals that were made, to be had again where all that they depend on is as it was.

    All of them have one goal and one number of backups.

    Parameters
    ----------
    latest : ndarray of int32, shape (n_places, n_ways + 1) or (0, n_ways + 1)
        Numbers of the latest rehearsals around each place, and how many there were. Empty: none
        is kept.
    starts, sizes, differing : ndarray of int64, shape (n_rehearsals,)
        Of each: the robot's place (-1: none yet), how many places it touched, and which of these
        was the last to differ.
    places : ndarray of int32, shape (n_rehearsals, n_touched)
    states : ndarray of int16, shape (n_rehearsals, n_touched)
        What `Search.noted` said, or `_BEYOND`.
    factors, costs : ndarray of float64, shape (n_rehearsals, n_touched)
        Factor, and cost to go afterwards; of a place beyond the least that it can be.
    n_made : ndarray of int64, shape (1,)

    """

    latest: npt.NDArray[np.int32]
    starts: Places
    sizes: Places
    differing: Places
    places: npt.NDArray[np.int32]
    states: Marks
    factors: FloatMap
    costs: FloatMap
    n_made: Places


class Search(NamedTuple):
    """
    What searches work in, so that none costs more than the places it looks at.

    Parameters
    ----------
    noted : ndarray of int16, shape (n_places,)
        What each place is while a search runs; `ELSEWHERE` before and after.
    reach : ndarray of float64, shape (n_places,)
        Cost from the robot of the places that are not elsewhere.
    masks : ndarray of int16, shape (n_places,) or (0,)
        1 and the mask of the allowed steps, kept from search to search; 0 where it is not known.
        Whoever keeps them has to say where the map changes, with `forget_masks`.
    mended : ndarray of int64, shape (n_places,) or (0,)
        The places whose cost was mended, for who wants to put them back.
    is_mended : ndarray of bool, shape (n_places,) or (0,)
    n_mended : ndarray of int64, shape (1,)
    memo : Memo

    """

    noted: Marks
    reach: FloatMap
    masks: Marks
    mended: Places
    is_mended: npt.NDArray[np.bool_]
    n_mended: npt.NDArray[np.int64]
    memo: Memo


def new_memo(n_places: int) -> Memo:
    """Return a memo for a map of so many places; of none, one that keeps nothing."""
    n, size = min(_N_REHEARSALS, _N_WAYS * n_places), min(_LARGEST, n_places)
    return Memo(
        np.zeros((n_places, _N_WAYS + 1), dtype=np.int32), np.full(n, -1, dtype=np.int64),
        np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64),
        np.zeros((n, size), dtype=np.int32), np.zeros((n, size), dtype=np.int16),
        np.zeros((n, size)), np.zeros((n, size)), np.zeros(1, dtype=np.int64))


def new_search(shape: tuple[int, int], keeps: bool) -> Search:
    """Return what searches on a map work in; whether it keeps what it finds."""
    n_places = shape[0] * shape[1]
    n_kept = n_places if keeps else 0
    return Search(np.zeros(n_places, dtype=np.int16), np.zeros(n_places),
                  np.zeros(n_kept, dtype=np.int16), np.zeros(n_kept, dtype=np.int64),
                  np.zeros(n_kept, dtype=np.bool_), np.zeros(1, dtype=np.int64),
                  new_memo(n_kept))


def offsets(n_cols: int) -> Places:
    """Return by how much the number of a place changes with a step of each heading."""
    steps = np.empty(8, dtype=np.int64)
    for heading in range(8):
        steps[heading] = STEP_ROW[heading] * n_cols + STEP_COL[heading]
    return steps


def forget_masks(search: Search, shape: tuple[int, int], row: int, col: int) -> None:
    """Forget which steps were allowed around a cell of the map that has changed."""
    if search.masks.shape[0]:
        for r in range(max(0, row - 1), min(shape[0], row + 2)):
            for c in range(max(0, col - 1), min(shape[1], col + 2)):
                search.masks[r * shape[1] + c] = 0


def push(costs: FloatMap, places: Places, n: int, cost: float, place: int) -> int:
    """Put an entry into a heap of n entries that is kept in two arrays; return n + 1."""
    at = n
    while at > 0:
        above = (at - 1) >> 1
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
    ground: Ground, search: Search, start: int, goal: int, n_backups: int,
) -> Places:
    """
    Look at the places nearest to the robot on the way, at most ``n_backups``.

    Stops at the goal, which stays on the rim of what was looked at.

    Returns
    -------
    ndarray of int64
        The places that ``search.noted`` now says something of.

    """
    known, n_cols, rules = ground.known, ground.known.shape[1], ground.rules
    noted, reach, masks, steps = search.noted, search.reach, search.masks, offsets(n_cols)
    factor, is_kept = ground.factor.reshape(-1), masks.shape[0] > 0
    # A place looked at reaches eight others at most.
    costs = np.empty(8 * n_backups + 1)
    places = np.empty(8 * n_backups + 1, dtype=np.int64)
    touched = np.empty(8 * n_backups + 1, dtype=np.int64)
    reach[start], noted[start], touched[0] = 0.0, RIM, start
    n_heap, n_touched, n = push(costs, places, 0, 0.0, start), 1, 0
    while n_heap > 0 and n < n_backups:
        at, place = pop(costs, places, n_heap)
        n_heap -= 1
        if noted[place] >= LOOKED_AT:
            continue
        if place == goal:
            break
        mask = masks[place] - 1 if is_kept else -1
        if mask < 0:
            mask = allowed_steps(known, place // n_cols, place % n_cols, rules)
        if is_kept:
            masks[place] = mask + 1
        noted[place] = LOOKED_AT + mask
        n += 1
        for heading in range(8):
            if not mask >> heading & 1:
                continue
            other = place + steps[heading]
            length = at + STEP_LENGTH[heading] * factor[other]
            if noted[other] == ELSEWHERE:
                touched[n_touched] = other
                n_touched += 1
            elif not length < reach[other] - 1e-12:
                continue
            reach[other], noted[other] = length, RIM
            n_heap = push(costs, places, n_heap, length, other)
    return touched[:n_touched]


def rim_around(
    cost: FloatMap, search: Search, touched: Places,
) -> tuple[FloatMap, Places, int]:
    """Forget the cost of the places looked at; return the heap of those on the rim."""
    # Besides the rim, every place looked at is put in by its neighbours, eight times at most.
    costs = np.zeros(9 * touched.shape[0])
    places = np.zeros(9 * touched.shape[0], dtype=np.int64)
    n = 0
    for place in touched:
        if search.noted[place] >= LOOKED_AT:
            cost[place] = np.inf
            if search.mended.shape[0] and not search.is_mended[place]:
                search.mended[search.n_mended[0]], search.is_mended[place] = place, True
                search.n_mended[0] += 1
        elif cost[place] < np.inf:
            n = push(costs, places, n, cost[place], place)
    return costs, places, n


def recall(ground: Ground, cost: FloatMap, search: Search, start: int) -> bool:
    """Do what an earlier rehearsal around a place did, if one is to be had; return whether."""
    memo, mended, is_mended = search.memo, search.mended, search.is_mended
    for way in range(_N_WAYS):
        number = memo.latest[start, way]
        if memo.starts[number] != start or not is_as_before(ground, cost, search, number):
            continue
        places, states, costs = memo.places[number], memo.states[number], memo.costs[number]
        n = search.n_mended[0]
        for i in range(memo.sizes[number]):
            if states[i] >= LOOKED_AT:
                place = places[i]
                cost[place] = costs[i]
                if not is_mended[place]:
                    mended[n], is_mended[place] = place, True
                    n += 1
        search.n_mended[0] = n
        return True
    return False


def is_as_before(ground: Ground, cost: FloatMap, search: Search, number: int) -> bool:
    """
    Return whether a rehearsal would come to what it came to before.

    That is so with the same steps from the places looked at, the same factors and the same cost on
    the rim, but for what is beyond. The place that differed last is looked at first.
    """
    # One loop, and arrays of its own: to hand them on for each place would take ten times as long.
    memo, masks, factor = search.memo, search.masks, ground.factor.reshape(-1)
    known, rules, n_cols = ground.known, ground.rules, ground.known.shape[1]
    places, states = memo.places[number], memo.states[number]
    factors, costs, differing = memo.factors[number], memo.costs[number], memo.differing[number]
    for k in range(-1, memo.sizes[number]):
        i = k if k >= 0 else differing
        place, state = places[i], states[i]
        is_same = factor[place] == factors[i]
        if state >= LOOKED_AT:
            if masks[place] == 0:
                masks[place] = 1 + allowed_steps(known, place // n_cols, place % n_cols, rules)
            is_same = is_same and masks[place] - 1 == state - LOOKED_AT
        elif state == RIM:
            is_same = is_same and cost[place] == costs[i]
        else:
            is_same = is_same and cost[place] >= costs[i]
        if not is_same:
            memo.differing[number] = i
            return False
    return True


def memorise(
    ground: Ground, cost: FloatMap, search: Search, start: int, touched: Places,
) -> None:
    """Keep a rehearsal that has just been made, in the place of the oldest one."""
    memo, factor = search.memo, ground.factor.reshape(-1)
    steps, noted = offsets(ground.known.shape[1]), search.noted
    number = memo.n_made[0] % memo.starts.shape[0]
    memo.n_made[0] += 1
    memo.latest[start, memo.latest[start, _N_WAYS] % _N_WAYS] = number
    memo.latest[start, _N_WAYS] += 1
    memo.starts[number], memo.sizes[number], memo.differing[number] = start, touched.shape[0], 0
    places, states = memo.places[number], memo.states[number]
    factors, costs = memo.factors[number], memo.costs[number]
    for i in range(touched.shape[0]):
        place = touched[i]
        places[i], states[i] = place, noted[place]
        factors[i], costs[i] = factor[place], cost[place]
        if noted[place] != RIM:
            continue
        enough = -np.inf
        for heading in range(8):
            other = place - steps[heading]
            if 0 <= other < noted.shape[0] and noted[other] >= LOOKED_AT and (
                    (noted[other] - LOOKED_AT) >> heading & 1):
                enough = max(enough, cost[other] - STEP_LENGTH[heading] * factor[place] + _APART)
        if cost[place] >= enough:
            states[i], costs[i] = _BEYOND, enough


def rehearse_locally(
    ground: Ground, cost: FloatMap, search: Search, row: int, col: int, goal: tuple[int, int],
    n_backups: int,
) -> None:
    """
    Mend the cost to go around the robot, in place, by at most ``n_backups`` backups each way.

    Looks ahead from the robot over the remembered map (optimistic where unseen), then carries the
    costs of the rim back through the places looked at: eq. 6 swept in order of priority over the
    neighbourhood that matters.
    """
    n_cols, noted, to_go = ground.known.shape[1], search.noted, cost.reshape(-1)
    start, keeps = row * n_cols + col, search.memo.latest.shape[0] > 0
    if keeps and recall(ground, to_go, search, start):
        return
    touched = look_around(ground, search, start, goal[0] * n_cols + goal[1], n_backups)
    factor, steps = ground.factor.reshape(-1), offsets(n_cols)
    costs, places, n = rim_around(to_go, search, touched)
    while n > 0:
        at, place = pop(costs, places, n)
        n -= 1
        if at > to_go[place]:
            continue
        for heading in range(8):
            other = place - steps[heading]
            # A place beyond an edge of the map is another one, which no step leads from to here.
            if not 0 <= other < noted.shape[0] or noted[other] < LOOKED_AT or (
                    not (noted[other] - LOOKED_AT) >> heading & 1):
                continue
            total = at + STEP_LENGTH[heading] * factor[place]
            if total < to_go[other] - 1e-12:
                to_go[other] = total
                n = push(costs, places, n, total, other)
    if keeps and touched.shape[0] <= search.memo.places.shape[1]:
        memorise(ground, to_go, search, start, touched)
    for place in touched:
        noted[place] = ELSEWHERE
