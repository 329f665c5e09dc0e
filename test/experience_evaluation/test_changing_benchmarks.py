"""Tasks in worlds that change hold what the tables say; curves break where the world changes."""

import numpy as np
import pytest

from benchmarks import changing_tasks
from benchmarks.changing_charts import draw_changes, draw_mazes, stretches, STYLES
from benchmarks.changing_mazes import Maze, RUNNERS
from benchmarks.changing_worlds import after, measures_of, rows_since, worst_of
from control_field.grid import Grid
from experience_evaluation.changing_worlds import persons_crossing
from experience_evaluation.experiment import LearningCurve

TASKS = (changing_tasks.blocking_tasks, changing_tasks.shortcut_tasks, changing_tasks.sealed_tasks,
         changing_tasks.doors_tasks, changing_tasks.persons_tasks,
         lambda n: changing_tasks.obstacle_tasks(n, True))


@pytest.mark.parametrize('make', TASKS)
def test_every_seed_has_another_task_that_can_be_taught(make):
    experiments = [experiment for experiment, _ in make(3)]
    assert len({(e.occupancy.tobytes(), e.goal, e.demo_starts[0]) for e in experiments}) == 3
    for experiment in experiments:
        assert experiment.reachable()[experiment.demo_starts[0]]
        assert all(change.after < experiment.n_trials for change in experiment.changes)


def curve(*values):
    """Return a curve over four trials, with a change after the second."""
    after = [{'trials': float(k), 'success': value} for k, value in enumerate(values)]
    return LearningCurve(0, after, {}, ({'trials': 2.0, 'success': 0.1},))


def test_a_curve_breaks_where_the_world_changes():
    before, since = stretches(curve(0.5, 0.6, 0.7, 0.8, 0.9))
    assert [row['success'] for row in before] == [0.5, 0.6, 0.7]
    assert [row['success'] for row in since] == [0.1, 0.8, 0.9]


def test_trials_since_a_change_begin_with_nothing_learnt():
    curves = [curve(0.5, 0.6, 0.7, 0.8, 0.9)] * 2
    assert [row['success'] for row in rows_since(curves[0], 0, 1)] == [0.1, 0.8]
    assert worst_of(curves, 0, 'success') == [0.1, 0.1]
    assert after(curves, 0, 'success', 2) == [0.9, 0.9]


def test_curves_are_drawn(tmp_path):
    curves = {name: [curve(0.5, 0.6, 0.7, 0.8, 0.9)] for name in STYLES}
    assert draw_changes({'task': curves}, 'success', tmp_path / 'a.png').stat().st_size
    reached = {'maze': {who: [np.arange(6)] for who in RUNNERS}}
    maze = {'maze': Maze(((8,), (0,)), (3, 3), 0.0)}
    assert draw_mazes(reached, maze, tmp_path / 'b.png').stat().st_size


def test_persons_cross_the_whole_workspace():
    grid = Grid(20, 20, 0.25)
    for person in persons_crossing(grid, 5, np.random.default_rng(0)):
        (x, y, _), (to_x, to_y, _) = person.waypoints
        assert abs(x - to_x) == 5.0 or abs(y - to_y) == 5.0


def test_maps_are_measured_where_there_are_some(tmp_path):
    assert set(measures_of(tmp_path)) - set(measures_of(None)) == {
        'moved, random-32-32-10', 'moved, room-32-32-4', 'moved, maze-32-32-4'}
