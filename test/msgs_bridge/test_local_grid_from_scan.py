"""Neighbourhoods from laser scans: worlds whose returns are known in closed form."""

import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from control_field.poses import Placement
from control_field.robot.footprint import footprint_from_text
from msgs_bridge.messages.poses import stamp_from_seconds
from msgs_bridge.sensing.laser_mount import MAX_TILT, Mount, mount_from_transform
from msgs_bridge.sensing.local_grid_from_scan import Body, neighbourhood_from_scan
from msgs_bridge.sensing.scan import Scan, scan_from_message

GRID = Grid(20, 20, 0.25)
CELL = (10, 10)
CENTRE = GRID.world_from_cell(*CELL)
BURGER = Body(0.105)
ON_CENTRE = Mount()
N_RAYS = 720


def placed(x=0.0, y=0.0, yaw=0.0):
    """Return a placement relative to the centre of the middle cell."""
    return Placement(CENTRE[0] + x, CENTRE[1] + y, yaw)


def message(ranges, *, low=0.05, high=3.5, first=-math.pi, step=None, stamp=1.0):
    step = 2.0 * math.pi / len(ranges) if step is None else step
    msg = LaserScan(angle_min=first, angle_max=first + step * (len(ranges) - 1),
                    angle_increment=step, range_min=low, range_max=high)
    msg.ranges = [float(r) for r in ranges]
    msg.header.stamp = stamp_from_seconds(stamp)
    return msg


def boxes_scan(eye, boxes, n=N_RAYS, high=3.5, noise=None):
    """Cast rays from ``eye`` at axis-aligned boxes (x_low, y_low, x_high, y_high)."""
    angles = eye.yaw - math.pi + 2.0 * math.pi / n * np.arange(n)
    direction = np.stack([np.cos(angles), np.sin(angles)])
    best = np.full(n, math.inf)
    with np.errstate(divide='ignore', invalid='ignore'):
        for box in boxes:
            ends = [(np.array(end) - eye[:2])[:, np.newaxis] / direction
                    for end in (box[:2], box[2:])]
            enter, leave = np.minimum(*ends).max(axis=0), np.maximum(*ends).min(axis=0)
            best = np.where((enter <= leave) & (enter > 0.0), np.minimum(best, enter), best)
    if noise is not None:
        best = best + noise * np.random.default_rng(0).standard_normal(n)
    return scan_from_message(message(np.where(best > high, math.inf, best), high=high))


def box_of(row, col):
    x, y = GRID.world_from_cell(row, col)
    return x - 0.125, y - 0.125, x + 0.125, y + 0.125


def seen(scan, robot, laser=ON_CENTRE, cell=CELL, body=BURGER, grid=GRID):
    return neighbourhood_from_scan(scan, robot, laser, cell, grid, body)


