"""Every method is taught, tries and is judged by the same rules."""

import numpy as np
import pytest

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation.environment import Environment
from experience_evaluation.experiment import Experiment, has_demonstration, run_seed
from experience_evaluation.methods.method import Task
from experience_evaluation.methods.registry import make_method, METHODS
from experience_evaluation.metrics import METRICS, spl
from experience_evaluation.report import interval_of_median, summarise
from experience_evaluation.starts import choose_places
from experience_evaluation.teachers import demonstrate
from experience_evaluation.workers import run_all
from experience_evaluation.worlds import generate


def experiment(family='rooms', n_trials=4, size=12, **options):
    occupancy = generate(family, size, 1)
    goal, start = choose_places(occupancy, np.random.default_rng(1))
    return Experiment(Grid(size, size, 1.0), occupancy, goal, [start], n_trials, **options)


@pytest.mark.parametrize('method', METHODS)
def test_every_method_is_judged_alike(method):
    curve = run_seed(experiment(method=method), 0)
    assert [row['trials'] for row in curve.after] == [0, 1, 2, 3, 4]
    for row in curve.after:
        assert set(METRICS) < set(row)
        for name in ('field_success', 'success'):
            assert 0.0 < row[name] <= 1.0  # the goal itself counts
            assert row[f'{name}_spl'] <= row[name]
        # With local grid there is more than without, but for wandering at random.
        assert row['success'] >= row['field_success'] - 0.05


@pytest.mark.parametrize('method', METHODS)
def test_a_seed_gives_the_same_course(method):
    one, two = (run_seed(experiment(method=method, n_trials=2), 5) for _ in range(2))
    for first, second in zip(one.after, two.after, strict=True):
        first['seconds_learning'] = second['seconds_learning'] = 0.0
        np.testing.assert_equal(first, second)
    for name, column in one.field.items():
        np.testing.assert_array_equal(column, two.field[name])


@pytest.mark.parametrize('starts', ['spread', 'fixed'])
def test_ours_gets_better_by_trying_and_never_collides(starts):
    curve = run_seed(experiment('random', 10, 16, spread=starts == 'spread'), 0)
    assert curve.after[-1]['collisions'] == 0
    assert curve.after[-1]['success'] == 1.0
    if starts == 'spread':
        assert curve.after[-1]['field_success'] > curve.after[0]['field_success']
        assert curve.after[-1]['field_success'] > 0.95


def test_the_replanner_wins_on_length_and_loses_on_fidelity():
    ours, replanner = (run_seed(experiment('random', 6, 16, teacher='detour', method=method), 0)
                       for method in ('ours', 'replanner'))
    assert ours.after[-1]['fidelity'] >= 0.95 > 0.8 > replanner.after[-1]['fidelity']
    assert replanner.after[-1]['success_spl'] >= 0.95


@pytest.mark.parametrize('method', ['dyna_q+demo', 'prioritised_sweeping+demo', 'sarsa+demo',
                                    'q_learning+demo'])
def test_a_demonstration_helps_tabular_methods(method):
    with_it = run_seed(experiment(method=method, n_trials=0), 0)
    without = run_seed(experiment(method=method.removesuffix('+demo'), n_trials=0), 0)
    assert with_it.after[0]['field_success'] > without.after[0]['field_success']
    assert with_it.after[0]['fidelity'] == 1.0


def test_dyna_q_learns_the_way_in_the_end():
    curve = run_seed(experiment('open', 150, 8, method='dyna_q', judged_after=(150,)), 0)
    assert curve.after[-1]['field_success'] > 0.9


def test_what_does_not_learn_by_trying_stays_as_it_is():
    for method in ('eq7', 'nearest_prototype'):
        curve = run_seed(experiment(method=method), 0)
        assert len({row['success'] for row in curve.after}) == 1


