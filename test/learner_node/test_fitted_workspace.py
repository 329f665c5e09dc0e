"""A learner whose workspace fits itself: which cells, how much of it, and where the robot is."""

import numpy as np
import pytest

from bridge_helpers import GRID
from control_field.grid import CellBox, default_lattice, fitted_workspace, Grid, TooLargeError
from control_field.parameters import Parameters
from control_field.poses import StartPose
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind, TaskFolder
from fitted_bags import demo
from learner_node.learning.task_memory import TaskMemory
from learner_node.recording.cells_check import CellsCheck
from learner_node.session.room_watch import RoomWatch
from learner_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import (
    grid_from_neighbourhood, lattice_from_local_grid, Neighbourhood)
from msgs_bridge.messages.serialized import cdr_from_message

HERE = default_lattice(0.25)
FAR = (-6.0, 3.0)


def local_grid(grid, row=5, col=7, n=3, k=1):
    """Return a local grid on cells of a grid, or on k finer ones along a side of each."""
    cells = np.zeros((n, n), np.int8)
    fine = None if k == 1 else np.zeros((n * k, n * k), np.int8)
    return grid_from_neighbourhood(
        Neighbourhood(1.0, row, col, cells, grid.frame_id, fine), grid)


class TestCells:
    def check(self, **settings):
        return CellsCheck(Settings(**settings))

    @pytest.mark.parametrize(('side', 'radius'), [(0.25, 0.105), (0.4, 0.175), (0.5, 0.22)])
    def test_before_a_local_grid_they_are_as_large_as_the_robot_needs(self, side, radius):
        assert self.check(robot_radius=radius).lattice(b'') == default_lattice(side)
        assert self.check(resolution=0.3).lattice(b'') == default_lattice(0.3)

    @pytest.mark.parametrize('grid', [
        Grid(20, 20, 0.25), Grid(9, 9, 0.3, -7.03, 2.04), Grid(40, 40, 1 / 3, 0.1, 0.2)])
    def test_then_they_are_those_of_the_local_grids_wherever_these_lie(self, grid):
        heard = cdr_from_message(local_grid(grid))
        for lattice in (self.check().lattice(heard), self.check(robot_radius=0.3).lattice(heard)):
            assert abs(lattice.resolution - grid.resolution) < 1e-7
            x, y = lattice.world_from_cell(0, 0)
            row, col = grid.cell_from_world(x, y)
            assert grid.world_from_cell(row, col) == pytest.approx((x, y), abs=1e-6)
        assert not self.check().problem(heard, None)

    @pytest.mark.parametrize(('side', 'k'), [(0.05, 5), (0.05, 3), (0.08, 3), (0.25, 1), (0.1, 3)])
    def test_of_finer_cells_so_many_make_one_as_it_comes_nearest(self, side, k):
        fine = Grid(300, 300, side, -1.0, -2.0)
        msg = local_grid(Grid(100, 100, side * k, -1.0, -2.0), n=15 // k, k=1) if k == 1 else (
            local_grid(fine, n=15))
        lattice = lattice_from_local_grid(msg, side * k)
        assert lattice.resolution == pytest.approx(side * k, rel=1e-6)
        assert lattice.offset_to(Grid(1, 1, lattice.resolution, msg.info.origin.position.x,
                                      msg.info.origin.position.y)) is not None

    def test_finer_cells_of_a_large_robot_are_told_from_small_ones_by_what_nodes_say(self):
        heard = cdr_from_message(local_grid(Grid(40, 40, 0.5), k=3))
        assert self.check().lattice(heard).resolution == pytest.approx(0.5 / 3, rel=1e-6)
        check = CellsCheck(Settings(), lambda: Grid(1, 1, 0.5))
        assert check.lattice(heard).resolution == 0.5
        assert not check.problem(heard, None)

    def test_what_contradicts_the_resolution_that_is_set_is_said_with_what_to_set(self):
        check, heard = self.check(resolution=0.3), cdr_from_message(local_grid(GRID))
        problem = check.problem(heard, None)
        assert 'resolution:=0.25 or without it' in problem
        assert 'neighbourhood with resolution:=0.3' in problem
        assert check.lattice(heard) == default_lattice(0.3)
        assert not self.check(resolution=0.25).problem(heard, None)

    def test_what_was_learnt_has_the_cells_it_has(self):
        learnt = fitted_workspace(HERE, np.zeros((1, 2)))
        check = self.check()
        fits = cdr_from_message(local_grid(HERE.window(CellBox(-40, -50, 9, 9))))
        assert not check.problem(fits, learnt)
        assert not check.problem(b'', learnt)
        for other in (Grid(20, 20, 0.3), Grid(20, 20, 0.25)):
            assert 'begin another task' in check.problem(
                cdr_from_message(local_grid(other)), learnt)

    def test_what_cannot_be_read_says_nothing_here(self):
        check = self.check()
        for heard in (b'nonsense', cdr_from_message(local_grid(Grid(9, 9, 0.25, frame_id='map')))):
            assert check.lattice(heard) == HERE
            assert not check.problem(heard, None)


