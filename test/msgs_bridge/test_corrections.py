"""Localisations that mend the robot's place every few seconds: the drive is learnt as it was."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from episode_store.external.drive import open_drive
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.rosbag2.errors import BagError
from msgs_bridge.sensing.corrections import Correction, spread
from robot_bags import RobotBag
from strategies import few

GRID = Grid(40, 40, 0.25, -5.0, -5.0, frame_id='map')
RATE, SECONDS = 10, 30


def truth(t, stand=0.0):
    """Return where the robot is: it stands, and drives round a wide bend."""
    angle = 0.1 * max(t - stand, 0.0)
    return 2.2 * math.sin(angle), 2.2 - 2.2 * math.cos(angle), angle


def record(path, drift, every, stand=0.0, leap=0.0, with_odometry=False):
    """Record wheels that drift by so much a second, mended every so many seconds."""
    mended, off = 0.0, np.zeros(2)
    with RobotBag(path) as bag:
        for i in range(RATE * SECONDS):
            t = i / RATE
            x, y, yaw = truth(t, stand)
            way = drift * max(t - stand, 0.0)
            wheels = x - way, y + 0.5 * way
            if t - mended >= every:
                mended, off = t, np.array([way, -0.5 * way])
            jump = leap if t >= 15.0 else 0.0
            bag.transforms(1.0 + t, ('map', 'odom', off[0], off[1] + jump, 0.0, 0.0, 0.0, 0.0))
            if with_odometry:
                bag.odometry(1.0 + t, *wheels, yaw)
            else:
                bag.transforms(1.0 + t, ('odom', 'base_link', *wheels, 0.0, 0.0, 0.0, yaw))
    return path


@pytest.mark.parametrize('with_odometry', [False, True])
@pytest.mark.parametrize(('drift', 'every', 'stand'), [
    (0.06, 3.0, 0.0), (0.1, 4.0, 0.0), (0.1, 4.0, 6.0), (0.2, 2.0, 0.0), (0.02, 8.0, 0.0)])
def test_a_robot_that_is_mended_by_decimetres_is_learnt_where_it_was(
        tmp_path, drift, every, stand, with_odometry):
    path = record(tmp_path / 'bag', drift, every, stand, with_odometry=with_odometry)
    drive = open_drive(path, GRID)
    cells = demonstration_from_drive(drive)[0].cells
    way = np.array([truth(i / RATE, stand)[:2] for i in range(RATE * SECONDS)])
    for place in GRID.world_from_cells(cells[:-2]):
        assert np.hypot(*(way - place).T).min() < 0.25
    assert cells[0].tolist() == GRID.cells_from_world(way[:1])[0].tolist()
    [note] = [note for note in drive.notes if 'was corrected' in note]
    assert note.startswith('odom in map (/tf) was corrected')
    assert 'by up to 0.' in note


@pytest.mark.parametrize('leap', [0.6, 2.0])
def test_what_is_farther_is_a_leap(tmp_path, leap):
    path = record(tmp_path / 'bag', 0.0, 3.0, leap=leap)
    with pytest.raises(BagError, match=rf'at 15\.00 s the pose leaps by {leap - 0.1:.1f}|'
                                       rf'at 15\.00 s the pose leaps by {leap:.1f}'):
        demonstration_from_drive(open_drive(path, GRID))


@given(st.lists(st.tuples(st.floats(0.5, 4.0), st.floats(0.06, 1.5)), max_size=6))
@few
def test_only_what_is_slow_and_near_is_spread(steps):
    seconds, at, corrections = np.arange(300) / 10.0, 0.0, []
    for wait, size in steps:
        at += wait
        corrections.append(Correction(at, (size, 0.0, 0.0)))
    added, done = spread(seconds, 0.2 * seconds, corrections)
    before = [0.0, *(each.at for each in corrections)]
    for each, since in zip(corrections, before, strict=False):
        fits = each.size <= min(0.5, 0.5 * min(each.at - since, 5.0))
        assert (each in done) == fits
        rows = (seconds >= since) & (seconds < each.at)
        assert added[rows, 0].max(initial=0.0) <= (each.size if fits else 0.0)
    assert (np.abs(np.diff(added[:, 0])) <= 0.1 + max([0.0, *(c.size for c in done)])).all()
