"""Workspaces that fit drives of others: whose cells, which frame, and what is said of motion."""

import numpy as np
import pytest

from bridge_helpers import raw_local_grid
from control_field.grid import default_lattice, Grid
from episode_store.external.kinds_of_motion import doubts_about_motion
from episode_store.external.workspace import lattice_of, Workspace
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr_write import pose_stamped_to_cdr
from msgs_bridge.sensing.rigid_motions import Motions

OCCUPANCY = 'nav_msgs/msg/OccupancyGrid'
#: Cells that (0, 0) is neither a corner nor the middle of.
ODD = Grid(40, 40, 0.3, -1.1, 2.05)


def local_grids(cells, side, k=1):
    messages = [raw_local_grid(float(i), *cell, np.zeros((side, side)), ODD, k)
                for i, cell in enumerate(cells)]
    return RawMessages.of('/neighbourhood', OCCUPANCY, messages, list(range(len(messages))))


@pytest.mark.parametrize(('side', 'k'), [(3, 1), (9, 1), (9, 3), (15, 3), (15, 5), (25, 5)])
def test_local_grids_say_what_the_cells_are(side, k):
    cells = [(9, 9), (9, 10), (10, 11), (11, 11), (12, 10)]
    found = lattice_of(local_grids(cells, side, k), 'odom')
    assert found.resolution == pytest.approx(ODD.resolution)
    assert found.offset_to(ODD) == (9, 9)
    assert lattice_of(local_grids(cells, side, k), 'map') is None


def test_they_go_before_the_default_but_not_before_what_was_asked_for():
    poses = RawMessages.of('/odom', 'geometry_msgs/msg/PoseStamped', [
        pose_stamped_to_cdr(10**8 * i, 'odom', 2.0 + 0.02 * i, 5.0, 0.0) for i in range(60)],
        list(range(60)))
    seen = local_grids([(9, 9), (9, 10)], 3)
    for any_lattice in (False, True):
        grid = Workspace(default_lattice(0.25), True, any_lattice=any_lattice).fitted(
            poses, seen, 'odom')
        assert (grid.offset_to(ODD) is not None) == any_lattice
        assert (grid.offset_to(default_lattice(0.25)) is None) == any_lattice
        for x in (2.0, 3.18):
            assert grid.contains(*grid.cell_from_world(x - 8 * grid.resolution, 5.0))


def test_a_place_too_large_says_which_resolution_would_do():
    poses = RawMessages.of('/odom', 'geometry_msgs/msg/PoseStamped', [
        pose_stamped_to_cdr(10**9 * i, 'odom', 2.5 * i, 2.5 * i, 0.0) for i in range(3000)],
        list(range(3000)))
    workspace = Workspace(default_lattice(0.25), True, speed_max=9.0)
    with pytest.raises(BagError, match=r'with resolution [0-9.]+ it would fit \(--resolution\)'):
        workspace.fitted(poses, None, 'odom')


def moved(places, up=1.0):
    """Return a minute of motion whose z axis leans from upright to a cosine in the end."""
    n = len(places)
    lean = np.arccos(np.linspace(1.0, up, n)) / 2.0
    turn = np.stack([np.sin(lean), 0.0 * lean, 0.0 * lean, np.cos(lean)], axis=1)
    return np.linspace(0.0, 60.0, n), Motions(places, turn)


def line(rise, n=600):
    share = np.linspace(0.0, 6.0, n)
    return np.stack([share, 0.0 * share, rise * share], axis=1)


def test_what_climbs_is_refused_and_a_ramp_is_not():
    assert doubts_about_motion(*moved(line(0.25)), 'odom') == []
    with pytest.raises(BagError, match=r"floor of 'odom': there x goes from 0.00 to 6.00 m"):
        doubts_about_motion(*moved(line(0.7)), 'odom')


def test_what_tips_over_is_said_and_what_climbs_leaning_is_refused():
    [said] = doubts_about_motion(*moved(line(0.0), -0.4), 'odom')
    assert 'leans by more than 60 degrees' in said
    with pytest.raises(BagError, match='does not drive on the floor'):
        doubts_about_motion(*moved(line(0.2), -0.4), 'odom')


def test_who_stands_is_no_matter():
    assert doubts_about_motion(*moved(np.zeros((100, 3))), 'odom') == []
    assert doubts_about_motion(np.zeros(0), Motions(np.zeros((0, 3)), np.zeros((0, 4))), '') == []
