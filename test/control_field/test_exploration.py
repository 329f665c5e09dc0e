from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from control_field.grid import Grid
from control_field.headings import headings_from_vectors
from control_field.learning.exploration import (
    exploration_field, prices_of_walls, worth_around, worth_in_view, worth_of_look)
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import explores, Learner
from control_field.parameters import Parameters
from control_field.rays import rays_within, visible_cells
from control_field.robot import policy
from experience_evaluation.starts import choose_places
from experience_evaluation.teachers import demonstrate
from experience_evaluation.worlds import rooms_world
from strategies import few, knowns, practise, relearner, segment, steady, taught

#: A wall with a gap at one end; the same with one at the other end, too.
ONE_GAP = np.zeros((9, 15), np.int8)
ONE_GAP[4, 1:] = 100
TWO_GAPS = ONE_GAP.copy()
TWO_GAPS[4, 13] = 0
START, GOAL = (1, 12), (7, 12)
SHOWN = segment(START, (1, 4), (3, 2), (3, 0), (5, 0), (7, 2), GOAL)


def walled(n=0, **values):
    """Return a learner that was shown the way through the one gap, and has tried it n times."""
    learner = taught(SHOWN, ONE_GAP.shape, ONE_GAP, **values)
    practise(learner, ONE_GAP, [START] * n)
    return learner


def explore(learner, occupancy, n, spread):
    """Run n trials of a series, each on the field that `explores` says; return their steps."""
    steps = []
    for number in range(n):
        field = learner.trial_field(explores(learner.parameters, spread))
        start = START
        if spread:
            starts = learner.next_starts(50, np.random.default_rng(number), field)
            start = next(cell for cell in starts if occupancy[cell] == 0)
        trial = practise(learner, occupancy, [start], 100 + number,
                         exploring=explores(learner.parameters, spread))[0]
        steps.append(trial.n_steps)
    return steps


def test_what_is_worth_a_look():
    learner = walled(12)
    evidence, worth = learner.memory.evidence, worth_of_look(learner.memory)
    assert (worth[learner.memory.known < 0] == 1.0).all()
    assert not worth[evidence.age == 0].any()
    assert worth.max() == 1.0
    assert not evidence.outdated.any()


@given(relearner(low=4), st.data())
@few
def test_ground_is_outdated_once_something_is_not_as_it_was(learnt_bag, data):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy)
    practise(learner, occupancy, data.draw(st.lists(
        st.sampled_from(np.argwhere(occupancy == 0).tolist()), max_size=3)))
    evidence, before = learner.memory.evidence, learner.memory.known.copy()
    assert not evidence.outdated.any()
    inverted = np.where(occupancy == 0, 100, 0).astype(np.int8)
    inverted[cells[0]] = inverted[cells[-1]] = 0
    practise(learner, inverted, [cells[0]], 9)
    now, seen = learner.memory.known, evidence.age == 0
    assert not evidence.outdated[seen].any()
    assert np.array_equal(evidence.opened, (before == 100) & (now == 0))
    if ((before >= 0) & (now != before) & seen).any():
        assert np.array_equal(evidence.outdated, (before >= 0) & ~seen)


def test_what_one_change_explains_outdates_nothing_seen_since():
    learner = walled()
    practise(learner, ONE_GAP, [(0, 0), (0, 7)])
    moved = ONE_GAP.copy()
    moved[2, 5], moved[6, 9] = 100, 100
    for number, start in enumerate([(1, 6), (6, 8)], 10):
        practise(learner, moved, [start], number)
    evidence = learner.memory.evidence
    assert not evidence.outdated[evidence.age <= 1].any()


def test_the_price_of_a_wall_falls_with_its_age_and_rises_with_what_it_has_outlived():
    young, old = walled(3), walled(12)
    wall = young.memory.evidence.state == 100
    for learner in (young, old):
        price, age = prices_of_walls(learner.memory), learner.memory.evidence.age
        assert np.isinf(price[learner.memory.evidence.state != 100]).all()
        assert np.isinf(price[age == 0]).all()
        assert (price >= 1.0).all()
    assert wall.any()
    unseen = np.isfinite(prices_of_walls(young.memory)) & np.isfinite(prices_of_walls(old.memory))
    assert (prices_of_walls(old.memory)[unseen] < prices_of_walls(young.memory)[unseen]).all()
    assert np.isinf(prices_of_walls(walled(12, map_memory=0).memory)).all()