class TestTaskMemory:
    @pytest.fixture
    def task(self, tmp_path):
        """Return a task with one demonstration, around (0, 0)."""
        task = TaskFolder(tmp_path, 'task1')
        demo(task, [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0)])
        return task

    def memory(self, task, **more):
        memory = TaskMemory(task, None, Parameters(), **more)
        memory.relearn()
        return memory

    def header(self, memory, kind=EpisodeKind.DEMO):
        return EpisodeHeader.from_mapping(memory.header(kind))

    def test_a_first_demonstration_begins_around_the_robot(self, tmp_path):
        memory = self.memory(TaskFolder(tmp_path, 'task1'))
        memory.robot, memory.lattice = (lambda: FAR), lambda: default_lattice(0.4)
        header = self.header(memory)
        assert header.fitted
        assert header.grid == fitted_workspace(default_lattice(0.4), np.array([FAR]))
        assert memory.learnt_grid is None
        assert memory.has_room(FAR)

    def test_an_explicit_workspace_is_as_it_was(self, tmp_path):
        memory = TaskMemory(TaskFolder(tmp_path, 'task1'), GRID, Parameters())
        memory.robot = lambda: FAR
        header = self.header(memory)
        assert (header.grid, header.fitted) == (GRID, False)
        assert memory.has_room(FAR)
        memory.make_room()
        assert memory.grid == GRID

    def test_where_the_robot_stands_the_field_comes_to_it(self, task):
        memory = self.memory(task)
        before, grid = memory.memory, memory.grid
        assert not memory.has_room(FAR)
        memory.robot = lambda: FAR
        memory.make_room()
        assert memory.has_room(FAR)
        assert memory.field().grid == memory.grid == memory.driven.field.grid
        assert memory.memory == before
        assert memory.learnt_grid == memory.refresh.field.grid == grid
        assert self.header(memory, EpisodeKind.TRIAL).grid == memory.grid

    def test_where_trials_start_there_is_room_from_the_beginning(self, task):
        memory = self.memory(task, starts=(StartPose(*FAR),))
        assert memory.has_room(FAR)

    def test_what_is_too_far_away_is_said_and_the_field_stays(self, task):
        memory = self.memory(task)
        grid = memory.grid
        memory.robot = lambda: (1e6, 1e6)
        with pytest.raises(TooLargeError, match='resolution'):
            memory.make_room()
        memory.relearn()
        assert memory.grid == grid
        assert 'resolution' in memory.too_far

    def test_other_cells_than_are_asked_for_are_refused(self, task):
        memory = TaskMemory(task, None, Parameters())
        memory.resolution = 0.3
        with pytest.raises(BagError, match='leave resolution out'):
            memory.relearn()
        memory.resolution = 0.25
        memory.relearn()


class TestRoomWatch:
    def test_a_robot_that_stands_outside_is_asked_room_for_once(self):
        watch = RoomWatch(lambda place: place[0] < 2.0)
        assert not watch.look(None, True)
        assert not watch.look((3.0, 0.0), True)  # it may be driving
        assert watch.look((3.0, 0.0), True)
        assert not watch.look((3.0, 0.001), True)
        assert not watch.look((3.5, 0.0), True)
        assert watch.look((3.5, 0.0), True)

    def test_meanwhile_and_inside_nothing_is_asked(self):
        watch = RoomWatch(lambda place: place[0] < 2.0)
        for _ in range(3):
            assert not watch.look((3.0, 0.0), False)
            assert not watch.look((1.0, 0.0), True)
        assert not watch.look((3.0, 0.0), True)
        assert watch.look((3.0, 0.0), True)
