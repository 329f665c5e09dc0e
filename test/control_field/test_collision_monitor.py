import math
import random

from hypothesis import example, given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.local_grid import crop_neighbourhood
from control_field.robot.collision_monitor import (
    braking_way, Intervention, limit_command, LONGEST_STEP, MARGIN)
from control_field.robot.late_collision_monitor import limit_late_command
from control_field.robot.latency import Lag
from control_field.robot.limits import Limits, STANDSTILL
from control_field.robot.obstacle_boxes import distance_to_box, local_grid_from_cells

LIMITS = Limits()
GRID = Grid(20, 20, 0.25)
FREE = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
WALL_AHEAD = [[0, 0, 100], [0, 0, 100], [0, 0, 100]]
#: Reasons that stand the robot at once, faster than its wheels are asked to otherwise.
BRAKES = {Intervention.BLOCKED, Intervention.SLOWED, Intervention.NO_LOCAL_GRID,
          Intervention.NOT_FINITE}

speeds = st.floats(-10.0, 10.0)
wild = st.one_of(st.floats(), speeds)
velocities = st.tuples(st.floats(-0.22, 0.22), st.floats(-2.84, 2.84))
steps = st.floats(0.0, 0.6)
cells = st.lists(st.lists(st.sampled_from([0, 100, -1]), min_size=3, max_size=3),
                 min_size=3, max_size=3)
places = st.tuples(st.floats(2.3, 2.95), st.floats(2.3, 2.95), st.floats(-4.0, 4.0))


def pose_in(row, col, yaw=0.0, dx=0.0, dy=0.0):
    x, y = GRID.world_from_cell(row, col)
    return x + dx, y + dy, yaw


def local_grid_of(around, row=10, col=10, unknown=False):
    return local_grid_from_cells(around, row, col, GRID, unknown)


def limited(command, previous, pose, around=FREE, *, dt=0.05, unknown=False):
    local_grid = local_grid_of(around, unknown=unknown)
    return limit_command(command, previous, dt, pose, local_grid, LIMITS)


def after(pose, velocity, seconds):
    x, y, yaw = pose
    v, w = velocity
    middle = yaw + 0.5 * w * seconds
    chord = v * seconds * float(np.sinc(0.5 * w * seconds / math.pi))
    return x + chord * math.cos(middle), y + chord * math.sin(middle), yaw + w * seconds


def assert_within_limits(velocity, previous, dt, reason):
    v, w = velocity
    assert abs(v) <= LIMITS.v_max
    assert abs(w) <= LIMITS.w_max
    dt = min(dt, LONGEST_STEP)
    if reason is not Intervention.NOT_FINITE:
        assert abs(w - previous[1]) <= LIMITS.alpha_max * dt + 1e-9
    if reason not in BRAKES:
        assert abs(v - previous[0]) <= LIMITS.a_max * dt + 1e-9
    elif reason is not Intervention.NOT_FINITE:
        assert v == 0.0 or abs(v) <= abs(previous[0]) + LIMITS.a_max * dt + 1e-9


@given(st.tuples(wild, wild), velocities, steps, places, cells, st.booleans())
@example((math.nan, 0.0), STANDSTILL, 0.05, (2.6, 2.6, 0.0), FREE, False)
@example((0.22, 2.84), (0.22, -2.84), 0.0, (2.6, 2.6, 0.0), WALL_AHEAD, False)
def test_no_limit_is_broken_whatever_is_asked_for(
        command, previous, dt, pose, around, unknown):
    velocity, reason = limited(command, previous, pose, around, dt=dt, unknown=unknown)
    assert_within_limits(velocity, previous, dt, reason)


@given(velocities, velocities, st.floats(0.01, 0.2), places, cells)
@example((5e-324, 1.0), STANDSTILL, 0.125, (2.5, 2.9375, 0.0), FREE)
def test_no_body_gets_deeper_into_what_the_local_grid_shows_blocked(
        command, previous, dt, pose, around):
    local_grid = local_grid_of(around)
    velocity, _ = limit_command(command, previous, dt, pose, local_grid, LIMITS)
    for box in local_grid.boxes:
        start = distance_to_box(pose[0], pose[1], box)
        for seconds in np.linspace(0.0, dt, 9):
            x, y, _ = after(pose, velocity, seconds)
            # An arc is looked at point by point: a body that overlaps something already may get
            # deeper by less than the sagitta between two points.
            slack = 1e-9 if start >= LIMITS.radius else 2e-4
            assert distance_to_box(x, y, box) >= min(LIMITS.radius, start) - slack


