"""Poses from `/tf` and local grid from scans: of drives whose truth is known."""

import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from bridge_helpers import GRID
from control_field.grid import Grid
from episode_store.external.drive import open_drive, ReadOptions
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.external.transforms import read_transforms
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.topic_tables import local_grid_table, pose_table
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.rigid_motions import Motions, rotated, STILL
from robot_bags import LASER, MAP, N, place, robot_bag, RobotBag

IN_MAP = Grid(GRID.n_rows, GRID.n_cols, GRID.resolution, frame_id='map')


def xy_of(drive, frame='odom'):
    return pose_table(drive.bag.messages(drive.topics['odom']), frame).xy


def expected_xy(offset=(0.0, 0.0)):
    return np.array([place(i)[1:3] for i in range(N)]) + offset


def blocked_cells(drive, grid=GRID):
    """Return the cells of the workspace that its local grids call blocked, but for its edge."""
    messages = drive.bag.messages(drive.topics['neighbourhood'])
    local_grids = local_grid_table(messages, grid)
    assert local_grids.n_refused == 0
    steps = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    return {(row + dr, col + dc) for (row, col), mask in zip(
        local_grids.cells.tolist(), local_grids.blocked.tolist(), strict=True)
        for k, (dr, dc) in enumerate(steps) if mask >> k & 1}


