"""The paper's two tasks, on the grid alone; with what must fail beside what must not."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_ROW
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField, Outcome, Trial
from control_field.robot.policy import TrialPolicy
from strategies import demonstration_of, segment
from world_maps.world import load_world

WORLDS = Path(__file__).resolve().parents[2] / 'config' / 'worlds'
START, CORNER, GOAL = (3, 2), (3, 15), (16, 15)
SHOWN = segment(START, CORNER, GOAL)
TASKS = ('task1', 'task2')
SEEDS = range(5)


@cache
def world_of(task):
    return load_world(WORLDS / f'{task}.yaml')


def run(task, profile, seed, cells=SHOWN, n_trials=6, **values):
    """Teach in the empty workspace, run trials in the task's; return the learner and a table."""
    world = world_of(task)
    learner = Learner(world.grid, Parameters(profile=profile, seed=seed, **values))
    learner.add_demonstration(demonstration_of(cells, 0 * world.occupancy))
    truth, table, q = GridWorld(world.occupancy, learner.parameters), [], []
    for number in range(1, n_trials + 1):
        trial, _ = truth.trial(learner.trial_field(False), START, 100 * seed + number, number)
        refresh = learner.add_trial(trial)
        table.append((trial.outcome.value, trial.n_steps, refresh.reinforcements,
                      len(refresh.prototypes)))
        q.append(learner.memory.q.tobytes() + refresh.field.q.tobytes())
    return learner, table, q


def test_the_obstacles_stand_in_the_demonstrated_way_and_leave_one():
    for task in TASKS:
        occupancy = world_of(task).occupancy
        assert occupancy.shape == (20, 20)
        assert occupancy[START] == occupancy[GOAL] == 0
        assert any(occupancy[cell] for cell in SHOWN)
        assert np.isfinite(GridWorld(occupancy, Parameters()).cost_to(GOAL)[START])


@pytest.mark.parametrize('profile', ['paper', 'full'])
@pytest.mark.parametrize('task', TASKS)
class TestThePapersResult:

    @pytest.mark.parametrize('seed', SEEDS)
    def test_the_task_is_learnt_in_three_trials_without_a_collision(self, task, profile, seed):
        learner, table, _ = run(task, profile, seed)
        outcomes, steps, reinforcements, neurons = zip(*table, strict=True)
        assert 'collision' not in outcomes
        assert set(outcomes[2:]) == {'goal'}
        assert reinforcements[0] > 0  # there was something to learn
        assert set(reinforcements[3:]) == {0}
        assert len(set(steps[3:])) == len(set(neurons[3:])) == 1
        n_walls = np.count_nonzero(world_of(task).occupancy[tuple(np.array(SHOWN).T)])
        assert neurons[-1] >= len(SHOWN) - 1 - n_walls
        assert learner.refresh.certificate.fidelity == 1.0

    def test_it_gets_there_from_everywhere_else_without_a_collision(self, task, profile):
        learner, _, _ = run(task, profile, 0)
        truth = GridWorld(world_of(task).occupancy, learner.parameters)
        starts = np.argwhere(np.isfinite(truth.cost_to(GOAL)))
        runs = truth.trials(learner.refresh.field, starts, 0)
        assert (runs.outcome != 1).all()
        assert (runs.outcome == 0).mean() > (0.999 if profile == 'full' else 0.98)

    def test_two_equal_runs_give_bit_equal_Q_matrices(self, task, profile):
        first, second = run(task, profile, 3, n_trials=4), run(task, profile, 3, n_trials=4)
        assert first[1:] == second[1:]


def reversed_field(field):
    """Return a field whose every heading is the other way round."""
    return ControlField(field.grid, field.revision, field.goal, -field.vx, -field.vy,
                        field.coherence, field.q, field.known, field.flags)


