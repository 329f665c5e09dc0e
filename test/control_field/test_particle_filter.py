import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.local_grid import crop_neighbourhood
from control_field.robot.particle_filter import MotionNoise, ParticleFilter

GRID = Grid(20, 20, 0.25)
#: A wall across the way east, along row 10.
WALL = np.zeros(GRID.shape, np.int8)
WALL[6:14, 12] = 100
TICK = 0.01


def particles_at(row=10, col=8, yaw=0.0, *, seed=0, motion_noise=None, n=1000):
    particles = ParticleFilter(GRID, motion_noise or MotionNoise(), np.random.default_rng(seed), n)
    particles.place(*GRID.world_from_cell(row, col), yaw)
    return particles


def look(particles, world, x, y):
    particles.see(crop_neighbourhood(world, *GRID.cell_from_world(x, y)))


def drive(particles, world, true, metres, *, slip=0.0, drift=0.0):
    """Drive straight by odometry, while the wheels slip and the heading drifts."""
    x, y, yaw = true
    for _ in range(round(metres / TICK)):
        step = TICK * (1.0 - slip)
        yaw += drift * step
        x, y = x + step * math.cos(yaw), y + step * math.sin(yaw)
        particles.move(TICK, 0.0, 0.0)
        look(particles, world, x, y)
    return x, y, yaw


def test_in_the_open_the_estimate_is_what_the_wheels_say_and_doubt_grows():
    particles = particles_at(10, 3)
    before = particles.estimate()
    drive(particles, np.zeros(GRID.shape, np.int8), (0.875, 2.625, 0.0), 1.0)
    after = particles.estimate()
    assert (after.x - before.x, after.y) == (pytest.approx(1.0, abs=0.005),
                                             pytest.approx(2.625, abs=0.002))
    assert after.std > 4.0 * before.std


def test_a_wall_that_comes_into_sight_tells_how_far_the_wheels_slip():
    particles = particles_at(10, 6)
    x, y, _ = drive(particles, WALL, (1.625, 2.625, 0.0), 1.24, slip=0.06)
    estimate = particles.estimate()
    assert estimate.col == GRID.cell_from_world(x, y)[1] == 11
    assert abs(estimate.x - x) < 0.02
    assert particles.calibration[0] == pytest.approx(0.06, abs=0.02)


def test_what_was_learnt_about_the_wheels_outlives_a_new_place():
    particles = particles_at(10, 6)
    drive(particles, WALL, (1.625, 2.625, 0.0), 1.24, slip=0.06)
    particles.place(0.875, 2.625, 0.0)
    x, _, _ = drive(particles, np.zeros(GRID.shape, np.int8), (0.875, 2.625, 0.0), 1.0, slip=0.06)
    assert abs(particles.estimate().x - x) < 0.02


def test_a_remembered_wall_beside_the_way_tells_when_the_robot_leaves_its_row():
    world = np.zeros(GRID.shape, np.int8)
    world[8, :] = 100
    particles = particles_at(9, 2, motion_noise=MotionNoise(drift=0.05))
    particles.remember(world)
    x, y, _ = drive(particles, world, (0.625, 2.375, 0.0), 2.4, drift=0.06)
    estimate = particles.estimate()
    assert estimate.row == GRID.cell_from_world(x, y)[0] == 10
    assert abs(estimate.y - y) < 0.05


def test_standing_still_makes_nobody_surer():
    particles = particles_at(10, 6)
    drive(particles, WALL, (1.625, 2.625, 0.0), 0.9, slip=0.05)
    before = particles.estimate()
    for _ in range(200):
        look(particles, WALL, 2.48, 2.625)
        particles.move(0.0, 0.0, 0.0)
    after = particles.estimate()
    assert after.std == pytest.approx(before.std, rel=0.1)


def test_wheels_far_apart_make_a_turn_less_sure():
    def std(turning_radius):
        motion_noise = MotionNoise(slip=0.0, drift=0.0, turning_radius=turning_radius)
        particles = particles_at(10, 6, motion_noise=motion_noise)
        for _ in range(20):
            particles.move(0.0, 0.0, 0.5)
        for _ in range(20):
            particles.move(0.05, 0.0, 0.0)
        return particles.estimate().std

    assert std(0.3) > 1.5 * std(0.05)


def test_an_obstacle_that_appears_does_not_carry_a_sure_robot_away():
    particles = particles_at(10, 8)
    look(particles, np.zeros(GRID.shape, np.int8), 2.125, 2.625)
    crowded = np.zeros(GRID.shape, np.int8)
    crowded[9:12, 9] = 100
    look(particles, crowded, 2.125, 2.625)
    estimate = particles.estimate()
    assert (estimate.row, estimate.col) == (10, 8)
    assert math.hypot(estimate.x - 2.125, estimate.y - 2.625) < 0.02