@given(velocities, velocities, steps, places)
def test_in_the_open_it_only_ramps(command, previous, dt, pose):
    _, reason = limited(command, previous, pose, dt=dt)
    room = LIMITS.radius + MARGIN + braking_way(LIMITS.v_max, min(dt, LONGEST_STEP), LIMITS)
    clear = all(2.25 + room < c < 3.0 - room for c in pose[:2])
    if clear:
        assert reason in {Intervention.NONE, Intervention.ACCELERATION}


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('place', range(7))
def test_what_is_not_finite_stands_still(value, place):
    numbers = [0.1, 0.0, 0.1, 0.0, 2.6, 2.6, 0.0]
    numbers[place] = value
    answer = limited(tuple(numbers[:2]), tuple(numbers[2:4]), tuple(numbers[4:]))
    assert answer == (STANDSTILL, Intervention.NOT_FINITE)


def test_a_time_that_runs_backwards_stands_still():
    answer = limited((0.1, 0.0), (0.1, 0.0), pose_in(10, 10), dt=-0.01)
    assert answer == (STANDSTILL, Intervention.NOT_FINITE)


def test_too_fast_is_cut_and_said():
    velocity, reason = limited((1.0, 0.0), (0.22, 0.0), pose_in(10, 10))
    assert (velocity, reason) == ((0.22, 0.0), Intervention.SPEED)


def test_a_start_is_ramped_and_said():
    velocity, reason = limited((0.22, 0.0), STANDSTILL, pose_in(10, 10))
    assert velocity[0] == pytest.approx(0.125)
    assert reason is Intervention.ACCELERATION


def test_a_wall_ahead_stops_and_lets_turn():
    near = pose_in(10, 10, dx=0.018)
    velocity, reason = limited((0.2, 1.0), (0.2, 1.0), near, WALL_AHEAD)
    assert (velocity, reason) == ((0.0, 1.0), Intervention.BLOCKED)


def test_a_wall_some_way_ahead_only_slows():
    velocity, reason = limited((0.2, 0.0), (0.2, 0.0), pose_in(10, 10, dx=0.005), WALL_AHEAD)
    assert reason is Intervention.SLOWED
    assert 0.0 < velocity[0] < 0.2


def test_away_from_a_wall_it_overlaps_is_free():
    inside = pose_in(10, 10, yaw=math.pi, dx=0.06)
    velocity, reason = limited((0.1, 0.0), (0.1, 0.0), inside, WALL_AHEAD)
    assert (velocity, reason) == ((0.1, 0.0), Intervention.NONE)


def test_along_a_corridor_is_free():
    corridor = [[100, 100, 100], [0, 0, 0], [100, 100, 100]]
    for off in (-0.015, 0.0, 0.015):
        _, reason = limited((0.22, 0.0), (0.22, 0.0), pose_in(10, 10, dy=off), corridor)
        assert reason is Intervention.NONE


@pytest.mark.parametrize('around', [FREE, [[-1] * 3] * 3])
def test_unknown_is_blocked_only_when_it_is_to_be(around):
    unknown = around[0][0] == -1
    at_the_edge = pose_in(10, 10, dx=0.018)
    for blocked in (False, True):
        _, reason = limited((0.2, 0.0), (0.2, 0.0), at_the_edge, around, unknown=blocked)
        assert (reason is Intervention.BLOCKED) == (unknown and blocked)


def test_what_lies_outside_the_workspace_is_blocked_whatever_the_local_grid_says():
    pose = pose_in(0, 0, yaw=math.pi, dx=-0.018)
    corner = local_grid_of(FREE, 0, 0)
    _, reason = limit_command((0.2, 0.0), (0.2, 0.0), 0.05, pose, corner, LIMITS)
    assert reason is Intervention.BLOCKED


