"""Parts of drives that others recorded: what a refusal names as whole is learnt as it is."""

import re

import numpy as np
import pytest

from bridge_helpers import content_of
from control_field.grid import Grid
from episode_store.episode import Episode
from episode_store.external.drive import open_drive, ReadOptions
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.external.span import Span
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from robot_bags import N, place, RobotBag

GRID = Grid(20, 20, 0.25)
PARTS = {'before': ('--to', 0, 60), 'after': ('--from', 60, N)}


@pytest.fixture(params=['ros2', 'ros1'])
def broken(tmp_path, request):
    """Record a drive whose odometry is set back by 0.5 m, and up, after three seconds."""
    path = tmp_path / ('drive.bag' if request.param == 'ros1' else 'drive')
    with RobotBag(path, ros1=request.param == 'ros1') as bag:
        for i in range(N):
            stamp, x, y, yaw = place(i)
            bag.odometry(stamp, x - 0.5 * (i >= 60), y + 1.0 * (i >= 60), yaw)
            bag.scan(stamp, x, y, yaw, [(2.0, 2.0, 2.4, 2.4)])
            if i == 0:
                edge = 'base_footprint', 'base_scan', 0.0, 0.0, 0.2, 0.0, 0.0, 0.0
                bag.transforms(stamp, edge, topic='/tf_static')
    return path


@pytest.mark.parametrize('which', PARTS)
def test_the_part_that_a_refusal_names_is_learnt_alone(broken, tmp_path, capsys, which):
    option, first, last = PARTS[which]
    task = tmp_path / 'bags' / 'task'
    assert main(['learn', str(broken), '--into', str(task)]) == 2
    error = capsys.readouterr().err
    seconds = re.search(rf'{option} ([0-9.]+)', error)[1]
    assert float(seconds) == {'--to': 2.95, '--from': 3.0}[option]
    assert main(['learn', str(broken), '--into', str(task), option, seconds]) == 0
    assert 'is read (seconds count from there' in capsys.readouterr().out
    [episode] = TaskFolder(task.parent, 'task').episodes()
    record, grid = content_of(episode.path).record, Episode(episode).header.grid
    at = np.array([place(i)[1:3] for i in range(first, last)]) + (
        (-0.5, 1.0) if first else (0.0, 0.0))
    assert record.cells[[0, -1]].tolist() == grid.cells_from_world(at[[0, -1]]).tolist()
    assert {tuple(cell) for cell in record.cells.tolist()} == {
        tuple(cell) for cell in grid.cells_from_world(at).tolist()}
    assert (record.unknown != 255).any()


def test_seconds_of_a_remedy_count_from_the_first_pose_of_all(broken):
    whole = open_drive(broken, GRID)
    part = open_drive(broken, GRID, ReadOptions(span=Span(1.0)))
    named = []
    for drive in whole, part:
        with pytest.raises(BagError, match=r'\(--to .*\) or after it \(--from') as caught:
            demonstration_from_drive(drive)
        named.append(re.search(r'--to (\S+)\) .*--from (\S+?)\)', str(caught.value)).groups())
    assert named[0] == named[1]


@pytest.mark.parametrize('words', [
    ['--from', '9'], ['--from', '2', '--to', '1'], ['--from', '-1'], ['--from', 'nan']], ids=str)
def test_seconds_that_are_none_of_the_drive_are_a_line(broken, capsys, words):
    assert main(['learn', str(broken), *words]) == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    assert '--from' in error


def test_several_drives_are_not_cut_at_once(broken, capsys):
    assert main(['learn', str(broken), str(broken), '--to', '2']) == 2
    assert '--to: name one bag' in capsys.readouterr().err


class TestFramesThatChange:
    """The part that is asked for is judged, not what lies around it."""

    @pytest.fixture(params=['odometry', 'to the map', 'frames'])
    def turning(self, tmp_path, request):
        """Record a drive in one frame for two seconds, in another one from there on."""
        with RobotBag(tmp_path / 'drive') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                frame = 'odom' if i < 40 else 'ship'
                if request.param == 'frames':
                    bag.transforms(stamp, (frame, 'base_link', x, y, 0.0, 0.0, 0.0, yaw))
                else:
                    bag.odometry(stamp, x, y, yaw, frame=frame)
                if request.param == 'to the map' and i == 0:
                    edges = [('map', each, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                             for each in ('odom', 'ship')]
                    bag.transforms(stamp, *edges, topic='/tf_static')
        self.top = 'map' if request.param == 'to the map' else ''
        return tmp_path / 'drive'

    def learnt(self, path, frame, span):
        grid = Grid(20, 20, 0.25, frame_id=self.top or frame)
        drive = open_drive(path, grid, ReadOptions(span=span))
        return demonstration_from_drive(drive)[0].cells

    @pytest.mark.parametrize(('frame', 'span', 'rows'), [
        ('odom', Span(0.0, 1.9), (0, 38)), ('odom', Span(0.5, 2.1), (10, 39)),
        ('ship', Span(2.0), (40, N - 1)), ('ship', Span(2.5, 5.0), (50, 100))], ids=str)
    def test_a_part_in_one_frame_is_learnt(self, turning, frame, span, rows):
        at = np.array([place(i)[1:3] for i in rows])
        assert self.learnt(turning, frame, span)[[0, -1]].tolist() == (
            GRID.cells_from_world(at).tolist())

    @pytest.mark.parametrize('span', [Span(0.0, 3.0), Span(0.2, 3.5)], ids=str)
    def test_a_part_in_two_frames_has_no_end(self, turning, span):
        with pytest.raises(BagError, match=r'where this drive ends: .*\(--to 1\.95\)'):
            self.learnt(turning, 'odom', span)

    def test_the_part_in_the_other_frame_has_no_beginning(self, turning):
        with pytest.raises(BagError, match=r'nobody knows where this drive (begins|ends)'):
            self.learnt(turning, 'ship', Span())
