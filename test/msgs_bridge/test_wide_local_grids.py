"""Local grids of more than nine cells, and of finer ones, from scans and costmaps."""

import math
import time

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, cells_from_fine, FREE, middle_of, UNKNOWN
from control_field.poses import Placement
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.local_grid_from_costmap import neighbourhood_from_costmap
from msgs_bridge.sensing.local_grid_from_scan import Body, Extent, neighbourhood_from_scan
from msgs_bridge.sensing.scan import Scan
from strategies import few

GRID = Grid(40, 40, 0.25)
CELL = (20, 20)
N_RAYS = 360
BODY = Body(0.105)
seeds = st.integers(0, 2**32 - 1)


def world_of(*cells):
    occupancy = np.zeros(GRID.shape, np.int8)
    for cell in cells:
        occupancy[cell] = BLOCKED
    return occupancy


def scan_of(occupancy, robot, high=2.5):
    """Follow rays through a map, 4 mm by 4 mm."""
    ahead = np.arange(0.0, high, 0.004)
    angles = np.arange(N_RAYS) * math.tau / N_RAYS
    x = robot.x + ahead * np.cos(angles + robot.yaw)[:, np.newaxis]
    y = robot.y + ahead * np.sin(angles + robot.yaw)[:, np.newaxis]
    rows, cols = (np.clip(np.floor(each / 0.25).astype(int), 0, 39) for each in (y, x))
    hit = occupancy[rows, cols] == BLOCKED
    is_return = hit.any(axis=1)
    reach = np.where(is_return, ahead[hit.argmax(axis=1)], high)
    return Scan(0.0, 0.0, math.tau / N_RAYS, reach, is_return)


def look(occupancy, n=3, k=1, radius=math.inf, offset=(0.0, 0.0), scan=None):
    x, y = GRID.world_from_cell(*CELL)
    robot = Placement(x + offset[0], y + offset[1], 0.3)
    return neighbourhood_from_scan(
        scan or scan_of(occupancy, robot), robot, Mount(), CELL, GRID, BODY,
        Extent(n, k, radius))


def random_world(seed):
    rng = np.random.default_rng(seed)
    occupancy = np.where(rng.random(GRID.shape) < 0.1, BLOCKED, FREE).astype(np.int8)
    occupancy[CELL] = FREE
    return occupancy


@few
@given(seeds, st.sampled_from([5, 15, 29]), st.sampled_from([0.3, math.inf]))
def test_the_nine_in_the_middle_are_the_same_however_far_is_looked(seed, n, radius):
    occupancy = random_world(seed)
    np.testing.assert_array_equal(middle_of(look(occupancy, n, radius=radius)), look(occupancy))


@few
@given(seeds)
def test_what_a_scan_shows_is_true_and_most_of_what_it_can_show_is_shown(seed):
    occupancy = random_world(seed)
    cells = look(occupancy, 15)
    window = occupancy[13:28, 13:28]
    assert (window[cells == FREE] == FREE).all()
    # A return on a corner may be taken for one of the cell beside.
    assert (window[cells == BLOCKED] == BLOCKED).mean() > 0.75
    assert (cells != UNKNOWN).sum() > 30


def test_behind_a_wall_all_is_unknown():
    occupancy = world_of(*((23, col) for col in range(40)))
    cells = look(occupancy, 15)
    assert (cells[10, 3:12] == BLOCKED).all()
    assert (cells[11:] == UNKNOWN).all()
    assert (cells[4:10, 4:11] == FREE).all()


def test_beyond_the_range_nothing_is_seen():
    occupancy = world_of((20, 24), (20, 16))
    assert look(occupancy, 15)[7, [3, 11]].tolist() == [BLOCKED, BLOCKED]
    cells = look(occupancy, 15, radius=0.8)
    assert cells[7].tolist() == [UNKNOWN] * 4 + [FREE] * 7 + [UNKNOWN] * 4


