"""What the simulated robot sees: as far as it is set, and nothing behind something."""

from dataclasses import replace

import numpy as np
import pytest

from control_field.grid import Grid
from sim_node.robot import Placement
from sim_node.seen import seen_from
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.mover import Mover, Waypoint
from world_maps.movers import Disc
from world_maps.window import true_window
from world_maps.world import World

GRID = Grid(20, 20, 0.25)
HERE = 10, 10


def world_with(*blocked):
    occupancy = np.zeros(GRID.shape, np.int8)
    for cell in blocked:
        occupancy[cell] = 100
    return World(GRID, occupancy, 'seen')


def see(world, discs=(), **settings):
    return seen_from(world, discs, *HERE, SimSettings(**settings))


def test_three_cells_are_the_true_window_as_ever():
    world = world_with((9, 10), (10, 9), (9, 9))
    seen = see(world, sight_range=0.1)
    np.testing.assert_array_equal(seen.cells, true_window(world, (), *HERE))
    assert seen.fine is None


def test_behind_a_wall_all_is_unknown_and_the_nine_are_as_with_three_cells():
    world = world_with(*((12, col) for col in range(20)), (10, 11), (11, 10))
    seen = see(world, sight_cells=15)
    assert seen.cells.shape == (15, 15)
    np.testing.assert_array_equal(seen.cells[6:9, 6:9], true_window(world, (), *HERE))
    assert (seen.cells[10:] == -1).all()
    assert (seen.cells[9, :6] == 100).all()


def test_who_moves_hides_what_is_behind():
    world = world_with()
    disc = Disc(*GRID.world_from_cell(10, 12), 0.1)
    seen = see(world, [disc], sight_cells=15).cells
    assert seen[7, 9] == 100
    assert (seen[7, 10:] == -1).all()
    assert (see(world, sight_cells=15).cells == 0).all()


def test_beyond_the_range_nothing_is_seen_but_beyond_the_workspace_is_wall():
    rows, cols = np.indices((31, 31)) - 15
    seen = see(world_with(), sight_cells=31, sight_range=1.0).cells
    np.testing.assert_array_equal(seen, np.where(np.hypot(rows, cols) <= 4.0, 0, -1))
    assert (see(world_with(), sight_cells=23).cells[0] == 100).any()


@pytest.mark.parametrize('sight_cells', [3, 7])
def test_finer_cells_show_where_in_a_cell_something_is(sight_cells):
    x, y = GRID.world_from_cell(10, 11)
    seen = see(world_with(), [Disc(x + 0.1, y, 0.04)], sight_cells=sight_cells,
               sight_subdivision=5)
    reach = sight_cells // 2
    assert seen.fine.shape == (5 * sight_cells,) * 2
    assert seen.cells[reach, reach + 1] == 100
    cell = seen.fine[5 * reach:5 * reach + 5, 5 * reach + 5:5 * reach + 10]
    assert (cell[:, :3] == 0).all()
    assert (cell == 100).any()


def test_the_simulation_sees_what_moves_now():
    x, y = GRID.world_from_cell(10, 13)
    mover = Mover(0.1, waypoints=(Waypoint(x, y, 1.0), Waypoint(x, y + 1.0, 99.0)), mode='once')
    simulation = Simulation(world_with(), SimSettings(sight_cells=9), [mover])
    simulation.place(Placement(*GRID.world_from_cell(*HERE), 0.0))
    assert simulation.local_grid().cells[4, 7:].tolist() == [100, -1]
    for _ in range(200):
        simulation.tick(0.05)
    assert not simulation.local_grid().cells[4].any()


@pytest.mark.parametrize(('name', 'value'), [
    ('sight_cells', 4), ('sight_cells', 63), ('sight_cells', 1), ('sight_cells', 5.0),
    ('sight_subdivision', 2), ('sight_subdivision', 7), ('sight_range', -1.0),
    ('sight_range', float('nan'))])
def test_what_it_cannot_see_by_is_refused(name, value):
    with pytest.raises(ValueError, match=name):
        replace(SimSettings(), **{name: value})


def test_a_share_of_the_cells_is_shown_wrongly_the_same_in_a_tick_and_a_run():
    def run():
        simulation, shown = Simulation(world_with((3, 3)), SimSettings(sight_flips=0.1)), []
        for _ in range(300):
            simulation.tick(0.05)
            shown.append(simulation.local_grid().cells)
            np.testing.assert_array_equal(shown[-1], simulation.local_grid().cells)
        return np.array(shown), true_window(simulation.world, (), 3, 2)

    shown, truth = run()
    wrong = shown != truth
    assert wrong.any(axis=0).all()
    assert 0.07 < wrong.mean() < 0.13
    np.testing.assert_array_equal(shown, run()[0])
