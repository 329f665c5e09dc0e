"""A world that changes between two trials, and what is judged in it."""

import numpy as np
import pytest

from benchmarks.changing_mazes import dyna_q, dyna_q_plus, Maze, MAZES, oracle, ours
from control_field.grid import Grid
from control_field.parameters import Parameters
from experience_evaluation.experiment import Change, Experiment, run_seed
from experience_evaluation.methods.registry import METHODS

SIZE = 10


def walled(*gaps):
    """Return a square with a wall across its middle, and gaps in it."""
    cells = np.zeros((SIZE, SIZE), dtype=np.int8)
    cells[SIZE // 2] = 100
    cells[SIZE // 2, list(gaps)] = 0
    return cells


def experiment(*changes, first=(8,), n_trials=4, **options):
    changes = tuple(Change(after, walled(*gaps), f'{gaps}') for after, gaps in changes)
    return Experiment(Grid(SIZE, SIZE, 1.0), walled(*first), (9, 5), [(1, 5)], n_trials,
                      changes=changes, **options)


@pytest.mark.parametrize('method', METHODS)
def test_a_change_into_the_same_world_changes_no_number(method):
    plain = run_seed(experiment(method=method), 1)
    same = run_seed(experiment((2, (8,)), method=method), 1)
    for row in (*plain.after, *same.after):
        row['seconds_learning'] = 0.0
    np.testing.assert_equal(same.after, plain.after)
    row = {**same.at_changes[0], 'seconds_learning': 0.0}
    np.testing.assert_equal(row, plain.after[2])


def test_every_entry_is_judged_in_the_world_that_is_true_then():
    curve = run_seed(experiment((1, ()), (3, (8,)), method='replanner'), 0)
    before, sealed, open_again = curve.after[1], curve.at_changes[0], curve.at_changes[1]
    assert [row['trials'] for row in curve.at_changes] == [1.0, 3.0]
    assert before['success'] == 1.0
    # What never forgets takes the gap for shut.
    assert open_again['success'] < 0.6
    # Only the goal's side of the wall has a way there: half of the cells.
    assert sealed['hidden_neurons_share'] == 0.0
    assert sealed['success'] == 1.0
    assert np.isnan(sealed['flow_steps'])


def test_cells_that_lead_nowhere_any_more_are_not_judged_but_trials_may_start_there():
    changing = experiment((1, ()))
    first, sealed = changing.environments()
    assert changing.judged(first).sum() == SIZE * (SIZE - 1) + 1
    assert changing.judged(sealed).sum() == SIZE * (SIZE // 2 - 1)
    assert sealed.startable.sum() == SIZE * (SIZE - 1) - 1
    assert not sealed.startable[9, 5]


@pytest.mark.parametrize('method', METHODS)
def test_a_goal_that_is_blocked_is_no_judgement_of_anybody(method):
    blocked = walled(8)
    blocked[9, 5] = 100
    changing = experiment(method=method, n_trials=2)
    changing = Experiment(**{**vars(changing), 'changes': (Change(1, blocked),)})
    last = run_seed(changing, 0).after[-1]
    assert np.isnan(last['success'])
    assert np.isnan(last['field_success_spl'])
    assert np.isnan(last['hidden_neurons_share'])


def test_what_a_method_drives_on_is_not_told_of_a_change():
    for method in ('ours', 'replanner', 'dyna_q+demo'):
        before, after = (run_seed(experiment(*changes, n_trials=n_trials, method=method), 0)
                         for changes, n_trials in (((), 2), (((2, (2,)),), 3)))
        for name in ('basin', 'hidden_neurons'):
            np.testing.assert_equal(after.at_changes[0][name], before.after[-1][name])


def test_who_forgets_finds_the_way_that_opened_again_and_who_does_not_never_will():
    keeping, forgetting = (
        run_seed(experiment((1, ()), (3, (8,)), method=method), 0).at_changes[1]['success']
        for method in ('replanner', 'forgetting_replanner'))
    assert keeping < 0.6
    assert forgetting == 1.0


def test_a_wall_is_forgotten_after_as_many_trials_as_are_asked_for():
    def known(n_trials):
        return run_seed(experiment((1, ()), first=range(SIZE), n_trials=n_trials, spread=False,
                                   method='forgetting_replanner', parameters=Parameters(
                                       map_memory=2)), 0).field['known']

    assert (known(2)[SIZE // 2] == 100).any()  # seen in the second trial
    changes = (1, ()), (2, range(SIZE))
    last = run_seed(experiment(*changes, first=range(SIZE), n_trials=6, spread=False,
                               method='forgetting_replanner', parameters=Parameters(
                                   map_memory=2)), 0).field['known']
    assert not (last[SIZE // 2] == 100).any()


def test_dyna_q_plus_tries_what_it_has_not_tried_for_long():
    def n_arrived(run):
        return np.mean([run(MAZES['blocking maze'], seed)[-1] for seed in range(3)])

    assert n_arrived(dyna_q_plus) > 150 > 110 > n_arrived(dyna_q)


@pytest.mark.parametrize('method', ['ours', 'replanner'])
def test_who_sees_farther_knows_more_from_the_same_demonstration(method):
    near, far = (run_seed(experiment(n_trials=0, method=method, sight=sight), 0).field['known']
                 for sight in (3, 9))
    assert (far == -1).sum() < (near == -1).sum()
    assert (far[near != -1] == near[near != -1]).all()


@pytest.mark.parametrize(('name', 'arrived'), [('blocking maze', 225), ('shortcut maze', 487)])
def test_who_knows_everything_bounds_what_can_be_reached_in_the_mazes_of_the_book(name, arrived):
    assert oracle(MAZES[name], 0)[-1] == arrived


def test_without_a_teacher_ours_learns_from_the_first_success_and_finds_the_new_gap():
    maze = Maze(((8,), (0,)), (400, 400), 0.0)
    arrived = ours(maze, 0)
    assert len(arrived) == 800
    assert (np.diff(arrived) >= 0).all()
    assert arrived[-1] - arrived[-101] >= 5  # the shortest way has 16 steps
    np.testing.assert_array_equal(arrived, ours(maze, 0))
