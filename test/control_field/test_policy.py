import dataclasses

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW, UNIT
from control_field.kernels.decision import backup, Transition
from control_field.kernels.steps import StepRules
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import ControlField, DECISION_DTYPE, Kind
from control_field.robot.policy import caution_factor, cost_from_q, TrialPolicy
from oracles import turn_between
from strategies import few, relearner, seeds, steady, taught

EAST, NORTH_EAST, NORTH, WEST, SOUTH = 0, 1, 2, 4, 6
AROUND = 0xFF


def field_of(shape=(5, 5), goal=(2, 4), heading=EAST, q=None, known=-1):
    values = np.zeros((*shape, 8)) if q is None else q
    return ControlField(
        Grid(*shape, 1.0), 3, goal, np.full(shape, UNIT[heading, 0], np.float32),
        np.full(shape, UNIT[heading, 1], np.float32), np.ones(shape, np.float32),
        values.astype(np.float32), np.full(shape, known, np.int8), np.zeros(shape, np.uint8))


def policy_of(field=None, trial=5, seed=0, **values):
    parameters = Parameters(**{'profile': 'paper', **values})
    return TrialPolicy(field or field_of(), parameters, np.random.default_rng(seed), trial)


def test_a_free_course_is_followed_and_earns_nothing():
    choice = policy_of().decide(2, 1, 0, 0, 7.5)
    assert (choice.heading, choice.kind, choice.reason) == (EAST, Kind.FIELD, '')
    row = choice.decisions[0]
    assert len(choice.decisions) == 1
    expected = {'stamp': 7.5, 'trial': 5, 'step': 0, 'revision': 3, 'row': 2, 'col': 1,
                'next_row': 2, 'next_col': 2, 'action': EAST, 'reward': 0, 'kind': Kind.FIELD,
                'blocked': 0, 'unknown': 0}
    assert {name: row[name] for name in DECISION_DTYPE.names} == expected


def test_unseen_ground_counts_as_longer_by_caution():
    known = np.array([[-1, 0, 100]], np.int8)
    assert caution_factor(known, Parameters(caution=0.5)).tolist() == [[1.5, 1.0, 1.0]]


def test_a_refreshed_field_tells_of_the_map_what_this_trial_has_not_seen_itself():
    policy = policy_of()
    policy.decide(2, 1, 0, 0, 0.0)
    walled = np.full((5, 5), -1, np.int8)
    walled[2, 2], walled[2, 3] = 100, 100
    refreshed = field_of()
    policy.replace_field(dataclasses.replace(refreshed, known=walled))
    assert policy.allowed(2, 1) & 1 << EAST  # it has seen that cell free
    assert not policy.allowed(2, 2) & 1 << EAST


def test_a_blocked_course_earns_minus_one_and_its_avoidance_plus_one():
    policy = policy_of(learning_rate=0.5)
    choice = policy.decide(2, 1, 1 << EAST, 0, 0.0)
    occupied, chosen = choice.decisions
    assert (occupied['kind'], occupied['action'], occupied['reward']) == (Kind.BLOCKED, EAST, -1)
    assert (occupied['next_row'], occupied['next_col']) == (2, 1)
    assert (chosen['kind'], chosen['reward']) == (Kind.AVOID, 1)
    assert choice.heading == chosen['action'] == NORTH  # diagonals are occupied by the corner
    assert policy.n_reinforcements == policy.n_decisions == 2
    assert policy.n_steps == 1


def test_an_avoidance_pays_once_a_cell_and_course_and_a_block_costs_every_time():
    policy = policy_of()
    rewards = [policy.decide(2, 1, 1 << EAST, 0, 0.0).decisions['reward'].tolist()
               for _ in range(3)]
    assert rewards == [[-1, 1], [-1, 0], [-1, 0]]
    assert policy.decide(3, 1, 1 << EAST, 0, 0.0).decisions['reward'].tolist() == [-1, 1]


def test_the_free_action_of_next_highest_Q_is_taken():
    q = np.zeros((5, 5, 8))
    q[2, 1, [EAST, NORTH, WEST]] = 0.9, 0.2, 0.6
    policy = policy_of(field_of(q=q), learning_rate=0.0)
    assert policy.decide(2, 1, 1 << EAST, 0, 0.0).heading == WEST
    assert policy.decide(2, 1, 1 << EAST | 1 << WEST, 0, 0.0).heading == NORTH


