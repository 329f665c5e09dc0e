"""What can be set about the learner, beyond the ranges."""


import pytest

from bridge_helpers import GRID
from control_field.grid import Grid
from control_field.poses import StartPose
from episode_store.rosbag2.errors import BagError
from learner_node.settings import Settings, start_poses_from_list


def test_start_poses_come_in_threes():
    assert start_poses_from_list([1, 2, 0.5], GRID) == (StartPose(1.0, 2.0, 0.5),)
    assert start_poses_from_list(None, GRID) == ()


@pytest.mark.parametrize('values', [[1.0], [1.0, float('nan'), 0.0], [-1.0, 1.0, 0.0]])
def test_start_poses_that_are_none_are_refused(values):
    with pytest.raises(ValueError, match='start_poses'):
        start_poses_from_list(values, GRID)


def test_where_the_workspace_fits_itself_trials_start_anywhere():
    assert start_poses_from_list([-99.0, 1.0, 0.0], None) == (StartPose(-99.0, 1.0, 0.0),)


def test_without_rows_and_columns_there_is_no_workspace_to_set():
    assert Settings().grid is None
    assert Settings(resolution=0.3).grid is None
    assert Settings(rows=20, cols=30).grid == Grid(20, 30, 0.25)
    assert Settings(rows=2, cols=3, robot_radius=0.22, origin_x=-1.0).grid == Grid(
        2, 3, 0.5, -1.0)


def test_lock_step_means_stamped_commands():
    assert Settings(lockstep=True).is_stamped
    assert not Settings().is_stamped


def test_a_task_cannot_lead_out_of_the_bags():
    with pytest.raises(BagError, match='task'):
        Settings(task='../x')