def test_a_wrong_remembered_map_does_not_carry_a_sure_robot_away():
    particles = particles_at(10, 9)
    particles.remember(np.roll(WALL, -1, axis=1))
    x, y, _ = drive(particles, WALL, (2.375, 2.625, 0.0), 0.5)
    estimate = particles.estimate()
    assert math.hypot(estimate.x - x, estimate.y - y) < 0.05


def test_localised_poses_are_followed_and_teach_about_the_wheels():
    rng = np.random.default_rng(3)
    particles = particles_at(10, 3)
    x, y, yaw = 0.875, 2.625, 0.0
    for k in range(250):
        yaw += 0.05 * TICK
        x, y = x + 0.93 * TICK * math.cos(yaw), y + 0.93 * TICK * math.sin(yaw)
        particles.move(TICK, 0.0, 0.0)
        if k % 5 == 0:
            noise = rng.standard_normal(3) * (0.02, 0.02, 0.035)
            assert particles.localise(
                x + noise[0], y + noise[1], yaw + noise[2], (4e-4, 4e-4, 1.2e-3))
    estimate = particles.estimate()
    assert math.hypot(estimate.x - x, estimate.y - y) < 0.02
    assert estimate.yaw == pytest.approx(yaw, abs=0.03)
    assert particles.calibration[0] == pytest.approx(0.07, abs=0.02)


def test_a_pose_far_off_is_passed_over_until_it_insists():
    particles = particles_at(10, 3)
    far = (3.0, 4.0, 1.0, (1e-3, 1e-3, 1e-3))
    assert not particles.localise(*far)
    assert particles.estimate().x == pytest.approx(0.875, abs=0.01)
    assert not particles.localise(*far)
    assert particles.localise(*far)
    assert particles.estimate().x == pytest.approx(3.0, abs=0.01)


def test_free_cells_of_a_local_grid_whose_place_is_in_doubt_are_unknown():
    particles = particles_at(10, 8)
    particles.place(2.25, 2.625, 0.0, std=0.03)  # on the edge of columns 8 and 9
    free = np.zeros((3, 3), np.int8)
    estimate = particles.estimate()
    doubted = particles.doubted(free, estimate.row, estimate.col)
    assert (doubted == -1).any()
    assert doubted[1, 1] == 0
    blocked = np.full((3, 3), 100, np.int8)
    assert (particles.doubted(blocked, estimate.row, estimate.col) == blocked).all()


def test_a_local_grid_whose_place_is_sure_stays_as_it_is():
    particles = particles_at(10, 8)
    assert (particles.doubted(np.zeros((3, 3), np.int8), 10, 8) == 0).all()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.floats(-math.pi, math.pi), st.floats(-0.2, 0.2),
       st.floats(-0.5, 0.5))
def test_moving_turns_with_the_robot(seed, yaw, ahead, turn):
    """The same drive from a pose turned by some angle ends at a place turned by it."""
    ends = []
    for start in (0.0, yaw):
        exact = MotionNoise(0.0, 0.0, 0.0, 0.0)
        particles = particles_at(10, 10, start, seed=seed, motion_noise=exact, n=100)
        particles.place(*GRID.world_from_cell(10, 10), start, 0.0, 0.0)
        particles.move(ahead * math.cos(0.5 * turn), ahead * math.sin(0.5 * turn), turn)
        ends.append(particles.estimate())
    x, y = GRID.world_from_cell(10, 10)
    first, second = ends
    cos, sin = math.cos(yaw), math.sin(yaw)
    dx, dy = first.x - x, first.y - y
    assert second.x - x == pytest.approx(dx * cos - dy * sin, abs=1e-3)
    assert second.y - y == pytest.approx(dx * sin + dy * cos, abs=1e-3)
    assert math.remainder(second.yaw - first.yaw - yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.lists(st.tuples(
    st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-1.0, 1.0),
    st.lists(st.sampled_from([0, 100, -1, 42]), min_size=9, max_size=9)), max_size=30))
def test_whatever_is_driven_and_seen_the_estimate_is_a_pose_in_its_cell(seed, steps):
    particles = particles_at(seed=seed, n=100)
    for ahead, left, turn, cells in steps:
        particles.move(ahead, left, turn)
        particles.see(np.array(cells, np.int8).reshape(3, 3))
        estimate = particles.estimate()
        assert GRID.cell_from_world(estimate.x, estimate.y) == (estimate.row, estimate.col)
        assert abs(estimate.yaw) <= math.pi
        assert 0.0 <= estimate.sure <= 1.0
        assert math.isfinite(estimate.std)


def test_the_same_seed_gives_the_same_bits():
    ends = []
    for _ in range(2):
        particles = particles_at(10, 6)
        drive(particles, WALL, (1.625, 2.625, 0.0), 1.24, slip=0.06)
        ends.append(particles.estimate())
    assert ends[0] == ends[1]