@few
@given(seeds, st.sampled_from([3, 9]), st.sampled_from([3, 5]))
def test_finer_cells_make_up_the_cells(seed, n, k):
    occupancy = random_world(seed)
    fine, cells = look(occupancy, n, k), look(occupancy, n)
    assert fine.shape == (n * k, n * k)
    made_up = cells_from_fine(fine, k)
    # A return on an edge may count to the other side of it among finer cells.
    assert (made_up != cells).mean() < 0.15
    assert not ((made_up == UNKNOWN) & (cells == FREE)).any()


def test_finer_cells_show_what_stands_in_the_own_cell():
    x, y = GRID.world_from_cell(*CELL)
    returns = np.full(N_RAYS, 3.5)
    returns[:20] = 0.12  # ahead of a robot that stands at the left edge of its cell
    scan = Scan(0.0, 0.0, math.tau / N_RAYS, returns, returns < 3.5)
    fine = neighbourhood_from_scan(scan, Placement(x - 0.06, y, 0.0), Mount(), CELL, GRID,
                                   Body(0.105), Extent(3, 5))
    own = fine[5:10, 5:10]
    assert (own == BLOCKED).any()
    assert own[2, 2] == FREE
    assert np.flatnonzero((own == BLOCKED).any(axis=0)).tolist() == [3]


@given(seeds, st.sampled_from([5, 15]), st.sampled_from([1, 3]), st.sampled_from([0.0, 0.2]))
def test_of_a_costmap_the_nine_are_the_same_and_behind_something_is_unknown(seed, n, k, radius):
    costmap, values = GRID, random_world(seed)
    cells = cells_from_fine(neighbourhood_from_costmap(
        costmap, values, CELL, GRID, radius=radius, extent=Extent(n, k)), k)
    nine = cells_from_fine(neighbourhood_from_costmap(
        costmap, values, CELL, GRID, radius=radius, extent=Extent(3, k)), k)
    np.testing.assert_array_equal(middle_of(cells), nine)
    if not radius:
        reach = n // 2
        window = values[20 - reach:21 + reach, 20 - reach:21 + reach]
        assert (cells[cells != UNKNOWN] == window[cells != UNKNOWN]).all()


def test_a_costmap_that_is_free_where_nobody_looked_says_nothing_of_it():
    values = world_of(*((22, col) for col in range(40)))
    cells = neighbourhood_from_costmap(GRID, values, CELL, GRID, extent=Extent(9))
    assert (cells[6] == BLOCKED).all()
    assert (cells[7:] == UNKNOWN).all()
    far = neighbourhood_from_costmap(GRID, values, CELL, GRID, extent=Extent(9, 1, 0.5))
    assert (far[:2] == UNKNOWN).all()


@pytest.mark.parametrize('k', [1, 3])
def test_outside_the_workspace_is_blocked(k):
    extent, robot = Extent(5, k), Placement(*GRID.world_from_cell(0, 39), 0.0)
    open_scan = Scan(0.0, 0.0, math.tau / N_RAYS, np.full(N_RAYS, 3.5), np.zeros(N_RAYS, bool))
    for cells in (neighbourhood_from_costmap(GRID, world_of(), (0, 39), GRID, extent=extent),
                  neighbourhood_from_scan(open_scan, robot, Mount(), (0, 39), GRID, BODY, extent)):
        assert (cells[k:2 * k, 2 * k:3 * k] == BLOCKED).all()
        assert (cells[2 * k:3 * k, 3 * k:4 * k] == BLOCKED).all()
        assert (cells[2 * k:, :3 * k] == FREE).all()


def test_a_look_of_29_cells_costs_little():
    occupancy = random_world(1)
    scan = scan_of(occupancy, Placement(*GRID.world_from_cell(*CELL), 0.3))
    fastest = math.inf
    for _ in range(9):
        began = time.process_time()
        look(occupancy, 29, scan=scan)
        fastest = min(fastest, time.process_time() - began)
    assert fastest < 0.01  # 0.8 ms where it was measured
