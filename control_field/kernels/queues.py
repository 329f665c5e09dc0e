"""
Queues of places by their cost: a heap, and an agenda for costs that lie near each other.

Plain Python or compiled, as `kernels` says.
"""

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.kernels.steps import FloatMap

Places = npt.NDArray[np.int64]
Links = npt.NDArray[np.int32]
#: Buckets of an agenda, and how many there are for a cell of cost.
_N_LISTS: Final = 2048
_PER_CELL: Final = 16.0


class Agenda(NamedTuple):
    """
    Places ordered by cost, those of the same cost by number; all costs are kept in one array.

    A bucket is a list in that order. Whatever costs more than there are buckets for waits in the
    last one, which takes longer and is in order, too.

    Parameters
    ----------
    first : ndarray of int32, shape (n_buckets,)
        The first place of each bucket, -1 for none.
    after : ndarray of int32, shape (n_places,)
        The next one in its bucket, -1 for none; of a place in the agenda.

    """

    first: Links
    after: Links


def new_agenda(n_places: int) -> Agenda:
    """Return an agenda with nothing on it."""
    return Agenda(np.full(_N_LISTS, -1, dtype=np.int32), np.zeros(n_places, dtype=np.int32))


def bucket_on(agenda: Agenda, ahead: float) -> int:
    """Return the number of the bucket of a cost, counted from the least there is."""
    return int(min(ahead * _PER_CELL, agenda.first.shape[0] - 1.0))


def enter(agenda: Agenda, costs: FloatMap, least: float, place: int) -> None:
    """Put a place that is not on an agenda where it belongs."""
    first, after = agenda.first, agenda.after
    cost = costs[place]
    bucket = bucket_on(agenda, cost - least)
    before, other = -1, first[bucket]
    while other >= 0 and (costs[other] < cost or (costs[other] == cost and other < place)):
        before, other = other, after[other]
    after[place] = other
    if before < 0:
        first[bucket] = place
    else:
        after[before] = place


def leave(agenda: Agenda, costs: FloatMap, least: float, place: int) -> None:
    """Take a place off an agenda, before its cost changes."""
    first, after = agenda.first, agenda.after
    bucket = bucket_on(agenda, costs[place] - least)
    other = first[bucket]
    if other == place:
        first[bucket] = after[place]
        return
    while after[other] != place:
        other = after[other]
    after[other] = after[place]


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