class TestWalls:
    @pytest.mark.parametrize('turn', range(4))
    def test_a_wall_in_the_next_column_blocks_that_column(self, turn):
        # A wall whose face is 0.2 m before the robot, in the middle of the next column.
        c, s = round(math.cos(turn * math.pi / 2)), round(math.sin(turn * math.pi / 2))
        corners = [(0.2 * c - y * s, 0.2 * s + y * c) for y in (-3.0, 3.0)]
        corners += [(3.0 * c - y * s, 3.0 * s + y * c) for y in (-3.0, 3.0)]
        xs, ys = zip(*corners, strict=True)
        box = (CENTRE[0] + min(xs), CENTRE[1] + min(ys), CENTRE[0] + max(xs), CENTRE[1] + max(ys))
        expected = np.zeros((3, 3), dtype=np.int8)
        expected[:, 2] = BLOCKED
        expected = np.rot90(expected, -turn)  # rows grow upwards
        np.testing.assert_array_equal(seen(boxes_scan(placed(), [box]), placed()), expected)

    @given(st.floats(0.13, 0.35), st.floats(-math.pi, math.pi))
    def test_the_wall_blocks_the_column_it_lies_in_wherever_the_robot_looks(self, x, yaw):
        box = (CENTRE[0] + x, -9.0, CENTRE[0] + 9.0, 9.0)
        cells = seen(boxes_scan(placed(yaw=yaw), [box]), placed(yaw=yaw))
        assert (cells[:, 2] == BLOCKED).all()
        assert (cells[:, :2] == FREE).all()

    @given(st.floats(0.39, 3.0))
    def test_a_wall_farther_away_blocks_nothing(self, x):
        box = (CENTRE[0] + x, -9.0, CENTRE[0] + 9.0, 9.0)
        assert (seen(boxes_scan(placed(), [box]), placed()) == FREE).all()

    @pytest.mark.parametrize('radius', [0.13, 0.17, 0.2])
    def test_a_wide_robot_would_touch_it_from_the_cell_before(self, radius):
        box = (CENTRE[0] + 0.375, -9.0, CENTRE[0] + 9.0, 9.0)
        cells = seen(boxes_scan(placed(-0.1), [box]), placed(-0.1), body=Body(radius, 0.0))
        assert (cells[:, 2] == BLOCKED).all()
        assert (cells[:, :2] == FREE).all()

    def test_what_is_behind_a_wall_is_unknown(self):
        near = [box_of(10, 11), box_of(9, 11), box_of(11, 11)]
        robot = placed(-0.25)
        cells = seen(boxes_scan(robot, near), robot, cell=(10, 11))
        np.testing.assert_array_equal(cells[:, 0], FREE)
        np.testing.assert_array_equal(cells[:, 1], BLOCKED)
        np.testing.assert_array_equal(cells[:, 2], UNKNOWN)

    @pytest.mark.parametrize('noise', [0.005, 0.01])
    def test_noise_does_not_move_walls_that_lie_on_edges(self, noise):
        walls = [box_of(row, 11) for row in range(7, 14)]
        for x in (-0.05, 0.0, 0.02):
            scan = boxes_scan(placed(x), walls, noise=min(noise, 0.006 + noise / 10))
            cells = seen(scan, placed(x), body=Body(0.105, 0.03))
            assert (cells[:, 2] == BLOCKED).all()
            assert (cells[:, :2] == FREE).all()

    def test_a_segment_of_a_chair_blocks_its_cell(self):
        segment = (CENTRE[0] + 0.2, CENTRE[1] + 0.2, CENTRE[0] + 0.22, CENTRE[1] + 0.22)
        expected = np.zeros((3, 3), dtype=np.int8)
        expected[2, 2] = BLOCKED
        np.testing.assert_array_equal(seen(boxes_scan(placed(), [segment]), placed()), expected)

    def test_a_thin_pole_on_a_corner_is_not_overlooked(self):
        x, y = CENTRE[0] + 0.125, CENTRE[1] + 0.125
        pole = (x - 0.003, y - 0.003, x + 0.003, y + 0.003)
        cells = seen(boxes_scan(placed(), [pole]), placed())
        assert (cells == BLOCKED).sum() >= 1
        assert cells[1, 1] != BLOCKED


@st.composite
def worlds(draw):
    """Cells of 7 x 7 that are occupied, and a laser somewhere in the free cell in the middle."""
    bits = draw(st.lists(st.booleans(), min_size=49, max_size=49))
    occupied = np.array(bits).reshape(7, 7)
    occupied[3, 3] = False
    where = st.floats(-0.12, 0.12)
    return occupied, draw(where), draw(where), draw(st.floats(-math.pi, math.pi))


class TestGridWorlds:
    def look(self, world):
        occupied, x, y, yaw = world
        robot = placed(x, y, yaw)
        boxes = [box_of(CELL[0] - 3 + i, CELL[1] - 3 + j) for i, j in np.argwhere(occupied)]
        truth = occupied[2:5, 2:5]
        return seen(boxes_scan(robot, boxes), robot, body=Body(0.0, 0.005)), truth

    @settings(max_examples=300)
    @given(worlds())
    def test_what_is_said_is_true(self, world):
        cells, truth = self.look(world)
        assert not (cells[truth] == FREE).any()
        assert not (cells[~truth] == BLOCKED).any()

    @given(worlds())
    def test_what_is_right_beside_the_robot_is_seen(self, world):
        cells, truth = self.look(world)
        for place in ((0, 1), (1, 0), (1, 2), (2, 1)):
            assert cells[place] == (BLOCKED if truth[place] else FREE)

    @given(worlds(), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-3.0, 3.0))
    def test_where_the_laser_sits_makes_no_difference(self, world, x, y, yaw):
        occupied, eye_x, eye_y, eye_yaw = world
        boxes = [box_of(CELL[0] - 3 + i, CELL[1] - 3 + j) for i, j in np.argwhere(occupied)]
        eye = placed(eye_x, eye_y, eye_yaw)
        scan, body = boxes_scan(eye, boxes), Body(0.0, 0.005)
        c, s = math.cos(eye_yaw - yaw), math.sin(eye_yaw - yaw)
        robot = Placement(eye.x - c * x + s * y, eye.y - s * x - c * y, eye_yaw - yaw)
        np.testing.assert_array_equal(
            seen(scan, robot, Mount(x, y, yaw), body=body), seen(scan, eye, body=body))

    @given(worlds())
    def test_a_laser_that_turns_clockwise_sees_the_same(self, world):
        occupied, x, y, yaw = world
        robot = placed(x, y, yaw)
        boxes = [box_of(CELL[0] - 3 + i, CELL[1] - 3 + j) for i, j in np.argwhere(occupied)]
        scan = boxes_scan(robot, boxes)
        last = scan.angle_min + (len(scan.reach) - 1) * scan.angle_increment
        back = Scan(scan.stamp, last, -scan.angle_increment, scan.reach[::-1],
                    scan.is_return[::-1])
        np.testing.assert_array_equal(seen(back, robot), seen(scan, robot))


