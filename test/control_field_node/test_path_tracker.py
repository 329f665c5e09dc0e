import dataclasses
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_ROW
from control_field.local_grid import crop_neighbourhood, masks_from_neighbourhood
from control_field.robot.collision_monitor import limit_command
from control_field.robot.limits import Limits, STANDSTILL
from control_field.robot.obstacle_boxes import distance_to_box
from control_field_node.driving.path_tracker import PathTracker
from control_field_node.inputs.observation import (
    LocalGridRules, observation_from_neighbourhood, ObservationCache)
from controller_helpers import GRID
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from oracles import allowed_from_blocked

LIMITS = Limits()
DT = 0.05


class Robot:
    """A robot in a world of cells that drives where it is sent, through the collision monitor."""

    def __init__(self, world, cell, yaw=0.0, dx=0.0, dy=0.0, aside=0.0):
        self.world = world
        self.tracker = PathTracker(GRID, LIMITS, 0.25, clearance=aside)
        self.velocity = STANDSTILL
        self.seconds, self.clearance = 0.0, math.inf
        x, y = GRID.world_from_cell(*cell)
        self.pose = Pose(0.0, x + dx, y + dy, yaw)

    @property
    def cell(self):
        return GRID.cell_from_world(self.pose.x, self.pose.y)

    def seen(self):
        cells = crop_neighbourhood(self.world, *self.cell)
        return observation_from_neighbourhood(
            Neighbourhood(self.pose.stamp, *self.cell, cells), GRID, LocalGridRules())

    def until_due(self, patience=20.0):
        """Drive until the next step is to be decided; return what is seen there."""
        end = self.seconds + patience
        while not self._is_due():
            assert self.seconds < end, f'stuck at {self.pose}'
            self._tick()
        return self.seen()

    def _is_due(self):
        seen = self.seen()
        self.tracker.update(self.pose, seen)
        return self.tracker.is_due(self.pose, seen)

    def follow(self, headings):
        for heading in headings:
            seen = self.until_due()
            self.tracker.start_step(heading, self.pose, seen)
        return self.until_due()

    def _tick(self):
        pose, seen = self.pose, self.seen()
        self.velocity, _ = limit_command(
            self.tracker.velocity(pose), self.velocity, DT, (pose.x, pose.y, pose.yaw),
            seen.local_grid, LIMITS)
        v, w = self.velocity
        middle = pose.yaw + 0.5 * w * DT
        self.pose = Pose(pose.stamp + DT, pose.x + v * DT * math.cos(middle),
                         pose.y + v * DT * math.sin(middle), pose.yaw + w * DT)
        self.seconds += DT
        for box in self.seen().local_grid.boxes:
            self.clearance = min(self.clearance, distance_to_box(self.pose.x, self.pose.y, box))


def world_from(*lines):
    """Return the workspace with a drawing (# blocked) at its lower left, blocked elsewhere."""
    world = np.full(GRID.shape, 100, np.int8)
    for row, line in enumerate(reversed(lines)):
        for col, letter in enumerate(line):
            world[row, col] = 100 if letter == '#' else 0
    return world


def open_world():
    return np.zeros(GRID.shape, np.int8)


@pytest.mark.parametrize('first', range(8))
@pytest.mark.parametrize('second', range(8))
def test_two_steps_in_the_open_lead_where_they_say(first, second):
    robot = Robot(open_world(), (10, 10))
    seen = robot.follow([first, second])
    assert (seen.row, seen.col) == (10 + STEP_ROW[first] + STEP_ROW[second],
                                    10 + STEP_COL[first] + STEP_COL[second])


def test_a_straight_in_the_open_is_driven_without_stopping():
    robot = Robot(open_world(), (10, 2))
    robot.follow([0] * 12)
    assert 12 * 0.25 / robot.seconds > 0.2


def test_a_straight_corridor_is_driven_without_stopping():
    robot = Robot(world_from('#' * 20, '.' * 20, '#' * 20), (1, 2))
    robot.follow([0] * 12)
    assert 12 * 0.25 / robot.seconds > 0.2
    assert robot.clearance > 0.124


def test_a_narrow_corner_is_turned_on_the_spot():
    robot = Robot(world_from('###.#', '###.#', '....#', '#####'), (1, 0))
    robot.follow([0, 0, 0, 2, 2])
    assert robot.clearance > LIMITS.radius + 0.01


def test_a_dead_end_is_left_again():
    robot = Robot(world_from('#####', '....#', '#####'), (1, 0))
    seen = robot.follow([0, 0, 0, 4, 4])
    assert (seen.row, seen.col) == (1, 1)
    assert robot.clearance > LIMITS.radius + 0.01


def test_a_diagonal_between_two_walls_keeps_its_distance():
    robot = Robot(world_from('#..', '...', '..#'), (0, 0))
    robot.follow([1, 1])
    assert robot.clearance > LIMITS.radius + 0.01


def test_off_the_centre_in_a_tight_place_the_centre_comes_first():
    robot = Robot(world_from('####', '....', '####'), (1, 1), dx=0.05, dy=0.015)
    robot.until_due()
    x, y = GRID.world_from_cell(1, 1)
    assert math.hypot(robot.pose.x - x, robot.pose.y - y) < 0.02


