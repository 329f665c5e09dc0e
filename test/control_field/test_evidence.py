from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.learning.evidence import Evidence
from oracles import neighbourhood_from_masks
from strategies import few, masks, occupancies, steady

SHAPE = (3, 4)
#: What an episode shows of one cell: nothing, free, a wall, or one after the other.
FREE, WALL, FREE_THEN_WALL, WALL_THEN_FREE, NOTHING = [0], [100], [0, 100], [100, 0], []


def evidence_of(episodes, map_memory=8):
    """Return what episodes show of cell (0, 0), each a list of how it looks."""
    evidence = Evidence(SHAPE, map_memory)
    for episode in episodes:
        evidence.begin()
        for state in episode:
            evidence.observe_cells(0, 0, np.array([[state]], np.int8))
        evidence.end()
    return evidence


def known(episodes, map_memory=8):
    return int(evidence_of(episodes, map_memory).known[0, 0])


def n_certain(episodes):
    """Return for how many more episodes that do not show it a wall stays certain."""
    return next(n for n in range(100) if known([*episodes, *[NOTHING] * n]) < 100)


def test_what_was_never_seen_is_unknown_and_has_no_age():
    evidence = evidence_of([FREE, NOTHING])
    assert evidence.known.tolist() == [[0, -1, -1, -1], [-1] * 4, [-1] * 4]
    assert evidence.age.tolist() == [[1, -1, -1, -1], [-1] * 4, [-1] * 4]


def test_a_wall_seen_in_many_trials_outweighs_a_glimpse():
    assert n_certain([WALL]) == 4  # half of map_memory
    assert n_certain([WALL] * 2) == n_certain([WALL] * 9) == 8


def test_what_was_free_before_is_doubted_the_sooner_the_fewer_times_it_was_seen_closed():
    assert [n_certain([FREE] * 5 + [WALL] * n) for n in range(1, 7)] == [0, 1, 3, 7, 8, 8]
    assert n_certain([FREE, WALL, WALL, WALL, FREE, WALL]) == 0
    assert [n_certain([FREE] + [WALL] * n) for n in range(1, 5)] == [1, 3, 7, 8]


def test_confidence_falls_with_age_to_a_floor_and_one_look_settles_it():
    seen = [known([FREE, FREE, WALL, *[NOTHING] * n]) for n in range(8)]
    assert seen == sorted(seen, reverse=True)
    assert (seen[0], seen[1], seen[-1]) == (99, 49, 25)
    assert known([FREE, WALL, *[NOTHING] * 50, FREE]) == 0


@pytest.mark.parametrize(('episode', 'before', 'expected'), [
    (FREE_THEN_WALL, [], 0), (WALL_THEN_FREE, [], 0), (FREE_THEN_WALL, [FREE], 0),
    (WALL_THEN_FREE, [WALL, WALL], 0), (FREE_THEN_WALL, [WALL, WALL], 100),
    ([100, 0, 100], [WALL, WALL], 100), ([0, 100, 0], [FREE], 0)])
def test_what_is_seen_free_and_occupied_in_one_episode_moves_unless_it_was_a_wall_before(
        episode, before, expected):
    assert known([*before, episode], map_memory=0) == expected


@pytest.mark.parametrize(('beside', 'expected'), [
    ([[0, 100], [100, 100], [0, 100]], 99), ([[0, 100], [0, 100]], 100),
    ([[100, 100], [100, 100]], 100)])
def test_a_wall_first_seen_where_something_moves_is_doubted_at_once(beside, expected):
    evidence = Evidence(SHAPE, 8)
    evidence.begin()
    for cells in beside:  # of a cell, and of one that is never seen free
        evidence.observe_cells(0, 0, np.array([cells], np.int8))
    evidence.end()
    assert evidence.known[0, 1] == expected
    assert n_certain([FREE_THEN_WALL, WALL]) == n_certain([FREE, WALL])


@given(st.lists(st.sampled_from([FREE, WALL, FREE_THEN_WALL, NOTHING]), max_size=12))
@steady
def test_without_map_memory_nothing_is_ever_doubted(episodes):
    assert known(episodes, map_memory=0) in (-1, 0, 100)


@given(st.lists(st.sampled_from([FREE, WALL, FREE_THEN_WALL, WALL_THEN_FREE, NOTHING]),
                min_size=1, max_size=12), st.integers(1, 9))
@steady
def test_what_the_last_episode_showed_outlives_all_before(episodes, map_memory):
    last = known(episodes, map_memory)
    if episodes[-1] in (FREE, WALL_THEN_FREE):
        assert last == 0
    if episodes[-1] == WALL:
        assert last in (99, 100)
    assert (last == -1) == (not any(episodes))


@given(occupancies(low=3, high=6), st.data())
@few
def test_in_an_episode_where_nothing_moves_the_order_of_looks_does_not_matter(truth, data):
    looks = [(row, col, 1) for row, col in np.argwhere(truth == 0).tolist()]
    looks += [(row, col, 2) for row, col, _ in looks]
    results = []
    for order in (looks, data.draw(st.permutations(looks))):
        evidence = Evidence(truth.shape, 5)
        for _ in range(2):
            evidence.begin()
            for row, col, reach in order:
                around = np.pad(truth, reach, constant_values=100)
                size = 2 * reach + 1
                evidence.observe_cells(
                    row - reach, col - reach, around[row:row + size, col:col + size])
            evidence.end()
        results.append((evidence.known.tobytes(), evidence.age.tobytes()))
    assert results[0] == results[1]


@given(masks, masks)
@few
def test_a_local_grid_and_the_same_cells_in_a_block_are_the_same_evidence(blocked, unknown):
    grids, blocks = Evidence((3, 3), 4), Evidence((3, 3), 4)
    for evidence in (grids, blocks):
        evidence.begin()
    grids.observe(1, 1, blocked & ~unknown, unknown)
    blocks.observe_cells(0, 0, neighbourhood_from_masks(blocked & ~unknown, unknown))
    for evidence in (grids, blocks):
        evidence.end()
    assert np.array_equal(grids.known, blocks.known)