class TestRanges:
    """What REP-117 says about each kind of value."""

    def cells(self, ranges, **options):
        names = {'low', 'high', 'first', 'step'}
        shape = {key: value for key, value in options.items() if key in names}
        rest = {key: value for key, value in options.items() if key not in names}
        return seen(scan_from_message(message(ranges, **shape), **rest), placed())

    def test_no_return_is_free_up_to_the_greatest_range(self):
        assert (self.cells([math.inf] * 360) == FREE).all()
        short = self.cells([math.inf] * 360, high=0.3)
        np.testing.assert_array_equal(
            short, [[UNKNOWN, FREE, UNKNOWN], [FREE] * 3, [UNKNOWN, FREE, UNKNOWN]])

    @pytest.mark.parametrize('value', [math.nan, 0.0, 0.01, -1.0, 4.0, 1e30])
    def test_what_is_no_measurement_says_nothing(self, value):
        cells = self.cells([value] * 360)
        assert cells[1, 1] == FREE  # the robot stands there
        assert (np.delete(cells.ravel(), 4) == UNKNOWN).all()

    def test_zeros_of_drivers_that_mean_no_return(self):
        assert (self.cells([0.0] * 360, zero_is_no_return=True) == FREE).all()

    def test_what_is_too_near_to_measure_is_where_measuring_begins(self):
        ranges = [math.inf] * 360
        ranges[180] = -math.inf  # straight ahead
        expected = np.zeros((3, 3), dtype=np.int8)
        expected[1, 2] = BLOCKED
        np.testing.assert_array_equal(self.cells(ranges, low=0.15), expected)

    def test_returns_within_the_body_are_its_own_parts(self):
        assert (self.cells([0.1] * 360) != BLOCKED).all()

    def test_what_stands_beside_a_long_body_is_none_of_its_parts(self):
        body = footprint_from_text('[[0.3, 0.1], [-0.3, 0.1], [-0.3, -0.1], [0.3, -0.1]]')
        pole = [(CENTRE[0] - 0.02, CENTRE[1] + 0.15, CENTRE[0] + 0.02, CENTRE[1] + 0.2)]
        for yaw, blocked in ((0.0, True), (math.pi / 2, False)):
            robot = placed(yaw=yaw)
            for radius, footprint in ((0.0, body), (0.32, None)):
                cells = seen(boxes_scan(robot, pole), robot, body=Body(
                    radius, footprint=footprint))
                assert (cells[2, 1] == BLOCKED) == (blocked and footprint is not None)

    def test_a_scanner_that_looks_ahead_only_knows_nothing_of_what_is_behind(self):
        n = 181
        cells = self.cells([math.inf] * n, first=-math.pi / 2, step=math.pi / (n - 1))
        np.testing.assert_array_equal(cells[:, 2], FREE)
        np.testing.assert_array_equal(cells[:, 0], UNKNOWN)

    @given(st.lists(st.floats(width=32), min_size=1, max_size=400), st.floats(-10.0, 10.0))
    def test_any_ranges_give_a_neighbourhood(self, ranges, yaw):
        scan = scan_from_message(message(ranges))
        cells = seen(scan, placed(yaw=yaw))
        assert cells.dtype == np.int8
        assert set(cells.ravel().tolist()) <= {FREE, BLOCKED, UNKNOWN}