@given(knowns, st.integers(1, 4))
@steady
def test_what_is_in_sight_is_summed_up(known, reach):
    worth = (known < 0) * 0.5
    sums = worth_around(worth, reach)
    for row, col in np.ndindex(known.shape):
        window = worth[max(row - reach, 0):row + reach + 1, max(col - reach, 0):col + reach + 1]
        assert np.isclose(sums[row, col], window.sum())


@given(knowns, st.integers(1, 5), st.integers(0, 2**32))
@steady
def test_what_is_in_view_is_what_is_seen_where_the_map_is_true(known, reach, seed):
    worth = np.random.default_rng(seed).integers(0, 3, known.shape).astype(float)
    sums = worth_in_view(worth, known, reach)
    truth = np.pad(np.where(known == 100, 100, 0), reach, constant_values=100).astype(np.int8)
    for row, col in np.argwhere(known != 100).tolist():
        window = truth[row:row + 2 * reach + 1, col:col + 2 * reach + 1]
        shown = visible_cells(window, rays_within(reach if reach > 1 else 0)) >= 0
        valued = np.pad(worth, reach)[row:row + 2 * reach + 1, col:col + 2 * reach + 1]
        assert np.isclose(sums[row, col], valued[shown].sum())


@given(relearner(low=4), st.booleans())
@few
def test_an_exploration_field_leads_home_wherever_there_is_a_way(learnt_bag, prefer_shorter):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, prefer_shorter=prefer_shorter)
    field = exploration_field(learner.memory, learner.refresh.field)
    headings = headings_from_vectors(field.vx, field.vy)
    away = learner.refresh.composition.reachable & (learner.memory.known == 0)
    away[field.goal] = False
    assert (headings[away] >= 0).all()


def test_a_shortcut_is_found_from_chosen_starts_and_the_shown_way_is_kept():
    learner = walled()
    explore(learner, ONE_GAP, 10, spread=True)
    explore(learner, TWO_GAPS, 6, spread=True)
    assert learner.memory.known[4, 13] == 0
    lengths = GridWorld(TWO_GAPS, learner.parameters).flow_lengths(learner.refresh.field)
    assert learner.refresh.certificate.fidelity == 1.0
    assert lengths[START] > 20.0
    # Who was not shown anything takes the shorter way, and keeps off the shown one.
    assert lengths[0, 14] < 15.0


def test_a_shortcut_is_taken_from_fixed_starts_where_shorter_ways_are_preferred():
    learner = walled(prefer_shorter=True)
    explore(learner, ONE_GAP, 10, spread=False)
    steps = explore(learner, TWO_GAPS, 10, spread=False)
    assert steps[-1] <= 8
    kept = walled()
    explore(kept, ONE_GAP, 10, spread=False)
    assert explore(kept, TWO_GAPS, 10, spread=False)[-1] > 20


def test_looking_costs_little_where_nothing_changes():
    learner = walled(prefer_shorter=True)
    steps = explore(learner, ONE_GAP, 30, spread=False)
    assert np.mean(steps) <= 1.25 * min(steps)


def n_seen(seed, n=6):
    """Return how many cells n trials from chosen starts have shown in a world full of rooms."""
    rng = np.random.default_rng(seed)
    occupancy = rooms_world(24, rng, 3)
    goal, start = choose_places(occupancy, rng)
    world = GridWorld(occupancy, Parameters())
    learner = Learner(Grid(24, 24, 1.0), Parameters())
    learner.add_demonstration(demonstrate(world, 'shortest', start, goal, rng, 1))
    for number in range(n):
        field = learner.trial_field(True)
        starts = learner.next_starts(50, rng, field)
        practise(learner, occupancy, [next(cell for cell in starts if occupancy[cell] == 0)],
                 10 + number, exploring=True)
    return int((learner.memory.known >= 0).sum())


def test_a_trial_goes_on_looking_around_where_the_way_is_not_free_as_planned(monkeypatch):
    seeds = range(4)
    seen = [n_seen(seed) for seed in seeds]
    monkeypatch.setattr(policy, 'prices_in_q', lambda q, cost, otherwise, discount: otherwise)
    assert sum(seen) > 1.05 * sum(n_seen(seed) for seed in seeds)
