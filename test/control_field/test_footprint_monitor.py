import math
import random

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.robot.collision_monitor import Intervention, limit_command
from control_field.robot.footprint import footprint_from_points, footprint_from_text
from control_field.robot.footprint_sweep import gap_to_box
from control_field.robot.late_collision_monitor import limit_late_command
from control_field.robot.latency import Lag
from control_field.robot.limits import Limits, MARGIN, STANDSTILL, within_acceleration
from control_field.robot.obstacle_boxes import local_grid_from_cells, LocalGrid
from control_field.robot.sent_commands import moved

#: 0.6 x 0.3 m: 0.335 m to its corners, which no gap of 0.4 m lets turn.
LONG = footprint_from_text('[[0.3, 0.15], [-0.3, 0.15], [-0.3, -0.15], [0.3, -0.15]]')
#: Wheels behind the middle, a nose, and a corner that goes in.
ODD = footprint_from_points(
    [(0.25, 0.05), (0.0, 0.2), (-0.15, 0.2), (-0.15, -0.2), (0.0, -0.2), (0.05, 0.0)])
LIMITS = Limits(footprint=LONG)
WIDE = (-5.0, -5.0, 5.0, 5.0)
AT_ONCE = Lag(([],), [], 0.5)


def corners_at(footprint, place):
    x, y, yaw = place
    c, s = math.cos(yaw), math.sin(yaw)
    return [(x + c * px - s * py, y + s * px + c * py) for px, py in footprint.corners]


def area_within(footprint, place, box):
    """Return how much of a body lies in a box, [m^2], by cutting it off side by side."""
    left = corners_at(footprint, place)
    for axis, sign in ((0, 1), (1, 1), (0, -1), (1, -1)):
        bound = sign * box[axis if sign > 0 else axis + 2]
        kept = []
        for a, b in zip(left, [*left[1:], *left[:1]], strict=True):
            in_a, in_b = sign * a[axis] - bound, sign * b[axis] - bound
            if in_a >= 0.0:
                kept.append(a)
            if in_a * in_b < 0.0:
                share = in_a / (in_a - in_b)
                kept.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
        left = kept
    following = [*left[1:], *left[:1]]
    return abs(0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(left, following, strict=True)))


def limited(command, pose, boxes, *, previous=None, limits=LIMITS, dt=0.05, seen=WIDE):
    local_grid = LocalGrid(tuple(boxes), seen)
    situation = command, command if previous is None else previous, dt, pose, local_grid, limits
    return limit_command(*situation), limit_late_command(*situation, AT_ONCE)


#: Walls on both sides of a gap of some width along x.
def gap(width):
    return [(-1.0, 0.5 * width, 4.0, 2.0), (-1.0, -2.0, 4.0, -0.5 * width)]


def test_it_drives_straight_through_a_gap_that_its_width_fits():
    for dy in (-0.04, 0.0, 0.04):
        for velocity, reason in limited((0.2, 0.0), (0.5, dy, 0.0), gap(0.4)):
            assert (velocity, reason) == ((0.2, 0.0), Intervention.NONE)
    for velocity, reason in limited((0.2, 0.0), (0.5, 0.0, 0.0), gap(0.28)):
        assert velocity[0] == 0.2  # it overlaps both walls, and gets no deeper
        assert reason is Intervention.NONE


def test_it_does_not_turn_in_that_gap():
    for which in (0, 1):
        assert limited((0.0, 1.0), (0.5, 0.0, 0.0), gap(0.4), limits=Limits())[which] == (
            (0.0, 1.0), Intervention.NONE)  # a disc does
        pose, velocity = (0.5, 0.0, 0.0), STANDSTILL
        for _ in range(100):
            velocity, reason = limited(
                (0.0, 1.0), pose, gap(0.4), previous=velocity)[which]
            pose = moved(pose, (*velocity, 0.05))
            assert not any(area_within(LONG, pose, box) for box in gap(0.4))
        assert (reason, velocity) == (Intervention.BLOCKED, STANDSTILL)
        assert pose[2] < 0.2
        assert which or pose[2] > 0.1


