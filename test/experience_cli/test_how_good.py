"""The benchmark tasks of the quality table hold what the table says."""

import pytest

from benchmarks.how_good import median, n_reinforced, Target
from benchmarks.paper_tasks import dyna_steps, paper_experiment
from control_field.parameters import Parameters
from experience_cli.evaluation.experiment import run_seed


def test_dyna_maze_is_solved_within_fifty_steps():
    assert max(dyna_steps(seed)[0] for seed in range(10)) <= 50


@pytest.mark.parametrize('profile', ['paper', 'full'])
@pytest.mark.parametrize('name', ['task1', 'task2'])
def test_the_papers_tasks_need_few_trials_with_reinforcements(name, profile):
    experiment = paper_experiment(name, Parameters(profile=profile), n_trials=5)
    used = [n_reinforced(run_seed(experiment, seed)) for seed in range(3)]
    assert max(used) <= 3


def test_a_row_says_whether_it_is_met():
    assert median('a', [0.5, 1.0, 0.9], 0.8).line().endswith('>= 0.8 | yes |')
    assert Target('b', 2.0, 1.0, at_most=True).line().endswith('<= 1 | **no** |')