def test_the_whole_effective_window_has_a_say():
    q = np.zeros((5, 5, 8))
    q[4, 1, 6] = 0.9
    near, far = (policy_of(field_of(q=q), learning_rate=0.0, effective_window=window)
                 for window in (1.0, 3.0))
    assert near.decide(2, 1, 1 << EAST, 0, 0.0).heading == NORTH
    assert far.decide(2, 1, 1 << EAST, 0, 0.0).heading == 6


def test_ties_go_to_what_is_nearest_the_course_then_to_what_was_chosen_least():
    policy = policy_of(corner_cutting=True, learning_rate=0.0)
    assert policy.decide(2, 1, 1 << EAST, 0, 0.0).heading == NORTH_EAST
    assert policy.decide(2, 1, 1 << EAST, 0, 0.0).heading == 7


def test_of_equals_the_cell_is_taken_that_was_entered_less():
    policy = policy_of(learning_rate=0.0)
    policy.decide(3, 1, 0, 0, 0.0)
    assert policy.decide(2, 1, 1 << EAST, 0, 0.0).heading == SOUTH


def test_a_flow_that_is_known_to_fail_further_on_is_left_before_it_does():
    known = np.zeros((5, 5), np.int8)
    known[1:4, 2] = 100
    field = dataclasses.replace(field_of(), known=known)
    full, paper = (policy_of(field, profile=profile) for profile in ('full', 'paper'))
    choice = full.decide(2, 0, 0, 0, 0.0)
    assert choice.kind == Kind.DETOUR
    assert choice.heading in (NORTH_EAST, 7)
    assert full.n_reinforcements == 0
    follows = paper.decide(2, 0, 0, 0, 0.0)
    assert (follows.kind, follows.heading) == (Kind.FIELD, EAST)


def test_equation_6_looks_ahead_over_the_steps_that_the_map_allows():
    known = np.array([[0, 0, 100]], np.int8)
    q = np.zeros((1, 3, 8))
    q[0, 1, EAST], q[0, 1, WEST] = 5.0, -0.5
    backup(q, known, Transition(0, 0, EAST, 0, 1, -1.0), 0.5, 0.9, StepRules(False, False, 8))
    assert q[0, 0, EAST] == pytest.approx(0.5 * (-1.0 + 0.9 * -0.5))


@given(seeds, st.integers(0, 255))
@steady
def test_the_choice_is_free_and_never_worse_in_Q_or_turn(seed, blocked):
    q = np.random.default_rng(seed).choice([0.0, 0.5, -1.0], (5, 5, 8))
    blocked |= 1 << EAST
    policy = policy_of(field_of(q=q), effective_window=1.0, learning_rate=0.0,
                       corner_cutting=True)
    choice = policy.decide(2, 1, blocked, 0, 0.0)
    free = [h for h in range(8) if not blocked >> h & 1]
    if not free:
        assert choice.heading == -1
        return
    weights = {(0, 0): 4.0, (0, 1): 1.0, (1, 0): 1.0, (0, -1): 1.0, (-1, 0): 1.0}
    values = sum(w * field_of(q=q).q[2 + dr, 1 + dc].astype(float)
                 for (dr, dc), w in weights.items())
    best = max((round(values[h], 9), -turn_between(h, EAST)) for h in free)
    assert (round(values[choice.heading], 9), -turn_between(choice.heading, EAST)) == best


def test_corners_are_cut_only_by_a_point():
    field = field_of(heading=NORTH_EAST)
    body, point = policy_of(field), policy_of(field, corner_cutting=True)
    assert body.decide(2, 1, 1 << EAST, 0, 0.0).decisions['kind'].tolist() == [
        Kind.BLOCKED, Kind.AVOID]
    assert point.decide(2, 1, 1 << EAST, 0, 0.0).heading == NORTH_EAST


def test_four_moves_leave_the_diagonals_out():
    policy = policy_of(field_of(heading=NORTH_EAST), moves=4)
    choice = policy.decide(2, 1, 0, 0, 0.0)
    assert choice.heading % 2 == 0
    assert choice.kind == Kind.AVOID
    assert policy.allowed(2, 1) == 0b01010101


def test_unknown_ground_is_free_or_blocked_as_the_parameter_says():
    for keep_out in (False, True):
        policy = policy_of(unknown_is_blocked=keep_out)
        choice = policy.decide(2, 1, 0, 1 << EAST, 0.0)
        assert choice.kind == (Kind.AVOID if keep_out else Kind.FIELD)
        assert (choice.heading == EAST) == (not keep_out)