def test_it_turns_where_its_corners_have_room():
    for velocity, reason in limited((0.0, 1.0), (0.5, 0.0, 0.0), gap(0.75)):
        assert (velocity, reason) == ((0.0, 1.0), Intervention.NONE)


def test_it_stops_before_a_wall_by_its_nose_not_by_its_circle():
    wall = [(0.32, -1.0, 1.0, 1.0)]
    assert limited((0.05, 0.0), (0.0, 0.0, 0.0), wall)[0] == ((0.05, 0.0), Intervention.NONE)
    for velocity, reason in limited((0.2, 0.0), (0.017, 0.0, 0.0), wall):
        assert velocity[0] < 0.1
        assert reason in {Intervention.SLOWED, Intervention.BLOCKED}


def test_a_corner_that_swings_out_behind_is_looked_at_too():
    beside = [(-0.35, 0.16, -0.25, 0.3)]
    for velocity, _ in limited((0.1, -1.0), (0.0, 0.0, 0.0), beside):
        assert velocity[1] > -0.9
    for velocity, reason in limited((0.1, 0.0), (0.0, 0.0, 0.0), beside):
        assert (velocity, reason) == ((0.1, 0.0), Intervention.NONE)


def test_without_a_local_grid_or_with_something_in_its_cell_it_does_not_turn():
    for local_grid in (None, LocalGrid((), (3.0, 3.0, 4.0, 4.0)),
                       LocalGrid((), WIDE, is_entered=True)):
        for command in ((0.1, 0.5), (0.0, 0.5)):
            situation = command, command, 0.05, (0.0, 0.0, 0.0), local_grid, LIMITS
            for velocity, reason in (
                    limit_command(*situation), limit_late_command(*situation, AT_ONCE)):
                assert abs(velocity[0]) <= max(command[0] - 0.05 * LIMITS.a_max, 0.0) + 1e-9
                assert velocity[1] <= command[1] - 0.05 * LIMITS.alpha_max + 1e-9
                assert reason in {Intervention.NO_LOCAL_GRID, Intervention.ENTERED}


def test_what_moves_keeps_it_as_far_off_as_its_outline_is_near():
    mover = (0.5, -0.1, 0.7, 0.1)
    for yaw, v in ((0.0, 0.0), (math.pi / 2, 0.1)):
        local_grid = LocalGrid((mover,), WIDE, moving=(mover,), mover_speed=5.0)
        velocity, reason = limit_command(
            (0.1, 0.0), (0.1, 0.0), 0.05, (0.0, 0.0, yaw), local_grid, Limits(
                footprint=LONG, a_max=20.0))
        assert velocity[0] == v
        assert reason is (Intervention.NONE if v else Intervention.MOVING)


places = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-4.0, 4.0))
boxes = st.tuples(st.floats(-0.5, 0.4), st.floats(-0.5, 0.4), st.floats(0.01, 0.5),
                  st.floats(0.01, 0.5)).map(lambda b: (b[0], b[1], b[0] + b[2], b[1] + b[3]))


@given(st.sampled_from([LONG, ODD]), places, boxes)
def test_a_gap_is_none_where_they_overlap_and_never_too_large(footprint, place, box):
    gap_there = gap_to_box(footprint, place, box)
    if gap_there >= 0.0:
        assert area_within(footprint, place, box) < 1e-12
    # Whatever it is moved by less than the gap, it does not touch.
    for k in range(8 if gap_there > 0.0 else 0):
        angle = k * math.pi / 4
        x, y, yaw = place
        there = x + 0.999 * gap_there * math.cos(angle), y + 0.999 * gap_there * math.sin(
            angle), yaw
        assert area_within(footprint, there, box) < 1e-12
    if gap_there < -1e-6 and len(footprint.pieces) == 1:
        assert area_within(footprint, place, box) > 0.0


velocities = st.tuples(st.floats(-0.22, 0.22), st.floats(-2.84, 2.84))


@given(velocities, velocities, st.floats(0.01, 0.2), places, st.lists(boxes, max_size=4),
       st.sampled_from([LONG, ODD]))
