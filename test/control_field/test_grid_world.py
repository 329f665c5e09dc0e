from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.headings import STEP_LENGTH
from control_field.kernels.steps import allowed_steps
from control_field.learning import grid_world as simulation
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import Kind, Outcome
from strategies import few, practise, relearner, seeds, segment, steady, taught


def world_of(learnt_bag, **values):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, step_limit=400, **values)
    return learner, GridWorld(occupancy, learner.parameters), cells[-1]


@given(relearner(blind=True), seeds)
@few
def test_no_trial_ever_collides(learnt_bag, seed):
    for profile in ('paper', 'full'):
        learner, world, _ = world_of(learnt_bag, profile=profile)
        for _ in range(2):
            starts = np.argwhere(world.truth == 0)
            runs = world.trials(learner.refresh.field, starts, seed % 1000)
            assert (runs.outcome != 1).all()
            practise(learner, world.truth, [starts[seed % len(starts)]])


@given(relearner(blind=True), seeds)
@few
def test_the_goal_is_reached_from_wherever_there_is_a_way(learnt_bag, seed):
    learner, world, goal = world_of(learnt_bag)
    cost = world.cost_to(goal)
    starts = np.argwhere(world.truth == 0)
    for _ in range(2):
        runs = world.trials(learner.refresh.field, starts, seed % 1000)
        reachable = np.isfinite(cost[tuple(starts.T)])
        assert ((runs.outcome == 0) == reachable).all()
        assert (runs.length >= cost[tuple(starts.T)] - 1e-9)[reachable].all()
        practise(learner, world.truth, [starts[seed % len(starts)]])


@given(relearner(blind=True), seeds)
@few
def test_every_step_of_a_trial_is_one_the_world_allows(learnt_bag, seed):
    learner, world, goal = world_of(learnt_bag, profile='paper')
    start = tuple(np.argwhere(world.truth == 0)[0].tolist())
    trial, length = world.trial(learner.refresh.field, start, seed % 1000, 8)
    rows = trial.decisions
    moved = rows[rows['kind'] != Kind.BLOCKED]
    assert trial.episode == 8
    assert (rows['trial'] == 8).all()
    for row in rows:
        allowed = allowed_steps(world.truth, int(row['row']), int(row['col']), world.rules)
        assert bool(allowed >> int(row['action']) & 1) == (row['kind'] != Kind.BLOCKED)
        assert row['blocked'] == world.local_grid(row['row'], row['col'])
    assert (moved['next_row'][:-1] == moved['row'][1:]).all()
    assert (moved['next_col'][:-1] == moved['col'][1:]).all()
    assert length == pytest.approx(STEP_LENGTH[moved['action']].sum())
    if trial.outcome == 'goal' and len(moved):
        assert (moved['next_row'][-1], moved['next_col'][-1]) == goal


@given(relearner(blind=True), seeds, st.booleans())
@few
def test_many_trials_end_as_each_would_by_itself(learnt_bag, seed, keep_out):
    learner, world, _ = world_of(learnt_bag, unknown_is_blocked=keep_out)
    starts, seed = np.argwhere(world.truth == 0), seed % 1000
    runs = world.trials(learner.refresh.field, starts, seed)
    for index, start in enumerate(starts.tolist()):
        trial, length = world.trial(learner.refresh.field, tuple(start), seed + index)
        assert ('goal', 'collision', 'gave_up')[runs.outcome[index]] == trial.outcome
        assert runs.n_steps[index] == trial.n_steps
        assert runs.n_reinforcements[index] == trial.n_online_reinforcements
        assert runs.length[index] == pytest.approx(length)


def test_who_keeps_out_of_the_unknown_still_finds_a_way_over_ground_never_seen():
    occupancy = np.zeros((11, 12), np.int8)
    occupancy[3:8, 6] = 100
    learner, world, _ = world_of((occupancy, segment((5, 1), (5, 10))), unknown_is_blocked=True)
    trial, _ = world.trial(learner.refresh.field, (5, 1), 0)
    assert trial.outcome is Outcome.GOAL
    learner.add_trial(trial)
    assert learner.refresh.certificate.basin == 1.0


@given(relearner())
@steady
def test_a_trial_changes_nothing_but_its_own(learnt_bag):
    learner, world, _ = world_of(learnt_bag, profile='paper')
    field = learner.refresh.field
    before = field.q.tobytes(), field.known.tobytes(), world.truth.tobytes()
    start = tuple(np.argwhere(world.truth == 0)[-1].tolist())
    first, second = (world.trial(field, start, 5)[0].decisions.tobytes() for _ in range(2))
    assert first == second
    assert (field.q.tobytes(), field.known.tobytes(), world.truth.tobytes()) == before


def test_a_start_in_a_wall_is_refused():
    world = GridWorld(np.array([[0, 0, 100]], np.int8), Parameters())
    with pytest.raises(ValueError, match=r'start \(0, 2\) is blocked'):
        world.trial(taught(segment((0, 0), (0, 1)), (1, 3)).refresh.field, (0, 2), 0)


def test_a_start_at_the_goal_is_a_trial_of_no_steps():
    learner = taught(segment((0, 0), (0, 2)), (1, 3))
    trial, length = GridWorld(np.zeros((1, 3), np.int8), learner.parameters).trial(
        learner.refresh.field, (0, 2), 0)
    assert (trial.outcome, trial.n_steps, length) == ('goal', 0, 0.0)
    assert learner.add_trial(trial).reinforcements == 0


def test_a_huge_step_limit_costs_no_memory_and_a_long_log_is_whole(monkeypatch):
    world = np.zeros((6, 6), np.int8)
    world[2, :5] = world[3, 4] = 100
    learner = taught(segment((0, 0), (5, 0)), (6, 6), profile='paper', step_limit=10_000_000)
    field = learner.refresh.field
    whole, _ = GridWorld(world, learner.parameters).trial(field, (0, 0), 1)
    monkeypatch.setattr(simulation, '_FIRST_ROWS', 4)
    grown, _ = GridWorld(world, learner.parameters).trial(field, (0, 0), 1)
    assert len(whole.decisions) > 4
    assert grown.decisions.tobytes() == whole.decisions.tobytes()


def test_the_step_limit_ends_a_trial():
    world = np.zeros((3, 9), np.int8)
    world[:, 4] = 100
    learner = taught(segment((1, 0), (1, 8)), (3, 9), profile='paper', step_limit=30)
    trial, _ = GridWorld(world, learner.parameters).trial(learner.refresh.field, (1, 0), 0)
    assert (trial.outcome, trial.n_steps) == ('gave_up', 30)


@pytest.mark.parametrize('sight', [1, 2, 4, 63])
def test_a_sight_that_no_local_grid_has_is_refused(sight):
    with pytest.raises(ValueError, match='odd number of cells'):
        GridWorld(np.zeros((5, 5), np.int8), Parameters(), sight)