@pytest.mark.parametrize('task', TASKS)
def test_shown_the_wrong_way_round_the_paper_never_gets_there(task):
    field = run(task, 'paper', 0, n_trials=0)[0].refresh.field
    truth = GridWorld(world_of(task).occupancy, Parameters(profile='paper', step_limit=600))
    shown, wrong = ([truth.trial(headings, START, seed)[0] for seed in range(10)]
                    for headings in (field, reversed_field(field)))
    assert sum(trial.outcome == 'goal' for trial in shown) >= 7
    assert sum(trial.outcome == 'goal' for trial in wrong) == 0
    assert sum(trial.n_steps for trial in wrong) > 1.2 * sum(trial.n_steps for trial in shown)


def test_shown_from_the_goal_to_the_start_the_start_is_the_goal():
    learner, table, _ = run('task1', 'full', 0, SHOWN[::-1], n_trials=2)
    assert learner.refresh.field.goal == START
    assert [row[:3] for row in table] == [('goal', 0, 0)] * 2


@pytest.mark.parametrize('task', TASKS)
def test_without_rewards_the_paper_walks_farther_and_arrives_less_often(task):
    spent, reached, walked = [], [], []
    for values in ({}, {'learning_rate': 0.0}):
        rows = [row for seed in range(8) for row in run(
            task, 'paper', seed, n_trials=3, step_limit=600, **values)[1]]
        spent.append(sum(row[2] for row in rows))
        reached.append(sum(row[0] == 'goal' for row in rows))
        walked.append(sum(row[1] for row in rows))
    assert spent[1] > 1.5 * spent[0]
    assert walked[1] > 1.3 * walked[0]
    assert reached[1] < reached[0]


@pytest.mark.parametrize('profile', ['paper', 'full'])
@pytest.mark.parametrize('task', TASKS)
def test_a_robot_that_forgets_its_trials_never_stops_paying(task, profile):
    world, total = world_of(task), []
    learner = Learner(world.grid, Parameters(profile=profile))
    learner.add_demonstration(demonstration_of(SHOWN, 0 * world.occupancy))
    truth = GridWorld(world.occupancy, learner.parameters)
    for number in range(1, 7):
        trial, _ = truth.trial(learner.refresh.field, START, number, number)
        total.append(trial.n_online_reinforcements)
    assert min(total) > 0


@pytest.mark.parametrize('profile', ['paper', 'full'])
@pytest.mark.parametrize('task', TASKS)
def test_without_local_grid_it_runs_into_the_obstacle_and_never_learns(task, profile):
    learner, _, _ = run(task, profile, 0, n_trials=0)
    for number in range(1, 5):
        trial = blind_trial(learner.refresh.field, world_of(task).occupancy, number)
        assert trial.outcome == Outcome.COLLISION
        learner.add_trial(trial)


def blind_trial(field, occupancy, number):
    """Run a trial on the policy alone, to which all around it is unknown."""
    policy = TrialPolicy(field, Parameters(), np.random.default_rng(number), number)
    (row, col), tables, outcome = START, [], Outcome.GOAL
    while outcome == Outcome.GOAL and not policy.at_goal(row, col):
        choice = policy.decide(row, col, 0, 255, 0.0)
        tables.append(choice.decisions)
        row, col = row + int(STEP_ROW[choice.heading]), col + int(STEP_COL[choice.heading])
        if not (0 <= row < 20 and 0 <= col < 20) or occupancy[row, col]:
            outcome = Outcome.COLLISION
    return Trial(np.concatenate(tables), outcome)


@pytest.mark.parametrize('task', TASKS)
def test_the_demonstrated_field_is_the_same_for_both_tasks(task):
    field = run(task, 'paper', 0, n_trials=0)[0].refresh.field
    other = run(TASKS[0], 'paper', 0, n_trials=0)[0].refresh.field
    assert field.vx.tobytes() + field.vy.tobytes() == other.vx.tobytes() + other.vy.tobytes()
    shown = np.argwhere(field.flags & CellFlag.DEMONSTRATED)
    assert set(map(tuple, shown.tolist())) == set(SHOWN[:-1])