@pytest.mark.parametrize('profile', ['paper', 'full'])
@given(seeds, st.integers(0, 255))
@steady
def test_what_was_free_once_and_is_unknown_now_is_kept_out_of_where_unknown_is_blocked(
        profile, seed, unknown):
    policy = policy_of(field_of(known=0), seed=seed, profile=profile, unknown_is_blocked=True)
    choice = policy.decide(2, 1, 0, unknown, 0.0)
    assert choice.heading < 0 or not unknown >> choice.heading & 1
    if not unknown & 1 << EAST:
        assert choice.heading == EAST


def test_an_oscillation_turns_into_exploration_by_counts():
    policy = policy_of(oscillation_limit=2)
    choices = [policy.decide(2, 1, 0, 0, 0.0) for _ in range(10)]
    assert [choice.kind for choice in choices] == [Kind.FIELD] * 2 + [Kind.EXPLORE] * 8
    headings = [choice.heading for choice in choices]
    assert sorted(headings[2:9]) == [1, 2, 3, 4, 5, 6, 7]  # each of the others before any again
    assert all(choice.decisions['reward'].tolist() == [0] for choice in choices)


def test_exploration_is_random_but_the_same_for_the_same_seed():
    def walk(seed):
        policy = policy_of(oscillation_limit=1, seed=seed)
        return [policy.decide(2, 1, 0, 0, 0.0).heading for _ in range(8)]
    assert walk(3) == walk(3)
    assert len({tuple(walk(seed)) for seed in range(5)}) > 1


def test_a_cell_walled_in_is_given_up_with_a_reason():
    policy = policy_of()
    choice = policy.decide(2, 1, AROUND, 0, 0.0)
    assert choice.heading == -1
    assert 'no way' in choice.reason
    assert choice.decisions['kind'].tolist() == [Kind.BLOCKED]
    assert policy.n_steps == 0


def test_the_step_limit_is_a_reason_to_give_up():
    policy = policy_of(step_limit=2)
    assert policy.decide(2, 1, 0, 0, 0.0).heading == EAST
    assert len(policy.taught(2, 2, EAST, 0, 0, 0.0)) == 1
    choice = policy.decide(2, 3, 0, 0, 0.0)
    assert choice.heading == -1
    assert 'step limit of 2' in choice.reason
    assert len(choice.decisions) == 0


def test_a_cell_outside_is_refused():
    with pytest.raises(ValueError, match=r'cell \(5, 0\) lies outside'):
        policy_of().decide(5, 0, 0, 0, 0.0)


def test_a_step_that_a_person_drove_is_noted_and_seen_from():
    policy = policy_of()
    row = policy.taught(2, 1, NORTH, 1 << EAST, 0, 4.0)[0]
    assert (row['kind'], row['action'], row['reward'], row['next_row']) == (
        Kind.TAUGHT, NORTH, 0, 3)
    assert not policy.allowed(2, 1) >> EAST & 1
    assert (policy.n_steps, policy.n_reinforcements) == (1, 0)


def test_a_field_replaced_under_way_keeps_what_was_seen():
    policy = policy_of()
    policy.decide(2, 1, 1 << EAST, 0, 0.0)
    fresh = field_of(heading=NORTH, known=0)
    policy.replace_field(fresh)
    assert not policy.allowed(2, 1) >> EAST & 1
    assert policy.decide(1, 1, 0, 0, 0.0).heading == NORTH
    assert policy.n_steps == 2
    assert policy.at_goal(2, 4)
    assert not policy.at_goal(2, 3)
    with pytest.raises(ValueError, match='do not share their cells'):
        policy.replace_field(dataclasses.replace(fresh, grid=Grid(5, 5, 0.9)))


def test_what_was_seen_and_done_keeps_its_place_where_a_workspace_grows():
    policy = policy_of()
    policy.decide(2, 1, 1 << EAST, 0, 0.0)
    before = policy.state
    larger = dataclasses.replace(
        field_of(shape=(8, 9), goal=(4, 7)), grid=Grid(8, 9, 1.0, -3.0, -2.0))
    policy.replace_field(larger)
    part, state = np.s_[2:7, 3:8], policy.state
    for old, new in ((before.ground.known, state.ground.known), (before.seen, state.seen),
                     (before.counts, state.counts), (before.entered, state.entered),
                     (before.punished, state.punished)):
        assert (new[part] == old).all()
        assert new.shape[:2] == (8, 9)
        assert new.astype(float).sum() == old.astype(float).sum() - (
            47.0 if old is before.ground.known else 0.0)
    assert not policy.allowed(4, 4) >> EAST & 1
    assert policy.at_goal(4, 7)


