"""The robot: arcs against closed forms, no tunnelling, slip that is seeded."""

import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
import pytest

from control_field.grid import Grid
from sim_node.robot import arc, Body, Placement, Robot, time_to_contact, towards, Wheels
from world_maps.clearance import Clearance
from world_maps.world import World

RADIUS = 0.105
angles = st.floats(-3.1, 3.1)
places = st.builds(Placement, st.floats(-5, 5), st.floats(-5, 5), angles)
speeds = st.floats(-0.22, 0.22)
turn_rates = st.floats(-2.84, 2.84)
seconds = st.floats(0.0, 2.0)
worlds = arrays(np.int8, (8, 9), elements=st.sampled_from([0, 0, 0, 100])).map(
    lambda cells: World(Grid(8, 9, 0.25, -1.0, 0.5), cells))


def open_world(n_rows=20, n_cols=20, blocked=()):
    cells = np.zeros((n_rows, n_cols), dtype=np.int8)
    for cell in blocked:
        cells[cell] = 100
    return World(Grid(n_rows, n_cols, 0.25), cells)


def rng(seed=0):
    return np.random.default_rng(seed)


def angle_between(first, second):
    return abs(math.remainder(first - second, math.tau))


def overlap(world, x, y):
    """Return how deep the disc is in the nearest blocked cell or wall, by brute force."""
    grid = world.grid
    low = np.array([grid.origin_x, grid.origin_y])
    high = low + np.array([grid.n_cols, grid.n_rows]) * grid.resolution
    distances = [x - low[0], y - low[1], high[0] - x, high[1] - y]
    for row, col in np.argwhere(world.occupancy):
        corner = low + np.array([col, row]) * grid.resolution
        nearest = np.clip([x, y], corner, corner + grid.resolution)
        distances.append(math.dist((x, y), nearest))
    return RADIUS - min(distances)


class TestArc:
    @given(places, speeds, seconds)
    def test_straight_on(self, start, v, t):
        end = arc(start, v, 0.0, t)
        assert end.x == pytest.approx(start.x + v * t * math.cos(start.yaw), abs=1e-12)
        assert end.y == pytest.approx(start.y + v * t * math.sin(start.yaw), abs=1e-12)
        assert angle_between(end.yaw, start.yaw) < 1e-12

    @given(places, speeds, turn_rates.filter(lambda w: abs(w) > 1e-2), seconds)
    def test_on_a_circle(self, start, v, w, t):
        end = arc(start, v, w, t)
        r = v / w
        assert end.x == pytest.approx(
            start.x + r * (math.sin(start.yaw + w * t) - math.sin(start.yaw)), abs=1e-9)
        assert end.y == pytest.approx(
            start.y - r * (math.cos(start.yaw + w * t) - math.cos(start.yaw)), abs=1e-9)
        assert angle_between(end.yaw, start.yaw + w * t) < 1e-9

    @given(places, speeds, st.floats(-1e-3, 1e-3), seconds)
    @example(Placement(0.0, 0.0, 0.0), 0.22, 1e-4 * (1 + 1e-9), 2.0)
    @example(Placement(0.0, 0.0, 0.0), 0.22, 1e-4 * (1 - 1e-9), 2.0)
    def test_hardly_turning_loses_no_digits(self, start, v, w, t):
        # Simpson's rule over the exact heading is good to (w t)^4 here.
        def direction(s):
            return np.array([math.cos(start.yaw + w * s), math.sin(start.yaw + w * s)])
        expected = v * t / 6 * (direction(0) + 4 * direction(t / 2) + direction(t))
        end = arc(start, v, w, t)
        np.testing.assert_allclose(
            [end.x - start.x, end.y - start.y], expected, rtol=0, atol=1e-14)

    @given(places, speeds, turn_rates, seconds, st.floats(0, 1))
    def test_two_parts_are_the_whole(self, start, v, w, t, share):
        whole = arc(start, v, w, t)
        parts = arc(arc(start, v, w, share * t), v, w, (1 - share) * t)
        assert parts.x == pytest.approx(whole.x, abs=1e-12)
        assert parts.y == pytest.approx(whole.y, abs=1e-12)
        assert angle_between(parts.yaw, whole.yaw) < 1e-12

    @given(places, speeds, turn_rates, seconds)
    def test_back_again(self, start, v, w, t):
        end = arc(arc(start, v, w, t), -v, -w, t)
        assert math.dist(end[:2], start[:2]) < 1e-12
        assert angle_between(end.yaw, start.yaw) < 1e-12

    def test_a_full_circle_ends_where_it_began(self):
        start = Placement(1.0, 2.0, 0.5)
        end = arc(start, 0.2, 1.0, math.tau)
        assert math.dist(end[:2], start[:2]) < 1e-15
        assert end.yaw == pytest.approx(0.5)


