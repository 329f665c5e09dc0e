from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW, UNIT
from control_field.kernels import compiled, decision
from control_field.kernels.interpolation import Sums
from control_field.kernels.last_resort import is_shut_off, new_flood
from control_field.kernels.steps import allowed_steps, no_preference
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import ControlField, Outcome
from control_field.robot.policy import ground_of, rules_of, trial_on, TrialPolicy
from strategies import few, knowns, occupancies, seeds, steady

PARAMETERS = Parameters()


def field_on(known, goal, parameters=PARAMETERS):
    """Return the field of the best ways on a remembered map, whatever is true."""
    ground, none = ground_of(known, parameters), no_preference(known.shape)
    cost = compiled.cost_to_go(ground, goal, none)
    headings = compiled.attraction_from_cost(ground, cost, Sums.none(known.shape))
    vx, vy = (np.where(headings >= 0, UNIT[headings, axis], 0.0) for axis in (0, 1))
    return ControlField(
        grid=Grid(*known.shape, 1.0), revision=1, goal=goal, vx=vx.astype(np.float32),
        vy=vy.astype(np.float32), coherence=np.hypot(vx, vy).astype(np.float32),
        q=compiled.q_from_cost(ground, cost, none, 0.98).astype(np.float32), known=known.copy(),
        flags=np.zeros(known.shape, np.uint8))


@given(occupancies(low=2), st.data(), seeds)
@steady
def test_whatever_the_map_claims_a_trial_gives_up_only_where_there_is_no_way(truth, data, seed):
    free = np.argwhere(truth == 0).tolist() or [[0, 0]]
    truth[tuple(free[0])] = 0
    goal, start = (tuple(data.draw(st.sampled_from(free))) for _ in range(2))
    claimed = np.random.default_rng(seed).choice(np.array([0, 100, 100, -1, 50], np.int8),
                                                 truth.shape)
    world = GridWorld(truth, PARAMETERS)
    trial, _ = world.trial(field_on(claimed, goal), start, seed)
    expected = Outcome.GOAL if np.isfinite(world.cost_to(goal)[start]) else Outcome.GAVE_UP
    assert trial.outcome == expected
    for row in trial.decisions:
        here, ahead = (row['row'], row['col']), (row['next_row'], row['next_col'])
        assert here == ahead or truth[ahead] == 0


@given(knowns, seeds)
@few
def test_no_step_is_ever_against_what_is_seen_now(known, seed):
    rng = np.random.default_rng(seed)
    row, col = (int(rng.integers(n)) for n in known.shape)
    goal = tuple(int(rng.integers(n)) for n in known.shape)
    trial = trial_on(field_on(known, goal), known.copy(), PARAMETERS)
    blocked = int(rng.integers(256))
    options = decision.Options(True, 6.0, 2.0, 4, 400, 0.5, 0.98, True)
    heading = compiled.decide(row, col, blocked, 0, trial, options, rng).heading
    assert heading < 0 or not blocked >> heading & 1
    assert heading < 0 or allowed_steps(
        trial.ground.known, row, col, rules_of(PARAMETERS)) >> heading & 1


@given(knowns, seeds, st.integers(1, 5))
@few
def test_a_search_in_pieces_ends_as_one_in_one_piece_does(known, seed, n_cells):
    rng = np.random.default_rng(seed)
    row, col = (int(rng.integers(n)) for n in known.shape)
    goal = tuple(int(rng.integers(n)) for n in known.shape)
    ground = ground_of(known, PARAMETERS)
    pieces, whole = new_flood(known.shape), new_flood(known.shape)
    expected = is_shut_off(ground, whole, row, col, goal, 10_000)
    known[row, col] = 0
    cost = compiled.cost_to_go(ground, goal, no_preference(known.shape))
    assert expected == (not np.isfinite(cost[row, col]) and (row, col) != goal)
    found = False
    for _ in range(known.size + 1):
        found = is_shut_off(ground, pieces, row, col, goal, n_cells)
        if found or pieces.ends[1] == 0:
            break
    assert found == expected


def shut_policy(**values):
    """Return a policy in a corridor that is remembered as walled off, and a row below it."""
    known = np.zeros((3, 6), np.int8)
    known[:, 3] = 100
    parameters = Parameters(**values)
    return TrialPolicy(field_on(known, (0, 5), parameters), parameters,
                       np.random.default_rng(0), 1)


def test_the_robot_says_what_it_doubts_and_what_it_has_seen():
    policy = shut_policy()
    assert policy.doubt == ''
    heading = policy.decide(1, 1, 0, 0, 0.0).heading
    assert STEP_COL[heading] == 1
    assert '3 walls' in policy.doubt
    choice = policy.decide(1, 2, 0b10000011, 0, 0.0)  # all three are there
    assert choice.heading == -1
    assert 'no way' in choice.reason
    assert '3 doubted walls' in choice.reason


def test_a_wall_that_has_gone_is_gone_through():
    policy = shut_policy()
    policy.decide(1, 1, 0, 0, 0.0)
    heading = policy.decide(1, 2, 0b10000010, 0, 0.0).heading
    assert (STEP_ROW[heading], STEP_COL[heading]) == (0, 1)
    assert policy.state.ground.factor[1, 3] == 1.0


def test_what_is_doubted_already_is_looked_at_before_what_was_certain():
    known = np.zeros((3, 6), np.int8)
    known[:, 3] = 100
    known[2, 3] = 30
    field = field_on(known, (0, 5))
    policy = TrialPolicy(replace(field, vx=0 * field.vx, vy=0 * field.vy), PARAMETERS,
                         np.random.default_rng(0), 1)
    assert STEP_ROW[policy.decide(1, 2, 0b10000001, 0b10, 0.0).heading] == 1
    assert policy.doubt == ''


def test_without_map_memory_the_map_is_believed():
    policy = shut_policy(map_memory=0)
    choice = policy.decide(1, 1, 0, 0, 0.0)
    assert choice.heading == -1
    assert 'on the remembered map' in choice.reason
    assert policy.doubt == ''


@pytest.mark.parametrize('opened', [True, False])
def test_far_sight_settles_what_was_doubted(opened):
    policy = shut_policy()
    policy.decide(1, 1, 0, 0, 0.0)
    around = np.full((5, 5), -1, np.int8)
    around[1:4, 4] = 0 if opened else 100
    policy.observe(1, 1, around)
    assert (policy.state.ground.known[:, 3] == (0 if opened else 100)).all()
    assert (policy.state.ground.factor[:, 3] == 1.0).all()
    assert (policy.decide(1, 1, 0, 0, 0.0).heading >= 0) == opened