def test_a_field_without_a_course_is_no_reinforcement():
    still = field_of()
    empty = ControlField(still.grid, 3, still.goal, 0 * still.vx, 0 * still.vy,
                         0 * still.coherence, still.q, still.known, still.flags)
    choice = policy_of(empty).decide(2, 1, 0, 0, 0.0)
    assert choice.kind == Kind.AVOID
    assert choice.decisions['reward'].tolist() == [0]


@given(relearner(blind=True), seeds)
@few
def test_circling_at_a_wall_never_pays(learnt_bag, seed):
    occupancy, cells = learnt_bag
    if occupancy[cells[0]]:
        return
    for profile in ('paper', 'full'):
        learner = taught(cells, occupancy.shape, profile=profile, step_limit=300)
        world = GridWorld(occupancy, learner.parameters)
        trial, _ = world.trial(learner.refresh.field, cells[0], seed % 1000)
        rewards = trial.decisions['reward'].astype(int)
        assert rewards.sum() <= 0
        assert (np.cumsum(rewards) <= 0).all()


def test_circling_at_a_wall_on_purpose_never_pays():
    policy = policy_of(field_of(heading=EAST), learning_rate=1.0, discount=0.9)
    total, q = 0, policy.state.q
    for _ in range(50):
        for row, col in ((1, 2), (2, 2), (3, 2), (3, 1), (2, 1), (1, 1)):
            blocked = 1 << EAST if col == 2 else 0
            total += int(policy.decide(row, col, blocked, 0, 0.0).decisions['reward'].sum())
    assert total <= -100
    assert q.max() <= 1.0 / (1.0 - 0.9)
    assert (q[1:4, 2, EAST] < 0.0).all()


@given(relearner(blind=True), seeds, st.booleans())
@few
def test_the_robot_decides_what_the_simulation_decides(learnt_bag, seed, full):
    occupancy, cells = learnt_bag
    if occupancy[cells[0]]:
        return
    learner = taught(cells, occupancy.shape, profile='full' if full else 'paper', step_limit=200)
    field, parameters = learner.refresh.field, learner.parameters
    world = GridWorld(occupancy, parameters)
    trial, _ = world.trial(field, cells[0], seed % 1000, 4)
    policy = TrialPolicy(field, parameters, np.random.default_rng(seed % 1000), 4)
    (row, col), tables = cells[0], []
    while not policy.at_goal(row, col):
        choice = policy.decide(row, col, world.local_grid(row, col), 0, float(policy.n_steps))
        tables.append(choice.decisions)
        if choice.heading < 0:
            break
        row, col = row + int(STEP_ROW[choice.heading]), col + int(STEP_COL[choice.heading])
    rows = np.concatenate([np.zeros(0, DECISION_DTYPE), *tables])
    assert rows.tobytes() == trial.decisions.tobytes()


@given(st.floats(0.5, 0.9999), seeds)
@steady
def test_the_cost_is_read_back_from_Q(discount, seed):
    cost = np.random.default_rng(seed).uniform(0.0, 100.0, (3, 4))
    q = np.zeros((3, 4, 8))
    q[:, :, 3] = discount ** cost
    q[:, :, 5] = -1.0
    assert np.allclose(cost_from_q(q, discount), cost, atol=1e-6)
    assert np.isinf(cost_from_q(np.zeros((1, 1, 8)), discount)).all()
    assert np.isinf(cost_from_q(np.full((1, 1, 8), -1.0), discount)).all()


@given(relearner(blind=True), seeds)
@few
def test_the_learner_arrives_at_the_Q_matrix_the_robot_had(learnt_bag, seed):
    occupancy, cells = learnt_bag
    if occupancy[cells[0]]:
        return
    learner = taught(cells, occupancy.shape, profile='paper', discount=0.0, step_limit=100)
    world = GridWorld(occupancy, learner.parameters)
    policy = TrialPolicy(learner.refresh.field, learner.parameters,
                         np.random.default_rng(seed), 4)
    (row, col), tables = cells[0], [np.zeros(0, DECISION_DTYPE)]
    while not policy.at_goal(row, col):
        choice = policy.decide(row, col, world.local_grid(row, col), 0, 0.0)
        tables.append(choice.decisions)
        if choice.heading < 0:
            break
        row, col = row + int(STEP_ROW[choice.heading]), col + int(STEP_COL[choice.heading])
    learner.memory._apply_online(np.concatenate(tables))
    assert np.allclose(learner.memory.q, policy.state.q, atol=1e-6)