class TestLocalGrid:
    @pytest.mark.parametrize('mount', [
        LASER, Mount(0.1, 0.0, 0.0, 0.2), Mount(0.0, -0.05, 2.0, 0.2, 0.0, 0.1)], ids=str)
    @pytest.mark.parametrize('odometry', [True, False])
    def test_a_box_beside_the_way_is_seen_where_it_is(self, tmp_path, mount, odometry):
        drive = open_drive(robot_bag(tmp_path / 'bag', mount=mount, odometry=odometry), GRID)
        assert blocked_cells(drive) == {(5, 6), (5, 7)}
        record, _, notes = demonstration_from_drive(drive)
        assert record.blocked.any()
        made = 'local grid is made from 60 scans on /sc'
        [note] = [note for note in notes if note.startswith(made)]
        assert ('upside down' in note) == (mount is LASER)

    def test_a_local_grid_that_was_recorded_goes_before(self, tmp_path):
        path = robot_bag(tmp_path / 'bag')
        made = list(open_drive(path, GRID).bag.messages('/neighbourhood'))
        with RobotBag(tmp_path / 'seen') as bag:
            kind = 'nav_msgs/msg/OccupancyGrid'
            bag.connections['/neighbourhood'] = bag.writer.add_connection(
                '/neighbourhood', kind, typestore=bag.store)
            for i in range(N):
                bag.odometry(*place(i))
                bag.scan(*place(i), [], LASER, frame='base_footprint')
                bag.writer.write(bag.connections['/neighbourhood'], 10**9 + i, made[0])
        seen = open_drive(tmp_path / 'seen', GRID)
        assert list(seen.bag.messages(seen.topics['neighbourhood'])) == N * made[:1]
        assert seen.notes == ()
        again = open_drive(tmp_path / 'seen', GRID, ReadOptions({'scan': '/scan'}, mount=LASER))
        assert 1 < len(again.bag.messages(again.topics['neighbourhood'])) <= N
        assert made[0] not in list(again.bag.messages(again.topics['neighbourhood']))[1:]

    def test_where_nothing_says_where_the_laser_sits_there_is_no_local_grid_until_it_is_said(
            self, tmp_path):
        path = robot_bag(tmp_path / 'bag', said_mount=False)
        drive = open_drive(path, GRID)
        assert 'neighbourhood' not in drive.topics
        [note] = drive.notes
        assert note == ("no local grid from /scan: nothing says where 'base_scan' sits on the "
                        'robot, say so with --laser X Y Z ROLL PITCH YAW')
        assert blocked_cells(open_drive(path, GRID, ReadOptions(mount=LASER))) == {(5, 6), (5, 7)}

    def test_a_laser_that_is_tilted_too_far(self, tmp_path):
        drive = open_drive(robot_bag(tmp_path / 'bag', mount=Mount(pitch=0.5)), GRID)
        [note] = drive.notes
        assert note.startswith('no local grid from /scan: the laser is tilted by 29 degrees')

    def test_several_lasers_have_to_be_named(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                bag.odometry(stamp, x, y, yaw)
                for name in ('/front', '/rear'):
                    bag.scan(stamp, x, y, yaw, [], Mount(), name, 'base_footprint')
        [note] = open_drive(tmp_path / 'bag', GRID).notes
        assert note == ('no local grid: it may be made from /front or /rear, name one with '
                        '--scan-topic')
        drive = open_drive(tmp_path / 'bag', GRID, ReadOptions({'scan': 'front'}))
        assert drive.topics['neighbourhood'] == '/neighbourhood'

    def test_where_scans_are_missing_all_is_unknown(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                bag.odometry(stamp, x, y, yaw)
                if not 20 <= i < 90:
                    bag.scan(stamp, x, y, yaw, [], Mount(), frame='base_footprint')
        drive = open_drive(tmp_path / 'bag', GRID)
        local_grids = local_grid_table(drive.bag.messages('/neighbourhood'), GRID)
        unknown = local_grids.stamps[local_grids.unknown == 255]
        assert unknown[0] == pytest.approx(place(19)[0] + 0.5, abs=0.06)
        assert unknown[-1] < place(90)[0]


class TestPoses:
    @pytest.mark.parametrize('base', ['base_footprint', 'base_link', 'tb3/base_link'])
    def test_without_odometry_they_come_from_the_frames(self, tmp_path, base):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                bag.transforms(stamp, ('/odom', base, x, y, 0.0, 0.0, 0.0, yaw),
                               ('base', 'wheel', 0.0, 0.1, 0.0, 0.0, i / 3, 0.0))
        drive = open_drive(tmp_path / 'bag', GRID)
        np.testing.assert_allclose(xy_of(drive), expected_xy(), atol=1e-12)
        assert drive.notes == (f'poses are those of {base} in odom, from /tf (odom -> {base})',)

    @pytest.mark.parametrize('odometry', [True, False])
    def test_in_the_frame_of_the_map(self, tmp_path, odometry):
        path = robot_bag(tmp_path / 'bag', to_map=True, odometry=odometry)
        drive = open_drive(path, IN_MAP)
        np.testing.assert_allclose(xy_of(drive, 'map'), expected_xy(MAP[:2]), atol=1e-12)
        assert blocked_cells(drive, IN_MAP) == {(3, 10), (3, 11)}
        in_odom = open_drive(path, GRID)
        np.testing.assert_allclose(xy_of(in_odom), expected_xy(), atol=1e-12)

    def test_a_map_that_turns_and_is_corrected_under_way(self, tmp_path):
        def correction(stamp):
            return 0.3 + 0.01 * stamp, -0.2, 0.02 * stamp
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                if i % 3 == 0 and i > 5:
                    dx, dy, turn = correction(stamp)
                    bag.transforms(stamp, ('map', 'odom', dx, dy, 0.0, 0.0, 0.0, turn))
                bag.odometry(stamp, x, y, yaw)
        drive = open_drive(tmp_path / 'bag', IN_MAP)
        expected = []
        for i in range(6, N):
            stamp, x, y, _ = place(min(i, N))
            dx, dy, turn = correction(min(stamp, place(117)[0]))
            c, s = math.cos(turn), math.sin(turn)
            expected.append((dx + c * x - s * y, dy + s * x + c * y))
        np.testing.assert_allclose(xy_of(drive, 'map'), expected, atol=1e-4)
        assert any(note.startswith('6 poses before /tf says anything') for note in drive.notes)

    def test_a_correction_that_falls_silent_is_named(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                if i < 60 and i % 2 == 0:
                    bag.transforms(stamp, ('map', 'odom', 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                bag.odometry(stamp, x, y, yaw)
        [_, note] = open_drive(tmp_path / 'bag', IN_MAP).notes
        assert note.startswith('in the last 3.1 s nothing new is said of odom in map')

    def test_odometry_that_changes_its_frame_under_way_has_no_end(self, tmp_path):
        for name, last in ('half', N), ('few', 62):
            with RobotBag(tmp_path / name) as bag:
                bag.transforms(1.0, ('map', 'odom', 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                for i in range(N):
                    stamp, x, y, yaw = place(i)
                    bag.odometry(stamp, x, y, yaw, frame='ship' if 60 <= i < last else 'odom')
        with pytest.raises(BagError, match=r"half: .* drive ends: its last 60 mess.*in 'odom', t"):
            open_drive(tmp_path / 'half', IN_MAP)
        assert open_drive(tmp_path / 'few', IN_MAP).notes[-1].startswith('2 messages refused: /od')

    def test_a_robot_that_ends_under_another_frame_has_no_end(self, tmp_path):
        for name, odd in ('half', range(70, N)), ('turns', range(1, N, 3)):
            with RobotBag(tmp_path / name) as bag:
                for i in range(N):
                    stamp, x, y, yaw = place(i)
                    parent = 'ship' if i in odd else 'odom'
                    bag.transforms(stamp, (parent, 'base_link', x, y, 0.0, 0.0, 0.0, yaw))
        with pytest.raises(BagError, match=r"its last 50 .* is under 'ship' and not 'odom'"):
            open_drive(tmp_path / 'half', GRID)
        assert len(xy_of(open_drive(tmp_path / 'turns', GRID))) == N - 40

    @pytest.mark.parametrize('every', [2, 20, 60])
    def test_a_correction_that_leaps_is_not_smoothed_by_how_rarely_it_is_said(
            self, tmp_path, every):
        for name, leap in ('leaps', 1.4), ('drifts', 0.12):
            with RobotBag(tmp_path / name) as bag:
                for i in range(N):
                    stamp, x, y, yaw = place(i)
                    if i % every == 0:
                        bag.transforms(stamp, ('map', 'odom', 0.0, leap * (i >= 60), 0.0, 0.0, 0.0,
                                               0.0))
                    bag.transforms(stamp, ('odom', 'base_link', x, y, 0.0, 0.0, 0.0, yaw))
        with pytest.raises(BagError, match=r'at 3\.00 s the pose leaps by 1\.40 m in 0\.05 s'):
            demonstration_from_drive(open_drive(tmp_path / 'leaps', IN_MAP))
        _, report, _ = demonstration_from_drive(open_drive(tmp_path / 'drifts', IN_MAP))
        assert not report.sentences()

    def test_what_the_wheels_did_not_say_is_not_made_of_a_map_that_is_said_oftener(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                bag.transforms(stamp, ('map', 'odom', 0.0, 0.001 * (i % 5), 0.0, 0.0, 0.0, 0.0))
                if i % 3 == 0 and not 40 < i < 80:
                    bag.transforms(stamp, ('odom', 'base_link', x, y, 0.0, 0.0, 0.0, yaw))
        with pytest.raises(BagError, match=r'no pose has come between 1\.95 and 4\.05 s'):
            demonstration_from_drive(open_drive(tmp_path / 'bag', IN_MAP))

    def test_a_robot_that_ends_nowhere_has_no_end(self, tmp_path):
        for name, odd in ('half', range(70, N)), ('few', range(1, 9)):
            with RobotBag(tmp_path / name) as bag:
                for i in range(N):
                    stamp, x, y, yaw = place(i)
                    bag.transforms(stamp, ('odom', 'base_link', math.nan if i in odd else x, y,
                                           0.0, 0.0, 0.0, yaw))
        with pytest.raises(BagError, match=r"its last 50 .* base_link is in 'odom' is no n"):
            open_drive(tmp_path / 'half', GRID)
        assert open_drive(tmp_path / 'few', GRID).notes[-1].startswith('8 transforms of /tf refus')

    def test_a_frame_that_is_not_there_names_those_that_are(self, tmp_path):
        path = robot_bag(tmp_path / 'bag', odometry=False)
        with pytest.raises(BagError, match="not under 'map' but under odom: learn it with --fra"):
            open_drive(path, IN_MAP)
        with pytest.raises(BagError, match='nothing says where wheel is'):
            open_drive(path, GRID, ReadOptions(base_frame='wheel'))
        with RobotBag(tmp_path / 'odd') as bag:
            for i in range(3):
                bag.transforms(1.0 + i, ('odom', 'lorry', float(i), 0.0, 0.0, 0.0, 0.0, 0.0))
        with pytest.raises(BagError, match='there are lorry: name that of the robot with --base'):
            open_drive(tmp_path / 'odd', GRID)
        drive = open_drive(tmp_path / 'odd', GRID, ReadOptions(base_frame='lorry'))
        assert len(xy_of(drive)) == 3

    def test_frames_of_two_robots_are_kept_apart(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                for name, far in (('/a', 0.0), ('/b', 0.5)):
                    bag.transforms(stamp, ('odom', 'base_link', x, y + far, 0.0, 0.0, 0.0, yaw),
                                   topic=f'{name}/tf')
        with pytest.raises(BagError, match=r'which topic is odom\? Name one of /a/tf'):
            open_drive(tmp_path / 'bag', GRID)
        drive = open_drive(tmp_path / 'bag', GRID, ReadOptions({'odom': '/b/tf'}))
        np.testing.assert_allclose(xy_of(drive), expected_xy((0.0, 0.5)), atol=1e-12)

    @pytest.mark.parametrize('with_frames', [True, False])
    def test_a_goal_is_no_place_the_robot_was_at(self, tmp_path, with_frames):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(N):
                stamp, x, y, yaw = place(i)
                if with_frames:
                    bag.transforms(stamp, ('odom', 'base_link', x, y, 0.0, 0.0, 0.0, yaw))
                bag.write('/goal_pose', 'geometry_msgs/msg/PoseStamped', stamp, bag.make(
                    'geometry_msgs/PoseStamped', bag.header(stamp, 'odom'), bag.make(
                        'geometry_msgs/Pose', bag.make('geometry_msgs/Point', 3.0, 3.0, 0.0),
                        bag.make('geometry_msgs/Quaternion', 0.0, 0.0, 0.0, 1.0))))
        if with_frames:
            np.testing.assert_allclose(
                xy_of(open_drive(tmp_path / 'bag', GRID)), expected_xy(), atol=1e-12)
            return
        with pytest.raises(BagError, match=r'no topic is odom, there are /goal_pose'):
            open_drive(tmp_path / 'bag', GRID)

    def test_a_bag_of_ros_1(self, tmp_path):
        path = robot_bag(tmp_path / 'drive.bag', ros1=True, odometry=False, to_map=True)
        for grid, frame, offset, cells in (
                (GRID, 'odom', (0.0, 0.0), {(5, 6), (5, 7)}),
                (IN_MAP, 'map', MAP[:2], {(3, 10), (3, 11)})):
            drive = open_drive(path, grid)
            np.testing.assert_allclose(xy_of(drive, frame), expected_xy(offset), atol=1e-12)
            assert blocked_cells(drive, grid) == cells


unit = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
shifts = st.tuples(*[st.floats(-5.0, 5.0)] * 3)


@st.composite
def motions(draw):
    turn = np.array(draw(unit))
    return Motions(np.array([draw(shifts)]), turn[np.newaxis] / np.linalg.norm(turn))


class TestRigid:
    @given(motions(), motions())
    def test_they_are_matrices(self, first, second):
        np.testing.assert_allclose(
            first.then(second).matrix(), first.matrix() @ second.matrix(), atol=1e-9)
        np.testing.assert_allclose(
            first.inverse().matrix() @ first.matrix(), np.eye(4), atol=1e-9)
        np.testing.assert_allclose(first.then(STILL).matrix(), first.matrix(), atol=1e-12)

    @given(motions(), motions(), st.floats(0.0, 1.0))
    def test_in_between(self, first, second, share):
        both = Motions(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))
        stamps = np.array([1.0, 3.0])
        for stamp, end in ((0.0, first), (1.0, first), (3.0, second), (9.0, second)):
            np.testing.assert_allclose(
                both.between(stamps, np.array([stamp])).matrix(), end.matrix(), atol=1e-9)
        dot = float((first.turn * second.turn).sum())
        found = both.between(stamps, np.array([1.0 + 2.0 * share]))
        if abs(dot) > 0.1:
            assert np.linalg.norm(found.turn) == pytest.approx(1.0)

    @given(motions())
    def test_yaw_is_that_of_what_points_ahead(self, motion):
        x, y, _ = rotated(motion.turn[0], np.array([1.0, 0.0, 0.0]))
        if math.hypot(x, y) > 1e-3:
            turned = math.atan2(y, x) - motion.yaw[0]
            assert math.cos(turned) == pytest.approx(1.0, abs=1e-9)


class TestTransforms:
    def bag(self, tmp_path, message):
        with RobotBag(tmp_path / 'bag') as bag:
            bag.transforms(1.0, ('odom', 'base_link', 1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
            connection = bag.connections['/tf']
            bag.writer.write(connection, 2_000_000_000, message)
        return open_bag(tmp_path / 'bag')

    @settings(max_examples=30, deadline=None)
    @given(data=st.data())
    def test_whatever_stands_in_a_message(self, tmp_path_factory, data):
        raw = b'\0\1\0\0' + struct.pack('<I', data.draw(st.integers(0, 2**32 - 1))) + data.draw(
            st.binary(max_size=200))
        bag = self.bag(tmp_path_factory.mktemp('raw'), raw[:data.draw(st.integers(0, len(raw)))])
        tree = read_transforms(bag, ['/tf'])
        assert 'base_link' in tree.edges

    def test_what_is_no_rotation_is_left_out(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            for i in range(4):
                bag.transforms(1.0 + i, (
                    'odom', 'base_link', math.nan if i == 1 else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        tree = read_transforms(open_bag(tmp_path / 'bag'), ['/tf'])
        assert tree.n_refused == 1
        assert len(tree.edges['base_link'].stamps_ns) == 3

    def test_frames_in_a_circle(self, tmp_path):
        with RobotBag(tmp_path / 'bag') as bag:
            bag.transforms(1.0, *((a, b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) for a, b in (
                ('a', 'b'), ('b', 'c'), ('c', 'a'), ('d', 'd'))))
        tree = read_transforms(open_bag(tmp_path / 'bag'), ['/tf'])
        assert tree.above('a') == ['a', 'c', 'b']
        assert tree.above('d') == ['d']
        assert tree.chain('a', 'odom') is None
