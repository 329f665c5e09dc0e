"""The node that makes neighbourhoods: scans and odometry in, on real topics and in real time."""

import math
import signal

from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from msgs_bridge.messages.neighbourhoods import (
    cells_of_local_grid, grid_from_neighbourhood, map_from_occupancy, neighbourhood_from_grid)
from msgs_bridge.messages.poses import odometry_from_pose, Pose, stamp_from_seconds
from msgs_bridge.node import qos
from neighbourhood_node.neighbourhood import NeighbourhoodMaker, PoseHistory
from neighbourhood_node.node import NeighbourhoodNode
from neighbourhood_node.settings import NeighbourhoodSettings
import ros_helpers

GRID = Grid(20, 20, 0.25)
WORKSPACE = {'rows': 20, 'cols': 20, 'resolution': 0.25}


def odometry(stamp, x=2.625, y=2.625, yaw=0.0, frame_id='odom'):
    return odometry_from_pose(Pose(stamp, x, y, yaw, frame_id=frame_id))


def scan(stamp, wall_x, robot_x=2.625, n=360):
    """Return what a laser in the robot's middle, looking along x, sees of a wall across x."""
    angles = 2.0 * math.pi / n * np.arange(n)
    with np.errstate(divide='ignore'):
        ranges = (wall_x - robot_x) / np.cos(angles)
    msg = LaserScan(angle_min=0.0, angle_max=float(angles[-1]), angle_increment=angles[1],
                    range_min=0.05, range_max=3.5)
    msg.ranges = np.where((ranges < 0.0) | (ranges > 3.5), np.inf, ranges).astype(np.float32)
    msg.header.stamp = stamp_from_seconds(stamp)
    msg.header.frame_id = 'base_scan'
    return msg


