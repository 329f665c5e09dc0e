"""The benchmark tasks of the quality table hold what the table says."""

import numpy as np
import pytest

from benchmarks.how_good import main, median, n_reinforced, Target, with_options
from benchmarks.own_tasks import OWN, own_barn_tasks, own_tasks
from benchmarks.paper_tasks import dyna_curves, n_steps_until, paper_experiment
from control_field.parameters import Parameters
from experience_evaluation.experiment import run_seed


def test_dyna_maze_is_solved_within_fifty_steps():
    curves = dyna_curves(10, 1)
    assert max(n_steps_until(curve, 'greedy_steps', 14) for curve in curves) <= 50
    assert n_steps_until(curves[0], 'greedy_steps', 13) == np.inf


@pytest.mark.parametrize('profile', ['paper', 'full'])
@pytest.mark.parametrize('name', ['task1', 'task2'])
def test_the_papers_tasks_need_few_trials_with_reinforcements(name, profile):
    experiment = paper_experiment(name, Parameters(profile=profile), n_trials=5)
    used = [n_reinforced(run_seed(experiment, seed)) for seed in range(3)]
    assert max(used) <= 3


def test_a_row_says_whether_it_is_met():
    assert median('a', [0.5, 1.0, 0.9], 0.8).line().endswith('>= 0.8 | yes |')
    assert Target('b', 2.0, 1.0, at_most=True).line().endswith('<= 1 | **no** |')


def test_where_nothing_was_asked_for_nothing_is_met():
    assert median('a', [0.5], float('nan')).line().endswith('| 0.5 | 0.5 to 0.5 | | |')


@pytest.mark.parametrize('tasks', [*(own_tasks(name, 3) for name in OWN), own_barn_tasks(3)])
def test_own_worlds_differ_and_lead_to_the_goal(tasks):
    experiments = [experiment for experiment, _ in tasks]
    for experiment in experiments:
        assert experiment.reachable()[experiment.demo_starts[0]]
        assert experiment.reachable().sum() > 0.8 * (experiment.occupancy == 0).sum()
    assert len({(e.occupancy.tobytes(), e.goal, e.demo_starts[0]) for e in experiments}) == 3


def test_generated_worlds_are_measured_like_maps(capsys):
    assert main(['--own', '--only', 'empty', '--seeds', '2', '--jobs', '1']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum('empty, 32 x 32' in line for line in lines) == 3
    assert all(line.endswith('| yes |') for line in lines[2:])


def test_prototypes_stay_few_where_pruning_closes_a_loop():
    tasks = with_options(own_tasks('random, 10 %, 32 x 32', 3), n_trials=15, judged_after=(15,))
    last = run_seed(*tasks[2]).after[-1]
    assert last['hidden_neurons_share'] < 0.3
    assert last['basin'] == 1.0
