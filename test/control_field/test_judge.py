"""What becomes of trials from all cells is what becomes of each that is run alone."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.judge import Judge
from control_field.parameters import Parameters
from experience_evaluation.changing_worlds import moved_obstacles
from experience_evaluation.environment import Environment
from experience_evaluation.methods.method import FieldMethod, Task
from experience_evaluation.starts import choose_places
from experience_evaluation.teachers import demonstrate, NoWayError
from experience_evaluation.worlds import FAMILIES, generate


def taught(occupancy, parameters, sight, n_trials, seed, teacher='shortest'):
    """Return a world and the method that was taught in it and has tried n times."""
    goal, start = choose_places(occupancy, np.random.default_rng(seed))
    world = GridWorld(occupancy, parameters, sight)
    task = Task(Grid(*occupancy.shape, 0.25), goal, start, True, parameters)
    rng = np.random.default_rng(seed)
    method = FieldMethod(task, rng)
    method.teach(demonstrate(world, teacher, start, goal, rng, 1))
    for number in range(1, n_trials + 1):
        method.practise(Environment(world, goal), number)
    return world, method


def assert_equal_to_each_alone(world, field, starts, seed):
    """Check a judgement against one trial after another, each with a memory of its own."""
    judged, log = world.trials(field, starts, seed), world._new_log(0)
    ready = world._ready(field)
    alone = [world._run(ready, (int(row), int(col)), seed + index, log)
             for index, (row, col) in enumerate(starts)]
    outcome, n_steps, _, length, reinforcements = np.array(alone).reshape(-1, 5).T
    np.testing.assert_array_equal(judged.outcome, outcome)
    np.testing.assert_array_equal(judged.n_steps, n_steps)
    np.testing.assert_array_equal(judged.n_reinforcements, reinforcements)
    np.testing.assert_allclose(judged.length, length, atol=1e-9)
    return judged


@settings(max_examples=25, deadline=None)
@given(family=st.sampled_from(sorted(FAMILIES)), seed=st.integers(0, 1000),
       size=st.integers(8, 24), n_trials=st.integers(0, 4),
       profile=st.sampled_from(['full', 'full', 'paper']), moves=st.sampled_from([4, 8]),
       corner_cutting=st.booleans(), sight=st.sampled_from([3, 3, 9]),
       limit=st.sampled_from([1, 3, 4]), step_limit=st.sampled_from([12, 300]),
       teacher=st.sampled_from(['shortest', 'blind']))
def test_a_judgement_equals_trials_that_are_run_alone(
        family, seed, size, n_trials, profile, moves, corner_cutting, sight, limit, step_limit,
        teacher):
    parameters = Parameters(
        profile=profile, moves=moves, corner_cutting=corner_cutting, oscillation_limit=limit,
        step_limit=step_limit)
    try:
        world, method = taught(
            generate(family, size, seed), parameters, sight, n_trials, seed, teacher)
    except NoWayError:
        return
    starts = np.argwhere(world.truth == 0)[::3]
    assert_equal_to_each_alone(world, method.refresh.field, starts, seed)


@settings(max_examples=8, deadline=None)
@given(family=st.sampled_from(['random', 'rooms', 'maze']), seed=st.integers(0, 1000),
       n_trials=st.integers(0, 4), map_memory=st.sampled_from([0, 1, 20]),
       share=st.sampled_from([0.05, 0.4]))
def test_it_does_too_where_walls_are_remembered_that_have_gone(
        family, seed, n_trials, map_memory, share):
    occupancy = generate(family, 18, seed)
    try:
        world, method = taught(occupancy, Parameters(map_memory=map_memory), 3, n_trials, seed)
        occupancy = moved_obstacles(occupancy, share, np.random.default_rng(seed),
                                    method.task.goal, method.task.first_start)
    except (NoWayError, ValueError):
        return
    changed = GridWorld(occupancy, world.parameters)
    method.practise(Environment(changed, method.task.goal), n_trials + 1)
    starts = np.argwhere(changed.truth == 0)[::3]
    assert_equal_to_each_alone(changed, method.refresh.field, starts, seed)
    assert_equal_to_each_alone(changed, method.learner.trial_field(True), starts, seed)


@pytest.mark.parametrize('family', ['rooms', 'maze', 'open'])
def test_most_trials_of_a_large_world_need_not_be_run(family):
    occupancy = generate(family, 16, 1).repeat(3, axis=0).repeat(3, axis=1)
    world, method = taught(occupancy, Parameters(), 3, 0, 1)
    field, starts = method.refresh.field, np.argwhere(occupancy == 0)
    cost = world.cost_to(field.goal)
    judge = Judge(field, world.truth, world.parameters, cost, world._scanner)
    judge.runs(starts, 0)
    n_lost = int((~np.isfinite(world.flow_lengths(field)) & np.isfinite(cost)).sum())
    assert judge.n_run - (len(starts) - n_lost) < 0.35 * n_lost + 1


def test_whoever_waits_is_told_how_many_are_judged():
    world, method = taught(generate('open', 30, 1), Parameters(), 3, 0, 1)
    told = []
    world.trials(method.refresh.field, np.argwhere(world.truth == 0), 0, told.append)
    assert told == sorted(told)
    assert told[-1] == 900
    assert len(told) > 1


def test_no_start_is_no_run():
    world, method = taught(generate('open', 8, 1), Parameters(), 3, 0, 1)
    runs = world.trials(method.refresh.field, np.zeros((0, 2), np.int64), 0)
    assert [len(column) for column in vars(runs).values()] == [0] * 4