class TestMaker:
    def maker(self, **settings):
        return NeighbourhoodMaker(NeighbourhoodSettings(**{**WORKSPACE, **settings}))

    def test_a_wall_ahead(self):
        maker = self.maker()
        maker.update(scan(1.0, 2.8))
        made = maker.neighbourhood(odometry(1.02))
        np.testing.assert_array_equal(made.cells, [[FREE, FREE, BLOCKED]] * 3)
        assert (made.stamp, made.row, made.col) == (1.02, 10, 10)

    def test_the_scan_is_placed_where_the_robot_was_then(self):
        maker = self.maker()
        for k in range(6):
            maker.neighbourhood(odometry(1.0 + 0.05 * k, x=2.4 + 0.05 * k))
        maker.update(scan(1.1, 2.95, robot_x=2.5))
        made = maker.neighbourhood(odometry(1.3, x=2.7))
        np.testing.assert_array_equal(made.cells, [[FREE, FREE, BLOCKED]] * 3)
        made = maker.neighbourhood(odometry(1.35, x=2.76))  # the next cell, the same scan
        assert made.col == 11
        # Of its own cell it says nothing: a wall beside the robot is no reason to stand.
        np.testing.assert_array_equal(made.cells[:, 1], [BLOCKED, FREE, BLOCKED])

    def test_a_scan_that_is_newer_than_odometry_is_placed_anew_when_its_own_comes(self):
        maker = self.maker()
        maker.update(scan(1.2, 3.2, robot_x=2.74))
        made = maker.neighbourhood(odometry(1.15, x=2.5))  # from there the wall were at 2.96
        np.testing.assert_array_equal(made.cells[:, 2], BLOCKED)
        made = maker.neighbourhood(odometry(1.2, x=2.74))
        assert (made.cells[:, 2] != BLOCKED).all()

    def test_settings_count_at_once(self):
        maker = self.maker()
        maker.update(scan(1.0, 3.1))
        assert (maker.neighbourhood(odometry(1.0)).cells[:, 2] == FREE).all()
        maker.settings = NeighbourhoodSettings(**WORKSPACE, robot_radius=0.3)
        assert (maker.neighbourhood(odometry(1.05)).cells[:, 2] == BLOCKED).all()

    @pytest.mark.parametrize(('age', 'said'), [
        (0.6, '0.60 s older'), (-0.6, '0.60 s newer'), (100.0, '100.00 s older')])
    def test_stale_is_unknown(self, age, said):
        maker = self.maker()
        assert not maker.has_seen
        maker.update(scan(200.0, 2.8))
        made = maker.neighbourhood(odometry(200.0 + age))
        assert (made.cells == UNKNOWN).all()
        assert maker.has_seen
        assert maker.problem(made.stamp) == (
            f'scan is {said} than odometry, must be at most 0.5 s: everything is unknown')
        assert (maker.neighbourhood(odometry(200.4)).cells[:, 2] == BLOCKED).all()

    def test_before_the_first_scan_everything_is_unknown(self):
        maker = self.maker()
        assert (maker.neighbourhood(odometry(1.0, 0.1, 0.1)).cells[1:, 1:] == UNKNOWN).all()
        assert maker.problem(1.0) == 'no scan has arrived yet'
        maker.refusal = 'scan: angle_increment is 0'
        assert maker.problem(1.0) == (
            'scan arrives but does not count: scan: angle_increment is 0')

    def test_what_cannot_be_used_leaves_what_was_there(self):
        maker = self.maker()
        maker.update(scan(1.0, 2.8))
        bad = scan(1.1, 9.0)
        bad.angle_increment = math.nan
        with pytest.raises(ValueError, match='angles'):
            maker.update(bad)
        assert (maker.neighbourhood(odometry(1.1)).cells[:, 2] == BLOCKED).all()

    def test_odometry_from_elsewhere(self):
        maker = self.maker()
        with pytest.raises(ValueError, match=r"'r2/odom', must be 'odom' "
                           r"\(set frame_id:=r2/odom of learner_node and neighbourhood_node\)"):
            maker.neighbourhood(odometry(1.0, frame_id='r2/odom'))
        with pytest.raises(ValueError, match=r"'', must be 'odom'$"):
            maker.neighbourhood(odometry(1.0, frame_id=''))
        with pytest.raises(ValueError, match=r'outside the workspace .*\(-1\.00, 2\.62\)'):
            maker.neighbourhood(odometry(1.0, x=-1.0))
        with pytest.raises(ValueError, match='finite'):
            maker.neighbourhood(odometry(1.0, x=math.nan))

    @pytest.mark.parametrize('extent', [{}, {'sight_cells': 9}, {'sight_subdivision': 3}])
    @pytest.mark.parametrize('at', [(0.0, 0.0), (-7.0, 3.0), (400.0, -250.0)])
    def test_without_bounds_the_robot_may_be_anywhere(self, at, extent):
        maker = NeighbourhoodMaker(NeighbourhoodSettings(**extent))
        maker.update(scan(1.0, at[0] + 0.3, robot_x=at[0]))
        made = maker.neighbourhood(odometry(1.0, *at))
        np.testing.assert_array_equal(made.nine, [[FREE, FREE, BLOCKED]] * 3)
        message = grid_from_neighbourhood(made, maker.grid)
        n, k = len(made.cells), extent.get('sight_subdivision', 1)
        assert message.info.width == n * k
        # (0, 0) is the centre of a cell, and so is every multiple of its side.
        middle = cells_of_local_grid(message).world_from_cell(n * k // 2, n * k // 2)
        np.testing.assert_allclose(middle, at, atol=1e-6)

    def test_without_bounds_nothing_is_blocked_that_nobody_has_seen(self):
        maker = NeighbourhoodMaker(NeighbourhoodSettings())
        assert (maker.neighbourhood(odometry(1.0, -3.0, -3.0)).cells == UNKNOWN).all()

    def test_where_no_cells_are_set_those_of_the_others_are_taken(self):
        maker = NeighbourhoodMaker(NeighbourhoodSettings())
        maker.update(scan(1.0, 2.8))
        assert not maker.follow(Grid(20, 20, 0.25, frame_id='map'))
        assert not maker.follow(Grid(20, 30, 0.25, -2.125, -9.125))  # the same
        assert maker.follow(Grid(20, 20, 0.25))
        assert not maker.follow(Grid(20, 20, 0.25))
        made = maker.neighbourhood(odometry(1.02))
        assert neighbourhood_from_grid(
            grid_from_neighbourhood(made, maker.grid), GRID).cells.tolist() == [
                [FREE, FREE, BLOCKED]] * 3
        for settings in ({'resolution': 0.25}, WORKSPACE):
            maker = NeighbourhoodMaker(NeighbourhoodSettings(**settings))
            assert not maker.follow(Grid(20, 20, 0.25, 0.1))

    @pytest.mark.parametrize(('radius', 'side'), [(0.105, 0.25), (0.22, 0.5), (0.175, 0.4)])
    def test_cells_are_as_large_as_the_robot_needs_them(self, radius, side):
        settings = NeighbourhoodSettings(robot_radius=radius)
        assert settings.grid == Grid(1, 1, side, -side / 2, -side / 2)
        assert NeighbourhoodSettings(robot_radius=radius, resolution=0.3).grid.resolution == 0.3
        assert NeighbourhoodSettings(robot_radius=radius, rows=3, cols=4).grid == Grid(3, 4, side)

    def test_a_costmap(self):
        maker = self.maker(source='costmap', lethal_threshold=100)
        states = np.zeros((60, 60), np.int8)
        states[:, 42] = 100
        states[:, 41] = 99
        costmap = map_from_occupancy(states, Grid(60, 60, 0.05, 0.8, 1.1), 1.0)
        maker.update(costmap)
        cells = maker.neighbourhood(odometry(1.1)).cells
        np.testing.assert_array_equal(cells, [[FREE, FREE, BLOCKED]] * 3)
        costmap.header.frame_id = 'map'
        with pytest.raises(ValueError, match="costmap: frame is 'map', must be 'odom'"):
            maker.update(costmap)

    def test_a_costmap_that_is_turned(self):
        maker = self.maker(source='costmap')
        costmap = map_from_occupancy(np.zeros((9, 9), np.int8), Grid(9, 9, 0.05), 1.0)
        costmap.info.origin.orientation.z, costmap.info.origin.orientation.w = 1.0, 0.0
        with pytest.raises(ValueError, match='turned'):
            maker.update(costmap)


def test_the_nearest_pose():
    history = PoseHistory()
    assert history.nearest(1.0) is None
    for k in range(10):
        history.add(Pose(float(k), 0.1 * k, 0.0, 0.0))
    assert [history.nearest(s).stamp for s in (-5.0, 0.4, 0.6, 8.9, 99.0)] == [0, 0, 1, 9, 9]
    history.add(Pose(2.0, 7.0, 0.0, 0.0))  # time went back: what was before is of another run
    assert history.nearest(9.0).x == 7.0


def test_a_costmap_that_is_heard_several_times_is_taken_in_once(ros_node, monkeypatch):
    taken = []
    monkeypatch.setattr(
        NeighbourhoodMaker, 'update', lambda self, msg: taken.append(msg.header.stamp.sec))
    node = NeighbourhoodNode(
        context=ros_node.context, use_global_arguments=False,
        parameter_overrides=[Parameter('source', value='costmap')])
    ros_node.executor.add_node(node)
    states = np.zeros((9, 9), np.int8)
    # Two publishers, so that each of the subscriptions hears something.
    publishers = [ros_node.create_publisher(OccupancyGrid, 'costmap', profile)
                  for profile in (qos.LATCHED, qos.SENSOR)]
    for stamp in (1, 2, 3):
        costmap = map_from_occupancy(states, Grid(9, 9, 0.05), float(stamp))

        def is_taken(stamp=stamp, costmap=costmap):
            for publisher in publishers:
                publisher.publish(costmap)
            return stamp in taken
        ros_helpers.wait_until(is_taken, node=ros_node, what=f'costmap {stamp}')
    node.destroy_node()
    assert taken == [1, 2, 3]


class TestProcess:
    def parts(self, node, kind, topic):
        seen = ros_helpers.collect(node, OccupancyGrid, 'neighbourhood', qos.SENSOR)
        return (node.create_publisher(kind, topic, qos.SENSOR),
                node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB), seen)

    def test_scans_in_neighbourhoods_out(self, ros_node, tmp_path):
        scans, poses, seen = self.parts(ros_node, LaserScan, 'scan')
        process = ros_helpers.start_node('neighbourhood_node.node', tmp_path, WORKSPACE)
        with process:
            stamp = 10.0

            def expect(cells, x=2.625, send=True):
                nonlocal stamp
                stamp += 0.05
                if send:
                    scans.publish(scan(stamp, 2.8, robot_x=x))
                poses.publish(odometry(stamp, x=x))
                return seen and (neighbourhood_from_grid(seen[-1], GRID).cells == cells).all()

            for x, send, cells in (
                    (2.625, True, [[FREE, FREE, BLOCKED]] * 3),
                    (2.4, True, [[FREE, FREE, FREE]] * 3),
                    (2.625, False, [[UNKNOWN] * 3] * 3)):
                ros_helpers.wait_until(
                    lambda x=x, send=send, cells=cells: expect(np.array(cells), x, send),
                    node=ros_node, processes=[process], what=f'{cells}')
            bad = scan(stamp, 2.8)
            bad.ranges = [1.0] * 7
            ros_helpers.wait_until(
                lambda: scans.publish(bad) or 'has 7 ranges, must have 360' in process.stderr,
                node=ros_node, processes=[process], what='the refusal')
        # Older or newer: which of two queues runs ahead of the other is up to the machine's load.
        assert 'than odometry, must be at most 0.5 s: everything is unknown' in process.stderr
        assert 'Traceback' not in process.stderr

    def test_what_was_missing_is_said_to_be_back_as_often_as_it_was_said_to_be_missing(
            self, ros_node, tmp_path):
        scans, poses, _ = self.parts(ros_node, LaserScan, 'scan')
        back = 'scan has come, all is well'
        with ros_helpers.start_node('neighbourhood_node.node', tmp_path) as process:
            def until(words, n, scan_stamp, stamp):
                def is_said():
                    if scan_stamp:
                        scans.publish(scan(scan_stamp, 2.8))
                    poses.publish(odometry(stamp))
                    return process.stderr.count(words) == n
                ros_helpers.wait_until(
                    is_said, node=ros_node, processes=[process], what=f'{words}, {n} times')

            until('no scan has arrived', 1, None, 10.0)
            until(back, 1, 10.0, 10.0)
            until('2.00 s older than odometry', 1, 10.0, 12.0)
            until(back, 2, 12.0, 12.0)

    def test_a_costmap_in_a_namespace(self, ros_node, tmp_path):
        seen = ros_helpers.collect(ros_node, OccupancyGrid, 'a/neighbourhood', qos.SENSOR)
        costmaps = ros_node.create_publisher(OccupancyGrid, 'a/costmap', qos.LATCHED)
        poses = ros_node.create_publisher(Odometry, 'a/odom', qos.ODOMETRY_PUB)
        states = np.zeros((60, 60), np.int8)
        states[:, 42] = 100
        costmaps.publish(map_from_occupancy(states, Grid(60, 60, 0.05, 0.8, 1.1), 1.0))
        process = ros_helpers.start_node(
            'neighbourhood_node.node', tmp_path, {**WORKSPACE, 'source': 'costmap'},
            namespace='/a')

        def is_seen():
            costmaps.publish(map_from_occupancy(states, Grid(60, 60, 0.05, 0.8, 1.1), 1.0))
            poses.publish(odometry(1.1))
            return seen and (neighbourhood_from_grid(seen[-1], GRID).cells
                             == [FREE, FREE, BLOCKED]).all()
        with process:
            ros_helpers.wait_until(
                is_seen, node=ros_node, processes=[process], what='the neighbourhood')

    def test_every_large_costmap_arrives_and_small_ones_over_best_effort_too(
            self, ros_node, tmp_path):
        """Costmaps of 4 MB, each sent once: best effort loses nearly all of them."""
        _, poses, seen = self.parts(ros_node, LaserScan, 'scan')
        latched = ros_node.create_publisher(OccupancyGrid, 'costmap', qos.LATCHED)
        lossy = ros_node.create_publisher(OccupancyGrid, 'costmap', qos.SENSOR)
        states, n = np.zeros((2000, 2000), np.int8), 0
        process = ros_helpers.start_node(
            'neighbourhood_node.node', tmp_path, {**WORKSPACE, 'source': 'costmap'})

        def is_seen(stamp, column):
            poses.publish(odometry(stamp))
            return seen and neighbourhood_from_grid(
                seen[-1], GRID).cells[0].tolist() == [BLOCKED * (column == k) for k in range(3)]
        with process:
            ros_helpers.wait_until(
                lambda: latched.get_subscription_count() == 3, node=ros_node, what='the node')
            for publisher, size in (*[(latched, 2000)] * 6, (lossy, 60), (lossy, 60)):
                stamp, column, states[:] = 10.0 + n, n % 3, 0
                states[:, 48 + 5 * column] = 100
                costmap = map_from_occupancy(
                    states[:size, :size], Grid(size, size, 0.05, 0.0, 1.1), stamp)
                publisher.publish(costmap)
                ros_helpers.wait_until(
                    lambda s=stamp, c=column: is_seen(s, c), node=ros_node, processes=[process],
                    what=f'costmap {n}')
                n += 1

    @pytest.mark.parametrize(('parameter', 'word'), [
        ('source:=sonar', 'scan, costmap'), ('timeout:=0.0', 'timeout'),
        ('rows:=20', 'leave both out'), ('origin_x:=1.0', 'leave the origin out'),
        ('resolution:=0.001', 'resolution is 0.001'), ('laser_yaw:=9.0', 'laser_yaw'),
        ('laser_roll:=1.0', 'tilted by 57 degrees')])
    def test_mistakes_are_one_line_and_exit_code_2(self, quiet_domain, tmp_path, parameter, word):
        command = ros_helpers.node_command('neighbourhood_node.node', tmp_path)
        process = ros_helpers.run([*command, '--ros-args', '-p', parameter], tmp_path)
        assert process.popen.returncode == 2
        line, = process.stderr.splitlines()
        assert line.startswith('neighbourhood_node: ')
        assert word in line

    @pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
    def test_signals_end_it_well(self, ros_node, tmp_path, number):
        poses = ros_node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
        with ros_helpers.start_node('neighbourhood_node.node', tmp_path) as process:
            ros_helpers.wait_until(poses.get_subscription_count, node=ros_node, what='the node')
            process.stop(number)
            assert [line for line in process.stderr.splitlines() if '[INFO]' not in line] == []