class TestClearance:
    @given(worlds, st.floats(-1.3, 1.5), st.floats(0.2, 2.8))
    def test_is_the_brute_force_distance_up_to_its_horizon(self, world, x, y):
        expected = min(-overlap(world, x, y), 0.05)
        assert Clearance(world, RADIUS).at(x, y) == pytest.approx(expected, abs=1e-12)

    @given(worlds, st.floats(-1, 1), st.floats(0.6, 2.4), st.floats(-0.1, 0.1),
           st.floats(-0.1, 0.1))
    def test_does_not_change_faster_than_one_moves(self, world, x, y, dx, dy):
        clearance = Clearance(world, RADIUS)
        change = abs(clearance.at(x + dx, y + dy) - clearance.at(x, y))
        assert change <= math.hypot(dx, dy) + 1e-12

    def test_far_outside_is_deep_in_the_wall(self):
        clearance = Clearance(open_world(), RADIUS)
        assert clearance.at(-100.0, 1.0) == -100.0 - RADIUS
        assert clearance.at(1e9, 1e9) < -1e8


class TestContact:
    def test_wall_ahead_is_touched_where_it_is(self):
        clearance = Clearance(open_world(), RADIUS)
        free, touches = time_to_contact(Placement(4.5, 2.5, 0.0), 0.2, 0.0, 10.0, clearance)
        assert touches
        assert 4.5 + 0.2 * free == pytest.approx(5.0 - RADIUS, abs=1e-7)

    def test_block_ahead_and_behind(self):
        clearance = Clearance(open_world(blocked=[(10, 12), (10, 7)]), RADIUS)
        start = Placement(2.5, 2.625, 0.0)
        for v, edge in ((0.2, 3.0 - RADIUS), (-0.2, 2.0 + RADIUS)):
            free, touches = time_to_contact(start, v, 0.0, 10.0, clearance)
            assert touches
            assert start.x + v * free == pytest.approx(edge, abs=1e-7)

    def test_a_corner_is_touched_by_the_side_of_the_disc(self):
        # The disc passes the corner at (3, 2.5) with its centre 0.06 m beside it.
        clearance = Clearance(open_world(blocked=[(9, 12)]), RADIUS)
        free, touches = time_to_contact(
            Placement(2.0, 2.56, 0.0), 0.2, 0.0, 10.0, clearance)
        assert touches
        assert 2.0 + 0.2 * free == pytest.approx(3.0 - math.sqrt(RADIUS**2 - 0.06**2), abs=1e-6)

    def test_turning_on_the_spot_touches_nothing_and_standing_neither(self):
        clearance = Clearance(open_world(), RADIUS)
        for w in (0.0, 2.0):
            assert time_to_contact(
                Placement(RADIUS, 1.0, 0.0), 0.0, w, 1.0, clearance) == (1.0, False)

    @given(worlds, st.integers(0, 2**32 - 1),
           st.lists(st.tuples(st.floats(-1, 1), st.floats(-4, 4)), min_size=5, max_size=40),
           st.sampled_from([0.01, 0.05, 0.5, 2.0]))
    @settings(max_examples=150)
    def test_no_command_ever_drives_into_anything(self, world, seed, commands, tick):
        clearance, random = Clearance(world, RADIUS), rng(seed)
        free = [world.grid.world_from_cell(*cell) for cell in np.argwhere(world.occupancy == 0)]
        if not free:
            return
        x, y = free[random.integers(len(free))]
        robot = Robot(Body(v_max=0.8), Wheels(0.05, 0.02, 0.01), Placement(x, y, 1.0))
        for v, w in commands:
            before = robot.truth
            touches = robot.drive(v, w, tick, clearance, random)
            assert clearance.at(*robot.truth[:2]) >= 0.0
            assert overlap(world, *robot.truth[:2]) <= 1e-12
            # Nothing lies between: robot and chord are no farther apart than v t.
            assert math.dist(before[:2], robot.truth[:2]) <= 0.8 * tick + 1e-9
            assert not (touches and (robot.speed or robot.turn_rate))

    @given(worlds, st.integers(0, 71), angles, st.floats(-0.3, 0.3), st.floats(-1.5, 1.5))
    @example(open_world(8, 9, [(4, 4)]), 28, 0.55, 0.3, 0.0)
    @settings(max_examples=300)
    def test_nothing_is_touched_on_the_way(self, world, place, yaw, v, w):
        clearance = Clearance(world, RADIUS)
        start = Placement(*world.grid.world_from_cell(place // 9, place % 9), yaw)
        if world.is_blocked(place // 9, place % 9):
            return
        free, touches = time_to_contact(start, v, w, 5.0, clearance)
        for t in np.linspace(0.0, free, 400):
            assert clearance.at(*arc(start, v, w, float(t))[:2]) >= -2e-6
        assert touches or free == 5.0
        if touches and abs(v) > 1e-3:
            assert clearance.at(*arc(start, v, w, free + 2e-3 / abs(v))[:2]) < 3e-3

    @pytest.mark.parametrize(('depth', 'expected'), [(1e-4, True), (-1e-5, False)])
    @pytest.mark.parametrize('shift', np.linspace(0.0, 0.05, 7))
    def test_a_corner_is_grazed_or_not(self, depth, expected, shift):
        # At 45 degrees past the lower right corner of the cell, (2.75, 2.5).
        clearance = Clearance(open_world(blocked=[(10, 10)]), RADIUS)
        along, aside = np.array([1.0, 1.0]) / math.sqrt(2), np.array([1.0, -1.0]) / math.sqrt(2)
        x, y = np.array([2.75, 2.5]) + (RADIUS - depth) * aside - (0.6 + shift) * along
        start = Placement(float(x), float(y), math.pi / 4)
        assert time_to_contact(start, 0.2, 0.0, 6.0, clearance)[1] == expected

    def test_hardly_any_speed(self):
        clearance = Clearance(open_world(), RADIUS)
        assert time_to_contact(
            Placement(2.5, 2.5, 0.0), 5e-324, 0.0, 1.0, clearance) == (1.0, False)

    @pytest.mark.parametrize('yaw', [0.0, 0.3, -0.7])
    def test_a_sheet_of_a_wall_is_not_jumped(self, yaw):
        cells = np.zeros((200, 200), dtype=np.int8)
        cells[:, 100] = 100
        clearance = Clearance(World(Grid(200, 200, 0.02), cells), RADIUS)
        robot = Robot(Body(v_max=5.0), Wheels(), Placement(1.0, 2.0, yaw))
        assert robot.drive(5.0, 0.0, 1.0, clearance, rng())
        assert robot.truth.x == pytest.approx(2.0 - RADIUS, abs=1e-6)

    @given(st.floats(0.3, 2.2), st.floats(0.3, 4.7), angles, speeds, turn_rates)
    @settings(max_examples=100)
    def test_a_thin_wall_is_not_jumped(self, x, y, yaw, v, w):
        # One giant tick against a wall of one cell.
        world = open_world(blocked=[(row, 10) for row in range(20)])
        clearance = Clearance(world, RADIUS)
        robot = Robot(Body(), Wheels(), Placement(x, y, yaw))
        robot.drive(v, w, 60.0, clearance, rng())
        assert robot.truth.x <= 2.5 - RADIUS + 1e-9

    def test_after_a_contact_the_robot_can_move_away(self):
        clearance = Clearance(open_world(), RADIUS)
        robot = Robot(Body(), Wheels(), Placement(4.8, 2.5, 0.0))
        assert robot.drive(0.2, 0.3, 5.0, clearance, rng())
        stuck = robot.truth
        assert (robot.speed, robot.turn_rate) == (0.0, 0.0)
        assert robot.drive(0.2, 0.0, 0.05, clearance, rng())
        assert math.dist(robot.truth[:2], stuck[:2]) < 1e-6
        assert not robot.drive(-0.2, 0.0, 0.05, clearance, rng())
        assert robot.truth.x < stuck.x - 0.009
        assert not robot.drive(0.0, 1.0, 0.05, clearance, rng())

    def test_out_of_an_obstacle_but_not_deeper_into_it(self):
        clearance = Clearance(open_world(blocked=[(10, 12)]), RADIUS)
        robot = Robot(Body(), Wheels(), Placement(2.95, 2.625, 0.0))
        assert robot.drive(0.2, 0.0, 0.5, clearance, rng())
        assert robot.truth.x == pytest.approx(2.95, abs=1e-6)
        assert not robot.drive(-0.2, 0.0, 0.5, clearance, rng())
        assert robot.truth.x == pytest.approx(2.85, abs=1e-6)


class TestRobot:
    def drive(self, wheels, commands=100, seed=0, v=0.2, w=0.0):
        robot = Robot(Body(), wheels, Placement(0.5, 2.5, 0.0))
        clearance, random = Clearance(open_world(), RADIUS), rng(seed)
        for _ in range(commands):
            robot.drive(v, w, 0.05, clearance, random)
        return robot

    def test_exact_wheels_know_where_they_are(self):
        robot = self.drive(Wheels(), w=0.3)
        assert robot.odometry == robot.truth
        assert robot.variances == (1e-6, 1e-6)

    def test_slip_loses_its_share_and_odometry_does_not_see_it(self):
        robot = self.drive(Wheels(slip=0.05))
        assert robot.odometry.x == pytest.approx(1.5)
        assert math.hypot(robot.truth.x - 0.5, robot.truth.y - 2.5) == pytest.approx(
            0.95, abs=0.01)
        place, yaw = robot.variances
        assert place > (robot.odometry.x - robot.truth.x)**2 / 2
        assert yaw >= 1e-6

    def test_heading_drift_is_an_angle_a_metre(self):
        one_degree = math.radians(1.0)
        for v in (0.2, -0.05):
            robot = self.drive(Wheels(heading_drift=one_degree), v=v)
            assert robot.truth.yaw == pytest.approx(one_degree * abs(v) * 5.0)
            assert robot.odometry.yaw == 0.0

    def test_noise_is_in_the_odometry_alone(self):
        robot = self.drive(Wheels(noise_std=0.1))
        assert robot.truth == pytest.approx((1.5, 2.5, 0.0))
        assert robot.odometry != robot.truth
        assert math.dist(robot.odometry[:2], robot.truth[:2]) < 0.2

    def test_the_same_seed_gives_the_same_drive(self):
        wheels = Wheels(0.05, 0.01, 0.02)
        first, again, other = (self.drive(wheels, seed=seed, w=0.2) for seed in (1, 1, 2))
        assert (first.truth, first.odometry) == (again.truth, again.odometry)
        assert first.truth != other.truth

    def test_limits(self):
        robot = self.drive(Wheels(), commands=1, v=5.0, w=-50.0)
        assert (robot.speed, robot.turn_rate) == (0.22, -2.84)

    def test_acceleration(self):
        body = Body(a_max=0.5, alpha_max=4.0)
        robot = Robot(body, Wheels(), Placement(2.5, 2.5, 0.0))
        clearance = Clearance(open_world(), RADIUS)
        seen = []
        for v in (0.1, 0.1, 0.1, 0.1, 0.1, -0.2):
            robot.drive(v, 10 * v, 0.1, clearance, rng())
            seen.append((robot.speed, robot.turn_rate))
        expected = [(0.05, 0.4), (0.1, 0.8), (0.1, 1.0), (0.1, 1.0), (0.1, 1.0), (0.05, 0.6)]
        np.testing.assert_allclose(seen, expected)

    @given(st.floats(-9, 9), st.floats(-9, 9), st.floats(0, 3))
    def test_towards(self, value, target, step):
        reached = towards(value, target, step)
        assert min(value, target) <= reached <= max(value, target)
        assert step == 0.0 or abs(reached - value) <= step + 1e-12

    def test_placing_stands_still_and_turns_the_yaw_into_range(self):
        robot = self.drive(Wheels(0.1, 0.1, 0.1))
        robot.place(Placement(1.0, 2.0, 7.0))
        assert robot.truth == robot.odometry == (1.0, 2.0, pytest.approx(7.0 - math.tau))
        assert (robot.speed, robot.turn_rate) == (0.0, 0.0)
        assert robot.variances == (1e-6, 1e-6)