def test_off_the_centre_in_the_open_is_due_at_once():
    robot = Robot(open_world(), (5, 5), dx=0.1, dy=-0.1)
    robot.until_due()
    assert robot.seconds == 0.0


@pytest.mark.parametrize('blocked', [(5, 6), (6, 6), (6, 5)])
def test_what_gets_in_the_way_sends_the_robot_back_to_decide(blocked):
    robot = Robot(open_world(), (5, 5), yaw=math.pi / 4)
    seen = robot.until_due()
    robot.tracker.start_step(1, robot.pose, seen)
    for _ in range(6):
        robot.tracker.update(robot.pose, robot.seen())
        robot._tick()
    robot.world[blocked] = 100
    seen = robot.until_due()
    assert (seen.row, seen.col) == (5, 5)
    x, y = GRID.world_from_cell(5, 5)
    assert math.hypot(robot.pose.x - x, robot.pose.y - y) < 0.02


def test_what_comes_into_sight_beside_the_way_makes_the_robot_keep_to_its_line():
    robot = Robot(open_world(), (5, 5))
    seen = robot.until_due()
    robot.tracker.start_step(0, robot.pose, seen)
    askew = dataclasses.replace(robot.pose, yaw=0.5)
    robot.tracker.update(askew, robot.seen())
    assert robot.tracker.velocity(askew)[0] > 0.0
    robot.world[6, 4] = 100
    robot.tracker.update(askew, robot.seen())
    assert robot.tracker.velocity(askew)[0] == 0.0
    assert robot.until_due().col == 6


def test_who_is_pushed_two_cells_off_the_way_decides_anew():
    robot = Robot(open_world(), (5, 5))
    seen = robot.until_due()
    robot.tracker.start_step(0, robot.pose, seen)
    robot.pose = dataclasses.replace(robot.pose, x=GRID.world_from_cell(5, 4)[0])
    assert robot.until_due().col == 4


def test_an_old_local_grid_lets_nothing_be_decided():
    robot = Robot(open_world(), (5, 5))
    robot.until_due()
    old = observation_from_neighbourhood(
        Neighbourhood(0.0, 5, 4, np.zeros((3, 3), np.int8)), GRID, LocalGridRules())
    robot.tracker.reset()
    robot.tracker.update(robot.pose, old)
    assert not robot.tracker.is_due(robot.pose, old)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.25, 0.4]))
def test_a_random_walk_among_obstacles_touches_nothing_and_gets_everywhere(seed, density):
    rng = np.random.default_rng(seed)
    world = np.where(rng.random(GRID.shape) < density, 100, 0).astype(np.int8)
    world[10, 10] = 0
    robot = Robot(world, (10, 10), yaw=rng.uniform(-3.0, 3.0))
    for _ in range(15):
        seen = robot.until_due()
        allowed = allowed_from_blocked(seen.blocked)
        free = [h for h in range(8) if allowed >> h & 1]
        if not free:
            break
        heading = int(rng.choice(free))
        robot.tracker.start_step(heading, robot.pose, seen)
        arrived = robot.until_due()
        assert (arrived.row, arrived.col) == (
            seen.row + STEP_ROW[heading], seen.col + STEP_COL[heading])
    assert robot.clearance > LIMITS.radius


def test_seen_agrees_with_the_masks_and_the_workspace():
    cells = np.array([[0, 100, -1], [0, 100, 0], [0, 0, 100]], np.int8)
    seen = observation_from_neighbourhood(Neighbourhood(0.0, 0, 5, cells), GRID, LocalGridRules())
    assert (seen.blocked, seen.unknown) == masks_from_neighbourhood(cells)
    assert seen.occupied == {(-1, 4), (-1, 5), (-1, 6), (1, 6)}
    cautious = observation_from_neighbourhood(
        Neighbourhood(0.0, 1, 5, cells), GRID, LocalGridRules(True))
    assert cautious.occupied == {(0, 5), (0, 6), (2, 6)}


def test_the_same_local_grid_is_made_ready_once():
    seen = ObservationCache().get
    cells = np.zeros((3, 3), np.int8)
    first = seen(Neighbourhood(0.0, 5, 5, cells), GRID, LocalGridRules())
    assert seen(Neighbourhood(1.0, 5, 5, cells.copy()), GRID, LocalGridRules()) is first
    assert seen(Neighbourhood(1.0, 5, 6, cells), GRID, LocalGridRules()) is not first


@pytest.mark.parametrize(('walls', 'aside'), [
    ([4], 0.06), ([6], -0.06), ([4, 6], 0.0), ([], 0.0)],
    ids=['below', 'above', 'both sides', 'open'])
def test_with_clearance_the_robot_keeps_aside_of_what_is_blocked_on_one_side(walls, aside):
    world = np.zeros(GRID.shape, np.int8)
    world[walls, 3:16] = 100
    robot = Robot(world, (5, 5), aside=0.06)
    seen = robot.follow([0] * 4)
    assert (seen.row, seen.col) == (5, 9)
    assert robot.pose.y - GRID.world_from_cell(5, 9)[1] == pytest.approx(aside, abs=0.012)


def test_clearance_never_brings_the_robot_to_the_edge_of_its_cell():
    world = np.zeros(GRID.shape, np.int8)
    world[4, 3:16] = 100
    robot = Robot(world, (5, 5), aside=10.0)
    robot.follow([0] * 4)
    assert robot.cell == (5, 9)
