"""The collision monitor among finer cells, and among things that move."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.robot.collision_monitor import (
    AWAY, braking_way, Intervention, is_out_of_reach, limit_command, MARGIN, stopping_time)
from control_field.robot.late_collision_monitor import limit_late_command
from control_field.robot.latency import Lag
from control_field.robot.limits import Limits
from control_field.robot.obstacle_boxes import distance_to_box, local_grid_from_cells

LIMITS = Limits()
GRID = Grid(20, 20, 0.25)
KEEP = LIMITS.radius + MARGIN
HERE = GRID.world_from_cell(10, 10)


def fine_of(*cells, k=5):
    """Return finer cells, those named blocked, and whether each is."""
    fine = np.zeros((3 * k, 3 * k), np.int8)
    for cell in cells:
        fine[cell] = 100
    return fine


def local_grid_of(fine, *, moving=False, speed=0.0, row=10, col=10, unknown=False):
    k = len(fine) // 3
    parts = fine.reshape(3, k, 3, k)
    high, low = parts.max(axis=(1, 3)), parts.min(axis=(1, 3))
    return local_grid_from_cells(
        np.where(high > 0, high, low), row, col, GRID, unknown, True, fine=fine,
        moving=(fine == 100) if moving else None, mover_speed=speed)


def coarse(moving, speed=0.5, **options):
    """Return the nine cells with something that moves in them."""
    return local_grid_from_cells(
        np.where(moving, 100, 0), 10, 10, GRID, moving=moving, mover_speed=speed, **options)


def north(k=1):
    moving = np.zeros((3 * k, 3 * k), bool)
    moving[2 * k:, k:2 * k] = True
    return moving


@given(st.sets(st.tuples(st.integers(0, 8), st.integers(0, 8))))
def test_boxes_cover_the_finer_cells_and_nothing_else(cells):
    fine = fine_of(*cells, k=3)
    boxes = local_grid_of(fine).boxes
    side = 0.25 / 3
    for i in range(9):
        for j in range(9):
            x, y = 2.25 + (j + 0.5) * side, 2.25 + (i + 0.5) * side
            inside = [box for box in boxes if box[0] < x < box[2] and box[1] < y < box[3]]
            assert len(inside) == ((i, j) in cells)


def test_a_wall_is_one_box():
    assert len(local_grid_of(fine_of(*[(i, 14) for i in range(15)])).boxes) == 1


def test_finer_cells_say_where_in_its_own_cell_something_is():
    local_grid = local_grid_of(fine_of((7, 9)))  # 0.075 to 0.125 m before the robot's middle
    assert not local_grid.is_entered
    for yaw, allowed in ((0.0, False), (math.pi, True)):
        pose = (HERE[0] - 0.03, HERE[1], yaw)
        velocity, _ = limit_command((0.1, 0.0), (0.1, 0.0), 0.05, pose, local_grid, LIMITS)
        assert (velocity[0] > 0.0) == allowed


def test_what_is_unknown_or_outside_is_so_in_finer_cells():
    fine = fine_of()
    fine[:] = -1
    cautious = local_grid_of(fine, unknown=True)
    assert distance_to_box(*HERE, cautious.boxes[0]) == pytest.approx(0.125)
    assert not local_grid_of(fine).boxes
    corner = local_grid_of(fine_of(), row=0, col=0)
    assert sum((b[2] - b[0]) * (b[3] - b[1]) for b in corner.boxes) == pytest.approx(5 * 0.0625)


@given(st.floats(-math.pi, math.pi), st.floats(0.02, 0.22), st.floats(-2.0, 2.0),
       st.floats(-0.124, 0.124), st.floats(-0.124, 0.124), st.floats(0.1, 1.5))
def test_it_stands_before_what_moves_can_have_reached_it(yaw, v, w, dx, dy, speed):
    local_grid, dt = coarse(north(), speed, backs_off=True), 0.05
    pose = (HERE[0] + dx, HERE[1] + dy, yaw)
    velocity, reason = limit_command((v, w), (v, w), dt, pose, local_grid, LIMITS)
    box = local_grid.moving[0]
    start = distance_to_box(*pose[:2], box)
    way = braking_way(velocity[0], dt, LIMITS)
    turn = w / max(velocity[0], 1e-9) * way
    x = pose[0] + way * math.cos(yaw + 0.5 * turn) * np.sinc(0.5 * turn / math.pi)
    y = pose[1] + way * math.sin(yaw + 0.5 * turn) * np.sinc(0.5 * turn / math.pi)
    comes = speed * stopping_time(velocity[0], dt, LIMITS)
    gets = distance_to_box(x, y, box)
    if velocity[0]:
        assert gets >= min(KEEP + comes, start + AWAY * way) - 1e-9
    else:
        assert reason in {Intervention.MOVING, Intervention.BLOCKED}


def test_beside_something_that_moves_it_stands_and_beside_what_stands_it_drives():
    command = (0.2, 0.0)
    pose = (*HERE, 0.0)
    beside = north()
    answer = limit_command(command, command, 0.05, pose, coarse(beside), LIMITS)
    assert answer == ((0.0, 0.0), Intervention.MOVING)
    assert Intervention.MOVING.is_for_movers
    assert Intervention.MOVING.sentence
    standing = coarse(beside, speed=0.0)
    assert limit_command(command, command, 0.05, pose, standing, LIMITS) == (
        command, Intervention.NONE)


@pytest.mark.parametrize('speed', [0.5, 1.6])
def test_straight_away_from_what_moves_it_drives_if_it_backs_off(speed):
    command, pose = (0.2, 0.0), (*HERE, -0.5 * math.pi)
    for backs_off in (False, True):
        local_grid = coarse(north(), speed, backs_off=backs_off)
        velocity, _ = limit_command(command, command, 0.05, pose, local_grid, LIMITS)
        assert (velocity == command) == backs_off == is_out_of_reach(
            command, 0.05, pose, local_grid, LIMITS)


def test_the_later_it_hears_the_earlier_it_stands():
    local_grid = local_grid_of(fine_of((14, 7)), moving=True, speed=0.5)
    command, pose = (0.1, 0.0), (*HERE, 0.0)
    in_time, late = Lag(([],), [], 0.5), Lag(([(0.1, 0.0, 0.4)],), [], 0.5)

    def said(lag):
        return limit_late_command(command, command, 0.05, pose, local_grid, LIMITS, lag)[1]
    assert said(in_time) is Intervention.NONE
    assert said(late) is Intervention.MOVING