def test_no_body_gets_deeper_into_what_is_blocked(
        command, previous, dt, pose, around, footprint):
    limits = Limits(footprint=footprint)
    for velocity, _ in limited(command, pose, around, previous=previous, limits=limits, dt=dt):
        for box in around:
            start = gap_to_box(footprint, pose, box)
            for seconds in np.linspace(0.0, dt, 9):
                there = moved(pose, (*velocity, seconds))
                # One that overlaps already may, between two places that are looked at.
                slack = 1e-6 if start >= MARGIN else 1.1e-3
                assert gap_to_box(footprint, there, box) >= min(0.0, start) - slack


#: Parts of a step in which a slow base comes nearer to what it is told.
N_PARTS = 4


def driven(pose, command, velocity, dt, limits, is_slow):
    """Return the poses and the velocity of a base: as it is told, or as its limits allow."""
    found = []
    for _ in range(N_PARTS):
        velocity = within_acceleration(
            command, velocity, dt / N_PARTS, limits) if is_slow else command
        pose = moved(pose, (*velocity, dt / N_PARTS))
        found.append(pose)
    return found, velocity


def wander(n_decisions, seed, footprint, is_slow=False):
    """Let an adversary steer for the worst through worlds full of obstacles; count the moves."""
    choice, limits = random.Random(seed), Limits(footprint=footprint)
    n_moves = n_turns = 0
    for _ in range(n_decisions // 500):
        rng = np.random.default_rng(choice.randrange(2**32))
        share = choice.choice([0.02, 0.1, 0.2])
        world = np.where(rng.random((36, 36)) < share, 100, 0).astype(np.int8)
        world[14:22, 14:22] = 0
        grid, dt = Grid(12, 12, 0.6), choice.choice([0.02, 0.05, 0.1, 0.2])
        pose, sent, velocity = (3.6, 3.6, choice.uniform(-3, 3)), STANDSTILL, STANDSTILL
        command, seen = STANDSTILL, {}
        for k in range(500):
            if k % choice.choice([1, 7, 30]) == 0:
                command = choice.choice([
                    (choice.uniform(-1, 1), choice.uniform(-6, 6)), (0.22, 0.0), (0.22, 2.84),
                    (0.0, 2.84), (0.0, -1.0), (0.3, choice.gauss(0.0, 1.0))])
            here = grid.cell_from_world(pose[0], pose[1])
            if here not in seen:
                seen[here] = view(world, here, grid)
            sent, _ = limit_command(command, sent, dt, pose, seen[here], limits)
            way, velocity = driven(pose, sent, velocity, dt, limits, is_slow)
            n_moves += velocity[0] != 0.0
            n_turns += velocity[1] != 0.0
            for there in way:
                for box in seen[here].boxes:
                    assert area_within(footprint, there, box) < 1e-9
            pose = way[-1]
    return n_moves, n_turns


def view(world, cell, grid):
    """Return the local grid of a cell, in which finer ones say where something is."""
    row, col = cell
    padded = np.pad(world, 3, constant_values=100)
    fine = padded[3 * row:3 * row + 9, 3 * col:3 * col + 9]
    coarse = np.full((3, 3), 0, dtype=np.int8)
    coarse[fine.reshape(3, 3, 3, 3).any(axis=(1, 3))] = 100
    return local_grid_from_cells(coarse, row, col, grid, own_cell=True, fine=fine)


@pytest.mark.parametrize('footprint', [LONG, ODD], ids=['long', 'odd'])
def test_an_adversary_collides_in_no_world(footprint):
    n_moves, n_turns = wander(3_000, 1, footprint)
    assert min(n_moves, n_turns) > 300


@pytest.mark.parametrize('footprint', [LONG, ODD], ids=['long', 'odd'])
def test_nor_where_the_wheels_brake_no_harder_than_they_are_taken_to(footprint):
    n_moves, n_turns = wander(3_000, 2, footprint, is_slow=True)
    assert min(n_moves, n_turns) > 300


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('is_slow', [False, True])
@pytest.mark.parametrize('footprint', [LONG, ODD], ids=['long', 'odd'])
def test_an_adversary_collides_in_no_world_in_200_000_decisions(footprint, is_slow):
    n_moves, n_turns = wander(200_000, 3, footprint, is_slow)
    assert min(n_moves, n_turns) > 20_000
