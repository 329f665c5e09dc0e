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
from control_field.kernels.queues import Agenda, enter, leave, new_agenda, Places
from control_field.kernels.steps import allowed_steps, FloatMap, Ground

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
    touched : ndarray of int64, shape (n_places,)
        Takes which places these are.
    agenda : Agenda
        Nothing is on it before and after.
    steps : ndarray of int64, shape (8,)
        Of `offsets`.
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
    touched: Places
    agenda: Agenda
    steps: Places
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
                  np.zeros(n_places, dtype=np.int64), new_agenda(n_places), offsets(shape[1]),
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


def look_around(ground: Ground, search: Search, start: int, goal: int, n_backups: int) -> int:
    """
    Look at the places nearest to the robot on the way, at most ``n_backups``.

    Stops at the goal, which stays on the rim of what was looked at.

    Returns
    -------
    int
        How many places ``search.touched`` now holds: those that ``search.noted`` says something
        of.

    """
    known, n_cols, rules = ground.known, ground.known.shape[1], ground.rules
    noted, reach, masks, steps = search.noted, search.reach, search.masks, search.steps
    agenda, touched, first = search.agenda, search.touched, search.agenda.first
    factor, is_kept = ground.factor.reshape(-1), masks.shape[0] > 0
    reach[start], noted[start], touched[0] = 0.0, RIM, start
    enter(agenda, reach, 0.0, start)
    n_touched, n_waiting, n, bucket = 1, 1, 0, 0
    while n_waiting > 0 and n < n_backups:
        place = first[bucket]
        if place < 0:
            bucket += 1
            continue
        if place == goal:
            break
        first[bucket] = agenda.after[place]
        n_waiting -= 1
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
            length = reach[place] + STEP_LENGTH[heading] * factor[other]
            if noted[other] == ELSEWHERE:
                touched[n_touched], noted[other] = other, RIM
                n_touched += 1
                n_waiting += 1
            elif length < reach[other] - 1e-12:
                leave(agenda, reach, 0.0, other)
            else:
                continue
            reach[other] = length
            enter(agenda, reach, 0.0, other)
    first[bucket:] = -1
    return n_touched


def rim_around(cost: FloatMap, search: Search, n_touched: int) -> tuple[float, int]:
    """
    Forget the cost of the places looked at; put those of the rim on the agenda.

    Returns
    -------
    least : float
        Cost on the rim.
    n : int
        How many places are on the agenda.

    """
    noted, touched, least, n = search.noted, search.touched, np.inf, 0
    for i in range(n_touched):
        place = touched[i]
        if noted[place] >= LOOKED_AT:
            cost[place] = np.inf
            if search.mended.shape[0] and not search.is_mended[place]:
                search.mended[search.n_mended[0]], search.is_mended[place] = place, True
                search.n_mended[0] += 1
        else:
            least = min(least, cost[place])
    for i in range(n_touched):
        if cost[touched[i]] < np.inf:
            enter(search.agenda, cost, least, touched[i])
            n += 1
    return least, n


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
    ground: Ground, cost: FloatMap, search: Search, start: int, n_touched: int,
) -> None:
    """Keep a rehearsal that has just been made, in the place of the oldest one."""
    memo, factor = search.memo, ground.factor.reshape(-1)
    steps, noted, touched = search.steps, search.noted, search.touched
    number = memo.n_made[0] % memo.starts.shape[0]
    memo.n_made[0] += 1
    memo.latest[start, memo.latest[start, _N_WAYS] % _N_WAYS] = number
    memo.latest[start, _N_WAYS] += 1
    memo.starts[number], memo.sizes[number], memo.differing[number] = start, n_touched, 0
    places, states = memo.places[number], memo.states[number]
    factors, costs = memo.factors[number], memo.costs[number]
    for i in range(n_touched):
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
    n_touched = look_around(ground, search, start, goal[0] * n_cols + goal[1], n_backups)
    carry_back(ground, to_go, search, n_touched)
    if keeps and n_touched <= search.memo.places.shape[1]:
        memorise(ground, to_go, search, start, n_touched)
    for place in search.touched[:n_touched]:
        noted[place] = ELSEWHERE


def carry_back(ground: Ground, cost: FloatMap, search: Search, n_touched: int) -> None:
    """Carry the costs of the rim back through the places looked at."""
    noted, agenda, steps, first = search.noted, search.agenda, search.steps, search.agenda.first
    factor = ground.factor.reshape(-1)
    least, n = rim_around(cost, search, n_touched)
    bucket = 0
    while n > 0:
        place = first[bucket]
        if place < 0:
            bucket += 1
            continue
        first[bucket] = agenda.after[place]
        n -= 1
        for heading in range(8):
            other = place - steps[heading]
            # A place beyond an edge of the map is another one, which no step leads from to here.
            if not 0 <= other < noted.shape[0] or noted[other] < LOOKED_AT or (
                    not (noted[other] - LOOKED_AT) >> heading & 1):
                continue
            total = cost[place] + STEP_LENGTH[heading] * factor[place]
            if total < cost[other] - 1e-12:
                if cost[other] < np.inf:
                    leave(agenda, cost, least, other)
                else:
                    n += 1
                cost[other] = total
                enter(agenda, cost, least, other)