class TestWorkspace:
    @pytest.mark.parametrize('cell', [(0, 0), (0, 5), (19, 19), (7, 19), (-1, 3), (40, 40)])
    def test_what_lies_outside_is_blocked(self, cell):
        x, y = GRID.world_from_cell(*cell)
        cells = seen(scan_from_message(message([math.inf] * 360)), Placement(x, y, 0.0), cell=cell)
        for i in range(3):
            for j in range(3):
                inside = GRID.contains(cell[0] - 1 + i, cell[1] - 1 + j)
                assert cells[i, j] == (FREE if inside else BLOCKED)

    @given(st.integers(-50, 50), st.integers(-50, 50), st.floats(0.05, 2.0))
    def test_moving_and_scaling_everything_changes_nothing(self, d_row, d_col, side):
        walls = [box_of(10, 11), box_of(11, 9)]
        robot = placed(0.01, -0.02, 0.3)
        scan = boxes_scan(robot, walls)
        scale = side / GRID.resolution
        assume(3.5 * scale > 0.05)
        grid = Grid(20, 20, side, d_col * side, d_row * side)
        moved = Placement(
            robot.x * scale + d_col * side, robot.y * scale + d_row * side, robot.yaw)
        larger = Scan(scan.stamp, scan.angle_min, scan.angle_increment, scan.reach * scale,
                      scan.is_return)
        body = Body(0.105 * scale, 0.01 * scale)
        np.testing.assert_array_equal(
            seen(larger, moved, body=body, grid=grid), seen(scan, robot, body=Body(0.105, 0.01)))


class TestHostileScans:
    def good(self):
        return message([1.0] * 360)

    @pytest.mark.parametrize(('field', 'value', 'word'), [
        ('angle_min', math.nan, 'finite'), ('angle_max', math.inf, 'finite'),
        ('angle_increment', 0.0, 'more than 0'), ('angle_increment', math.nan, 'finite'),
        ('angle_increment', 1.0, '360 ranges, must have'), ('angle_max', 30.0, 'ranges'),
        ('range_min', math.nan, 'ranges reach'), ('range_min', -1.0, 'ranges reach'),
        ('range_max', 0.0, 'ranges reach'), ('range_max', math.nan, 'ranges reach'),
        ('range_min', math.inf, 'ranges reach'), ('ranges', [], '0 ranges'),
        ('ranges', [1.0] * 200, '200 ranges, must have 360'),
        ('ranges', [1.0] * 100_001, '100001 ranges')])
    def test_are_refused_with_what_is_wrong(self, field, value, word):
        msg = self.good()
        setattr(msg, field, value)
        with pytest.raises(ValueError, match=word):
            scan_from_message(msg)

    def test_more_than_a_turn(self):
        msg = message([1.0] * 400, step=math.tau / 360)
        with pytest.raises(ValueError, match='turns by'):
            scan_from_message(msg)

    def test_a_stamp_that_is_none(self):
        msg = self.good()
        msg.header.stamp.sec = -3
        with pytest.raises(ValueError, match='scan: stamp'):
            scan_from_message(msg)

    @pytest.mark.parametrize('n', [358, 359, 361, 362])
    def test_a_range_more_or_less_is_what_drivers_do(self, n):
        msg = self.good()
        msg.angle_increment = math.tau / 360
        msg.angle_min, msg.angle_max = 0.0, math.tau - math.tau / 360
        msg.ranges = [1.0] * n
        assert len(scan_from_message(msg).reach) == n


@pytest.mark.parametrize('direction', [1, -1])
@pytest.mark.parametrize(('n', 'unknown'), [(360, 0), (72, 0), (36, 0), (8, 4), (5, 8), (1, 8)])
def test_what_lies_between_rays_far_apart_is_unknown(n, unknown, direction):
    step = direction * math.tau / n
    scan = scan_from_message(message([math.inf] * n, first=0.0, step=step))
    cells = seen(scan, placed())
    assert cells[1, 1] == FREE
    assert (cells == UNKNOWN).sum() == unknown, cells
    assert set(cells.ravel().tolist()) <= {FREE, UNKNOWN}


@pytest.mark.parametrize('step', [1e-45, -1e-45, 1e-30])
def test_rays_that_all_point_one_way(step):
    msg = LaserScan(angle_min=0.5, angle_max=0.5, angle_increment=step, range_min=0.1,
                    range_max=5.0, ranges=[1.0])
    cells = neighbourhood_from_scan(
        scan_from_message(msg), placed(), ON_CENTRE, CELL, GRID, BURGER)
    assert cells[1, 1] == FREE