@pytest.mark.parametrize('method', METHODS)
def test_every_method_is_judged_as_seldom(method):
    curve = run_seed(experiment(method=method, judged_after=(0, 2, 4)), 0)
    assert [row['trials'] for row in curve.after] == [0, 2, 4]


@pytest.mark.parametrize('method', ['ours', 'nearest_prototype', 'replanner', 'dyna_q+demo'])
@pytest.mark.parametrize(('limit', 'outcome'), [(4, 2), (5, 0)])
def test_the_last_step_allowed_may_be_the_one_into_the_goal(method, limit, outcome):
    parameters = Parameters(step_limit=limit)
    world = GridWorld(np.zeros((1, 6), np.int8), parameters)
    task = Task(Grid(1, 6, 1.0), (0, 5), (0, 0), False, parameters)
    taught = make_method(method, task, np.random.default_rng(0))
    taught.teach(demonstrate(world, 'shortest', (0, 0), (0, 5), np.random.default_rng(0), 1))
    runs = taught.runs(Environment(world, task.goal), np.array([[0, 0]]), 0)
    assert (runs.outcome.tolist(), runs.n_steps.tolist()) == ([outcome], [limit])


def test_parts_of_the_course_can_be_left_unjudged():
    few = run_seed(experiment(judged_after=(4,)), 0).after
    every = run_seed(experiment(), 0).after
    assert [row['trials'] for row in few] == [0, 4]
    assert few[-1]['success_spl'] == every[-1]['success_spl']
    assert few[-1]['steps'] == every[-1]['steps']


def test_four_moves_hold_for_tabular_methods():
    curve = run_seed(experiment(method='dyna_q+demo', parameters=Parameters(moves=4)), 0)
    headings = np.stack([curve.field['vx'], curve.field['vy']])
    assert (np.abs(headings).max(axis=0) > 0.99).all()


def test_jobs_give_the_same_in_any_order():
    tasks = [(experiment(n_trials=1), seed) for seed in range(3)]
    alone, together = (run_all(tasks, n_jobs, 'test') for n_jobs in (1, 2))
    assert [curve.seed for curve in alone] == [curve.seed for curve in together] == [0, 1, 2]
    for one, other in zip(alone, together, strict=True):
        assert one.after[-1]['success_spl'] == other.after[-1]['success_spl']


def test_whether_a_teacher_finds_a_way_is_known_beforehand():
    corridor = Experiment(Grid(1, 6, 1.0), np.zeros((1, 6), np.int8), (0, 5), [(0, 0)], 0)
    assert has_demonstration(corridor, 0)
    assert not has_demonstration(
        Experiment(corridor.grid, corridor.occupancy, (0, 5), [(0, 0)], 0, teacher='detour'), 0)


def test_an_unknown_method_is_refused():
    with pytest.raises(ValueError, match='there is no method'):
        make_method('magic', None, np.random.default_rng(0))


def test_spl_counts_the_goal_fully_and_failures_not_at_all():
    home = np.array([True, True, True, False])
    assert spl(home, np.array([0.0, 4.0, 8.0, 1.0]), np.array([0.0, 4.0, 4.0, 4.0])) == (
        pytest.approx((1.0 + 1.0 + 0.5) / 4.0))
    assert spl(home[:0], np.zeros(0), np.zeros(0)) != spl(home[:0], np.zeros(0), np.zeros(0))


def test_intervals_hold_the_median_and_narrow_down():
    rng = np.random.default_rng(1)
    for n in (1, 5, 50, 500):
        values = rng.normal(size=n)
        low, high = interval_of_median(values)
        assert low <= np.median(values) <= high
        assert high - low <= 4.0 * 2.5 / np.sqrt(n)


def test_what_is_not_defined_is_left_out_of_medians():
    assert summarise([float('nan'), 2.0])['median'] == 2.0
    assert summarise([float('nan'), 2.0])['values'] == [None, 2.0]
    assert summarise([float('nan')])['median'] is None
