"""A simulated robot on a map of small pixels: its start, what it meets, what is shown of it."""

from dataclasses import replace

import numpy as np
import pytest

from control_field.grid import Grid
from sim_node.loading import load, load_anew, picture_of
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from sim_node.start import largest_part, start_in
from world_maps.raster import Raster
from world_maps.world import load_world, save_world, World

#: A room of 4 x 3 m, walls of 10 cm, and a closet of 0.5 m that holds the default start.
ROOM = np.zeros((60, 80), dtype=np.int8)
ROOM[:2] = ROOM[-2:] = ROOM[:, :2] = ROOM[:, -2:] = 100
ROOM[10:24, [6, 19]] = ROOM[[10, 23], 6:20] = 100


@pytest.fixture
def world_file(tmp_path):
    return str(save_world(tmp_path / 'room.yaml', World(Grid(60, 80, 0.05), ROOM)))


def test_a_start_that_nobody_gave_is_in_the_largest_part_near_the_middle(world_file):
    loaded = load(SimSettings(world=world_file))
    assert (loaded.settings.start_x, loaded.settings.start_y) == (2.0, 1.5)
    [note] = loaded.notes
    assert '(0.625, 0.875) m is no place for the robot in the world room' in note
    assert 'starts at (2, 1.5) m' in note
    Simulation(loaded.world, loaded.settings)


def test_one_that_was_given_stays_or_is_the_nearest_free_cell(world_file):
    for given, start in (((0.7, 0.9), (0.7, 0.9)), ((3.99, 1.0), (3.75, 1.0))):
        loaded = load(SimSettings(world=world_file, start_x=given[0], start_y=given[1]))
        assert (loaded.settings.start_x, loaded.settings.start_y) == start
        assert len(loaded.notes) == (given != start)


def test_one_outside_is_for_the_simulation_to_refuse(world_file):
    loaded = load(SimSettings(world=world_file, start_x=-1.0))
    with pytest.raises(ValueError, match='start_x'):
        Simulation(loaded.world, loaded.settings)


def test_where_nothing_is_free_there_is_no_start():
    full = World(Grid(4, 4, 0.25), np.full((4, 4), 100))
    assert start_in(full, SimSettings()) == (SimSettings(), '')


def test_the_largest_part_hangs_together_by_its_sides():
    free = np.array([[1, 0, 1, 1], [0, 1, 0, 1], [1, 1, 0, 0]], dtype=bool)
    part = np.zeros_like(free)
    part[[0, 0, 1], [2, 3, 3]] = True
    np.testing.assert_array_equal(largest_part(free), part)
    assert not largest_part(np.zeros((2, 2), dtype=bool)).any()


def test_the_robot_runs_into_pixels_and_sees_cells(world_file):
    loaded = load(SimSettings(world=world_file, start_x=3.0, start_y=1.5))
    simulation = Simulation(loaded.world, loaded.settings)
    for _ in range(200):
        simulation.command(0.2, 0.0)
        simulation.tick(0.05)
    assert simulation.robot.truth.x == pytest.approx(3.9 - 0.105, abs=1e-6)
    assert simulation.n_collisions == 1
    seen = simulation.local_grid()
    row, col = loaded.world.grid.cell_from_world(3.75, 1.5)
    assert (seen.row, seen.col) == (row, col)
    np.testing.assert_array_equal(
        seen.cells[:, 0], loaded.world.occupancy[row - 1:row + 2, col - 1])
    assert (seen.cells[:, 2] == 100).all()
    assert seen.fine.shape == (15, 15)


def test_the_picture_is_the_pixels_or_larger_ones_if_they_are_too_many():
    cells, grid = picture_of(Raster(Grid(60, 80, 0.05), ROOM))
    assert grid == Grid(60, 80, 0.05)
    np.testing.assert_array_equal(cells, ROOM)
    many = np.zeros((2049, 2049), dtype=np.int8)
    many[2048, 0] = 100
    cells, grid = picture_of(Raster(Grid(2049, 2049, 0.05, 1.0, 2.0), many))
    assert grid == Grid(1025, 1025, 0.1, 1.0, 2.0)
    np.testing.assert_array_equal(np.argwhere(cells), [[1024, 0]])


def test_what_makes_another_world_is_read_anew(world_file):
    so_far = SimSettings(world=world_file)
    world = load(so_far).world
    assert load_anew(so_far, {'slip': 0.1, 'start_x': 1.0}, world) is None
    assert load_anew(so_far, {'resolution': 0.5}, world).world.grid.resolution == 0.5
    assert load_anew(so_far, {'robot_radius': 0.22}, world).world.grid.resolution == 0.5
    assert load_anew(so_far, {'robot_radius': 0.105, 'world': 'task1'}, world).world.drawn is None
    of_cells = load_world(world_file, resolution=0.05)
    plain = replace(of_cells, drawn=None, grid=Grid(20, 20, 0.25), occupancy=np.zeros((20, 20)))
    assert load_anew(SimSettings(), {'robot_radius': 0.12}, plain) is None
    with pytest.raises(ValueError, match='no such file'):
        load_anew(so_far, {'world': '/nowhere.yaml'}, world)
