"""Bags of a workspace that fits itself, folded: it grows with them, and no cell moves."""

import pytest

from episode_store.relearn import relearn
from episode_store.task_folder import TaskFolder
from fitted_bags import demo, HERE


def test_the_first_demonstration_makes_the_workspace(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    demo(task, [(0.0, 0.0), (2.0, 0.0)])
    relearner, [learnt] = relearn(task.episodes())
    assert relearner.fitted
    grid = learnt.refresh.field.grid
    assert grid.resolution == HERE.resolution
    assert grid.offset_to(HERE) is not None
    # 8 cells around (0, 0) to (8, 0), rounded outwards.
    assert (grid.n_rows, grid.n_cols) == (24, 32)
    assert grid.contains(*grid.cell_from_world(-1.9, -1.9))


def test_a_longer_drive_than_the_first_workspace_is_learnt(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    demo(task, [(0.0, 0.0), (-30.0, 4.0)])
    [learnt] = relearn(task.episodes())[1]
    goal = learnt.refresh.field.grid.world_from_cell(*learnt.refresh.field.goal)
    assert goal == pytest.approx((-30.0, 4.0), abs=0.13)