def test_without_a_local_grid_or_far_from_it_the_robot_may_only_turn():
    for local_grid in (None, local_grid_of(FREE, 3, 3)):
        velocity, reason = limit_command(
            (0.2, 0.1), (0.2, 0.1), 0.05, pose_in(10, 10), local_grid, LIMITS)
        assert (velocity, reason) == ((0.0, 0.1), Intervention.NO_LOCAL_GRID)


def wander(n_decisions, seed):
    """Let an adversary steer for the worst through worlds full of obstacles; count the moves."""
    choice = random.Random(seed)
    n_moves = 0
    while n_decisions > 0:
        n_decisions, moved = _wander_in_a_world(choice, n_decisions)
        n_moves += moved
    return n_moves


def _wander_in_a_world(choice, n_decisions):
    rng = np.random.default_rng(choice.randrange(2**32))
    world = np.where(rng.random((12, 12)) < choice.choice([0.1, 0.3, 0.5]), 100, 0).astype(np.int8)
    world[5, 5] = 0
    grid, dt = Grid(12, 12, 0.25), choice.choice([0.01, 0.05, 0.1, 0.2])
    local_grids, pose, previous, n_moves = {}, (1.375, 1.375, choice.uniform(-3, 3)), STANDSTILL, 0
    command = STANDSTILL
    for k in range(min(n_decisions, 2000)):
        if k % choice.choice([1, 7, 30]) == 0:
            command = choice.choice([
                (choice.uniform(-1, 1), choice.uniform(-6, 6)), (0.22, 0.0), (0.22, 2.84),
                (math.nan, 0.0), (0.3, choice.gauss(0.0, 1.0)), (0.0, math.inf)])
        here = grid.cell_from_world(pose[0], pose[1])
        if here not in local_grids:
            local_grids[here] = local_grid_from_cells(
                crop_neighbourhood(world, *here).tolist(), *here, grid)
        velocity, reason = limit_command(command, previous, dt, pose, local_grids[here], LIMITS)
        assert_within_limits(velocity, previous, dt, reason)
        n_moves += velocity[0] != 0.0
        for share in (0.5, 1.0):
            x, y, _ = after(pose, velocity, share * dt)
            for box in local_grids[here].boxes:
                assert distance_to_box(x, y, box) >= LIMITS.radius
        pose, previous = after(pose, velocity, dt), velocity
    return n_decisions - 2000, n_moves


def test_an_adversary_collides_in_no_world():
    assert wander(100_000, seed=1) > 12_500


@pytest.mark.long
@pytest.mark.timeout(600)
def test_an_adversary_collides_in_no_world_in_a_million_decisions():
    assert wander(1_000_000, seed=2) > 100_000


AT_ONCE = Lag(([],), [], 0.5)
ENTERED = [[0, 0, 0], [0, 100, 0], [0, 0, 0]]


def limited_both_ways(command, around, **options):
    """Return what the collision monitor says, and what it says to a robot heard late."""
    local_grid = local_grid_from_cells(around, 10, 10, GRID, **options)
    situation = command, command, 0.05, pose_in(10, 10), local_grid, LIMITS
    return limit_command(*situation), limit_late_command(*situation, AT_ONCE)


def test_where_something_reaches_into_its_own_cell_the_robot_only_turns():
    for answer in limited_both_ways((0.1, 0.1), ENTERED, own_cell=True):
        assert answer == ((0.0, 0.1), Intervention.ENTERED)
    for answer in limited_both_ways((0.0, 0.1), ENTERED, own_cell=True):
        assert answer == ((0.0, 0.1), Intervention.NONE)


def test_a_sensor_that_marks_the_robot_itself_or_sees_nothing_there_does_not_hold_it():
    for answer in limited_both_ways((0.02, 0.0), ENTERED, own_cell=False):
        assert answer[1] is Intervention.NONE
    unseen = [[0, 0, 0], [0, -1, 0], [0, 0, 0]]
    for answer in limited_both_ways((0.02, 0.0), unseen, own_cell=True):
        assert answer[1] is Intervention.NONE
