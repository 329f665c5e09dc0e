from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from control_field.learning.starts import best_cells, information_gain
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import rules_of
from strategies import few, practise, relearner, segment, steady, taught

WALLED = np.zeros((9, 9), np.int8)
WALLED[4, 1:8] = 100
SHOWN = segment((1, 1), (1, 7), (2, 8))


@given(st.lists(st.integers(0, 3), min_size=6, max_size=6), st.integers(0, 8))
@steady
def test_the_best_cells_come_first_and_worthless_ones_never(values, n):
    value = np.array(values, float).reshape(2, 3)
    cells = best_cells(value, n)
    found = [value[cell] for cell in cells]
    assert len(cells) == min(n, np.count_nonzero(value))
    assert found == sorted(value[value > 0.0].tolist(), reverse=True)[:n]


@given(relearner(low=4), st.integers(0, 20), st.sampled_from(['paper', 'full']), st.booleans())
@few
def test_starts_are_cells_of_the_workspace_and_not_known_to_be_walls(
        learnt_bag, n, profile, exploring):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, profile=profile)
    driven = learner.trial_field(exploring)
    starts = learner.next_starts(n, np.random.default_rng(0), driven)
    assert len(starts) <= n
    field = learner.refresh.field
    for start in starts:
        assert field.grid.contains(*start)
        assert field.known[start] != 100
        assert start != field.goal
        assert learner.refresh.composition.reachable[start]
    assert starts == learner.next_starts(n, np.random.default_rng(0), driven)


def test_no_start_is_proposed_twice_and_none_is_left_out():
    learner = taught(SHOWN, WALLED.shape, WALLED)
    field = learner.refresh.field
    starts = learner.next_starts(99, np.random.default_rng(0))
    assert len(starts) == len(set(starts))
    free = (field.known == 0) & learner.refresh.composition.reachable
    assert {tuple(cell) for cell in np.argwhere(free).tolist()} - {field.goal} <= set(starts)
    assert len(learner.next_starts(20, np.random.default_rng(0))) == 20


def test_the_first_start_shows_more_than_a_start_on_known_ground():
    learner = taught(SHOWN, WALLED.shape, WALLED)
    start = learner.next_starts(1, np.random.default_rng(0))[0]
    before = (learner.memory.known >= 0).sum()
    practise(learner, np.zeros_like(WALLED), [start])
    assert (learner.memory.known >= 0).sum() > before
    again = taught(SHOWN, WALLED.shape, WALLED)
    practise(again, WALLED, [(1, 1)])
    assert (again.memory.known >= 0).sum() == before


def test_chosen_starts_see_the_workspace_in_few_trials():
    learner, rng = taught(SHOWN, WALLED.shape, WALLED), np.random.default_rng(0)
    for number in range(2, 12):
        field = learner.trial_field(True)
        free = [s for s in learner.next_starts(50, rng, field) if WALLED[s] == 0]
        practise(learner, WALLED, free[:1], number, exploring=True)
    reachable = learner.refresh.composition.reachable
    assert (learner.memory.known[reachable] >= 0).mean() > 0.9


def test_a_start_promises_the_unseen_ground_along_its_flow_weighed_by_who_depends_on_it():
    corridor = np.zeros((1, 5), np.int8)
    # Demonstrated without local grid: all that is known is the path itself.
    field = taught(segment((0, 0), (0, 4)), (1, 5)).refresh.field
    known = np.full((1, 5), -1, np.int8)
    unseen = ControlField(field.grid, 1, field.goal, field.vx, field.vy, field.coherence, field.q,
                          known, field.flags)
    worth, rules = np.ones((1, 5)), rules_of(Parameters())
    value = information_gain(unseen, unseen, worth, rules)
    crossing = np.sqrt(np.arange(1.0, 6.0))
    assert np.allclose(value[0], [crossing.sum(), crossing.sum(), *(
        crossing[k:].sum() for k in (1, 2, 3))])
    seen = ControlField(field.grid, 1, field.goal, field.vx, field.vy, field.coherence, field.q,
                        corridor, field.flags)
    assert not information_gain(seen, seen, np.zeros((1, 5)), rules).any()
    # What was seen before counts by everybody who crosses it.
    assert information_gain(seen, seen, worth, rules)[0, 0] == 15.0


def test_an_exploration_field_still_leads_home_and_past_unseen_ground():
    learner = taught(SHOWN, WALLED.shape, WALLED)
    exploring = learner.trial_field(True)
    for field in (exploring, learner.refresh.field):
        assert field.goal == (2, 8)
        assert np.array_equal(field.known, learner.memory.known)
    assert not np.array_equal(exploring.vx, learner.refresh.field.vx)


def test_teach_here_names_sinks_first():
    learner = taught(SHOWN, WALLED.shape, WALLED, profile='paper')
    practise(learner, WALLED, [(8, 4)])
    sinks = set(map(tuple, learner.refresh.certificate.sinks.tolist()))
    places = learner.teach_here(len(sinks) + 3)
    assert sinks
    assert set(places[:len(sinks)]) == sinks
