import heapq

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import compiled, local_search
from control_field.kernels.steps import Ground, step_allowed, StepRules
from control_field.local_grid import BLOCKED, FREE, UNKNOWN


def is_inside(known, place):
    return all(0 <= k < n for k, n in zip(place, known.shape, strict=True))


def steps_from(ground, place, back=False):
    """Yield the places that a step leads to (or comes from), and its length."""
    for heading in range(8):
        turn = -1 if back else 1
        other = (place[0] + turn * STEP_ROW[heading], place[1] + turn * STEP_COL[heading])
        if is_inside(ground.known, other) and step_allowed(
                ground.known, *(other if back else place), heading, ground.rules):
            yield other, STEP_LENGTH[heading] * ground.factor[place if back else other]


def looked_at(ground, start, goal, n_backups):
    """Return the nearest places, at most so many, as True, and the rim around them as False."""
    reach, settled, heap, n = {start: 0.0}, {start: False}, [(0.0, start)], 0
    while heap and n < n_backups:
        at, place = heapq.heappop(heap)
        if settled[place]:
            continue
        if place == goal:
            break
        settled[place], n = True, n + 1
        for other, length in steps_from(ground, place):
            if at + length < reach.get(other, np.inf) - 1e-12:
                reach[other], settled[other] = at + length, False
                heapq.heappush(heap, (at + length, other))
    return settled


def rehearsed(ground, cost, start, goal, n_backups):
    """Return the cost to go, mended around a place: written with dictionaries and `heapq`."""
    settled, cost = looked_at(ground, start, goal, n_backups), cost.copy()
    for place in settled:
        if settled[place]:
            cost[place] = np.inf
    rim = sorted((cost[place], place) for place in settled if cost[place] < np.inf)
    while rim:
        at, place = heapq.heappop(rim)
        if at > cost[place]:
            continue
        for other, length in steps_from(ground, place, back=True):
            if settled.get(other, False) and at + length < cost[other] - 1e-12:
                cost[other] = at + length
                heapq.heappush(rim, (at + length, other))
    return cost


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), rows=st.integers(1, 14), cols=st.integers(1, 14),
       n_backups=st.sampled_from([1, 3, 20, 400]), corner_cutting=st.booleans(),
       unknown_is_blocked=st.booleans(), moves=st.sampled_from([4, 8]))
def test_rehearsal_mends_what_a_search_with_dictionaries_mends(
        seed, rows, cols, n_backups, corner_cutting, unknown_is_blocked, moves):
    rng = np.random.default_rng(seed)
    known = rng.choice([FREE, FREE, BLOCKED, UNKNOWN], size=(rows, cols)).astype(np.int8)
    cost = np.where(rng.random((rows, cols)) < 0.1, np.inf, rng.random((rows, cols)) * 20.0)
    ground = Ground(known, np.where(known < 0, 1.2, 1.0),
                    StepRules(corner_cutting, unknown_is_blocked, moves))
    row, col, *goal = (int(rng.integers(n)) for n in (rows, cols, rows, cols))
    expected = rehearsed(ground, cost, (row, col), tuple(goal), n_backups)
    for kernels in (local_search, compiled):
        for keeps in (False, True):
            mended, search = cost.copy(), local_search.new_search(known.shape, keeps)
            for _ in range(2):  # what it has worked in is as it was
                mended[:] = cost
                kernels.rehearse_locally(
                    ground, mended, search, row, col, tuple(goal), n_backups)
            np.testing.assert_array_equal(mended, expected)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), n_backups=st.sampled_from([5, 30, 200]),
       moves=st.sampled_from([4, 8]))
def test_a_rehearsal_had_again_is_the_one_that_would_be_made(seed, n_backups, moves):
    rng, shape = np.random.default_rng(seed), (9, 11)
    known = rng.choice([FREE, FREE, FREE, BLOCKED, UNKNOWN], size=shape).astype(np.int8)
    begun = np.where(rng.random(shape) < 0.1, np.inf, rng.random(shape) * 20.0)
    ground = Ground(known, np.where(known < 0, 0.9, 1.0), StepRules(False, False, moves))
    search, cost = local_search.new_search(shape, True), begun.copy()
    for _ in range(60):
        if rng.random() < 0.3:  # a trial begins
            cost[:] = begun
        row, col, r, c = (int(rng.integers(n)) for n in (*shape, *shape))
        if rng.random() < 0.3:
            known[row, col] = rng.choice([FREE, BLOCKED])
            ground.factor[row, col] = 1.0
            compiled.forget_masks(search, shape, row, col)
        if rng.random() < 0.3:
            cost[row, col] += rng.choice([0.0, 1.0, 30.0])
        expected, fresh = cost.copy(), local_search.new_search(shape, False)
        where = r // 3 * 3, c // 3 * 3, (8, 10), n_backups
        compiled.rehearse_locally(ground, expected, fresh, *where)
        compiled.rehearse_locally(ground, cost, search, *where)
        np.testing.assert_array_equal(cost, expected)
    assert search.memo.n_made[0] < 60