def turned(roll=0.0, pitch=0.0, yaw=0.0, z=0.0):
    return Mount(0.0, 0.0, yaw, z, roll, pitch)


def scan_of_mounted(mount, boxes, n=N_RAYS, high=3.5):
    """Cast the rays of a laser in the robot's middle, in its own plane, at walls without end."""
    angles = -math.pi + 2.0 * math.pi / n * np.arange(n)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ mount.rotation[:2, :2].T
    best = np.full(n, math.inf)
    with np.errstate(divide='ignore', invalid='ignore'):
        for box in boxes:
            ends = [(np.array(end) - CENTRE) / rays for end in (box[:2], box[2:])]
            enter, leave = np.minimum(*ends).max(axis=1), np.maximum(*ends).min(axis=1)
            best = np.where((enter <= leave) & (enter > 0.0), np.minimum(best, enter), best)
    return scan_from_message(message(np.where(best > high, math.inf, best), high=high))


class TestMount:
    @pytest.mark.parametrize('mount', [
        turned(math.pi), turned(-math.pi), turned(0.0, math.pi), turned(math.pi, 0.0, 2.0),
        turned(math.pi + 0.1, 0.1, -1.0), turned(0.12, -0.1, 0.5), turned(0.0, 0.17),
        turned(math.pi, math.pi, 1.0)], ids=str)
    @pytest.mark.parametrize('side', [(11, 10), (9, 10), (10, 11), (11, 9)])
    def test_however_it_is_turned_it_sees_what_is_there(self, mount, side):
        x, y = GRID.world_from_cell(*side)
        box = x - 0.08, y - 0.08, x + 0.08, y + 0.08
        scan = scan_of_mounted(mount, [box])
        expected = seen(boxes_scan(placed(), [box]), placed())
        assert np.argwhere(expected == BLOCKED).tolist() == [[side[0] - 9, side[1] - 9]]
        np.testing.assert_array_equal(seen(scan, placed(), mount), expected)

    def test_upside_down_left_is_right(self):
        scan = boxes_scan(placed(), [box_of(11, 10)])
        np.testing.assert_array_equal(
            seen(scan, placed(), turned(math.pi)), seen(scan, placed())[::-1])

    def test_the_range_in_the_plane_is_that_of_the_ray_projected(self):
        # Of 0.147 m straight ahead and 10 degrees down 0.1448 m are left: the edge is at 0.145.
        scan = scan_from_message(
            message(np.where(np.arange(360) == 180, 0.147, math.inf)))
        where, exact = placed(-0.27), Body(0.0, 0.0)
        level = seen(scan, where, cell=(10, 9), body=exact)
        tilted = seen(scan, where, turned(0.0, MAX_TILT), cell=(10, 9), body=exact)
        assert np.argwhere(level == BLOCKED).tolist() == [[1, 2]]
        assert np.argwhere(tilted == BLOCKED).tolist() == [[1, 1]]

    @pytest.mark.parametrize('mount', [
        turned(0.3), turned(0.0, -0.3), turned(math.pi / 2), turned(math.pi - 0.3), turned(2.0)])
    def test_tilted_too_far_is_refused(self, mount):
        with pytest.raises(ValueError, match=r'the laser is tilted by \d+ degrees .* at most 10'):
            seen(boxes_scan(placed(), []), placed(), mount)

    def test_the_floor_is_no_obstacle_where_the_height_is_known(self):
        mount = turned(0.0, MAX_TILT, z=0.05)
        # The floor is met 0.05 / sin(10 degrees) = 0.29 m ahead.
        scan = scan_from_message(message(np.where(np.arange(360) == 180, 0.28, math.inf)))
        assert (seen(scan, placed(), mount) == FREE).all()
        assert (seen(scan, placed(), mount._replace(z=0.0)) == BLOCKED).sum() == 1

    @given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
    def test_there_and_back(self, roll, pitch, yaw):
        mount = Mount(0.1, -0.2, yaw, 0.3, roll, pitch)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = mount.rotation, (0.1, -0.2, 0.3)
        np.testing.assert_allclose(mount_from_transform(matrix), mount, atol=1e-9)
        np.testing.assert_allclose(mount.rotation @ mount.rotation.T, np.eye(3), atol=1e-12)
