"""What can be set about the learner, beyond the ranges."""


import pytest

from bridge_helpers import GRID
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


def test_lock_step_means_stamped_commands():
    assert Settings(lockstep=True).is_stamped
    assert not Settings().is_stamped


def test_a_task_cannot_lead_out_of_the_bags():
    with pytest.raises(BagError, match='task'):
        Settings(task='../x')
