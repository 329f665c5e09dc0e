"""Occupancy grids: the 3x3 local grid and whole maps."""

import array
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from bridge_helpers import grids, spoil
from control_field.grid import Grid
from control_field.local_grid import cells_from_fine
from msgs_bridge.messages.neighbourhoods import (
    cells_of_local_grid, grid_from_neighbourhood, map_from_occupancy, Neighbourhood,
    neighbourhood_from_grid, occupancy_from_map)

GRID = Grid(20, 30, 0.25, -1.0, 2.0)
states = st.lists(st.sampled_from([0, 100, -1]), min_size=9, max_size=9)


def message(row=3, col=4):
    cells = np.array([[0, 100, -1], [0, 0, 0], [100, 100, 0]], dtype=np.int8)
    return grid_from_neighbourhood(Neighbourhood(1.5, row, col, cells), GRID)


@given(grids, states, st.data())
def test_neighbourhood_round_trip(grid, cells, data):
    row = data.draw(st.integers(0, grid.n_rows - 1))
    col = data.draw(st.integers(0, grid.n_cols - 1))
    seen = Neighbourhood(
        1.5, row, col, np.array(cells, dtype=np.int8).reshape(3, 3), grid.frame_id)
    read = neighbourhood_from_grid(grid_from_neighbourhood(seen, grid), grid)
    assert (read.stamp, read.row, read.col, read.frame_id) == (1.5, row, col, grid.frame_id)
    np.testing.assert_array_equal(read.cells, seen.cells)


@pytest.mark.parametrize(('name', 'value', 'sentence'), [
    ('header.frame_id', 'map', "frame is 'map', must be 'odom'"),
    ('info.width', 4, 'size is 3 x 4, must be square, of an odd number of cells from 3 to 61'),
    ('info.height', 2**32 - 1, 'must be square'),
    ('data', array.array('b', [0] * 8), '8 cells of data, must be 3 x 3'),
    ('data', array.array('b'), '0 cells of data'),
    ('data', array.array('b', [0] * 8 + [50]), 'a cell is 50, must be 0, 100 or -1'),
    ('info.resolution', 0.3, 'resolution is 0.3 m, must be 0.25 m, or a third or a fifth of it'),
    ('info.resolution', 0.125, 'resolution is 0.125 m, must be 0.25 m'),
    ('info.resolution', 0.05, 'size is 3 x 3, must be .*, each of 5 x 5 finer ones'),
    ('info.resolution', 0.0, 'resolution is 0.0 m, must be above 0'),
    ('info.resolution', math.nan, 'resolution is nan'),
    ('info.resolution', math.inf, 'resolution is inf'),
    ('info.origin.position.x', math.nan, 'is not finite'),
    ('info.origin.position.y', math.inf, 'is not finite'),
    ('info.origin.position.x', 0.1, 'cells off those of the workspace'),
    ('info.origin.position.x', 0.2, 'cells off those of the workspace'),
    ('info.resolution', 1e-6, 'must be 1e-05 to 100000'),
    ('info.resolution', 1e6, 'must be 1e-05 to 100000'),
    ('info.origin.position.y', 1e300, 'must be within 1e.09 m'),
    ('info.origin.position.x', -5.0, r'its middle is cell \(3, -15\)'),
    ('info.origin.orientation.w', 0.0, 'must be a quaternion'),
    ('info.origin.orientation.z', 0.1, 'origin is turned by'),
    ('header.stamp.nanosec', 2**32 - 1, 'stamp is'),
])
def test_what_is_refused_says_why(name, value, sentence):
    msg = message()
    spoil(msg, name, value)
    with pytest.raises(ValueError, match=f'neighbourhood: .*{sentence}'):
        neighbourhood_from_grid(msg, GRID)


def test_a_neighbourhood_outside_the_workspace_is_refused():
    with pytest.raises(ValueError, match=r'cell \(20, 4\)'):
        neighbourhood_from_grid(message(row=20), GRID)


@pytest.mark.parametrize('cells', [
    np.zeros((3, 4)), np.full((3, 3), 7), np.zeros((1, 1)), np.zeros((4, 4)), np.zeros((63, 63))])
def test_no_neighbourhood(cells):
    with pytest.raises(ValueError, match='neighbourhood: '):
        Neighbourhood(0.0, 0, 0, cells.astype(np.int8))


@pytest.mark.parametrize('fine', [np.zeros((6, 6)), np.full((9, 9), 7), np.zeros((9, 15))])
def test_no_finer_cells(fine):
    with pytest.raises(ValueError, match='neighbourhood: '):
        Neighbourhood(0.0, 0, 0, np.zeros((3, 3), np.int8), fine=fine.astype(np.int8))


def random_cells(n, seed):
    return np.random.default_rng(seed).choice(np.array([0, 0, 0, 100, -1], np.int8), (n, n))


@given(grids, st.integers(1, 30), st.sampled_from([1, 3, 5]), st.integers(0, 2**32), st.data())
def test_a_wide_and_a_finer_neighbourhood_round_trip(grid, reach, k, seed, data):
    row = data.draw(st.integers(0, grid.n_rows - 1))
    col = data.draw(st.integers(0, grid.n_cols - 1))
    fine = random_cells((2 * reach + 1) * k, seed)
    cells = cells_from_fine(fine, k)
    seen = Neighbourhood(1.5, row, col, cells, grid.frame_id, fine if k > 1 else None)
    msg = grid_from_neighbourhood(seen, grid)
    read = neighbourhood_from_grid(msg, grid)
    assert (read.row, read.col, read.is_wide) == (row, col, reach > 1)
    np.testing.assert_array_equal(read.cells, cells)
    np.testing.assert_array_equal(read.nine, cells[reach - 1:reach + 2, reach - 1:reach + 2])
    assert (read.fine is None) == (k == 1)
    if k > 1:
        np.testing.assert_array_equal(read.fine, fine)
    alone = neighbourhood_from_grid(msg, cells_of_local_grid(msg))
    assert alone.row == alone.col == len(alone.cells) // 2


@pytest.mark.parametrize(('n', 'resolution', 'radius', 'side'), [
    (15, 0.05, 0.105, 0.25), (15, 0.25, 0.105, 0.25), (9, 0.5 / 3, 0.22, 0.5),
    (15, 0.05, 0.22, 0.25), (3, 0.5, 0.105, 0.5)])
def test_parts_make_up_cells_of_the_robots_size(n, resolution, radius, side):
    msg = map_from_occupancy(np.zeros((n, n), np.int8), Grid(n, n, resolution, -1.0, 2.0))
    cells = cells_of_local_grid(msg, radius)
    assert cells.resolution == pytest.approx(side)
    assert cells.n_rows == round(n * resolution / side)


@pytest.mark.parametrize(('n', 'k', 'sentence'), [
    (63, 1, 'size is 63 x 63, must be square, of an odd number of cells from 3 to 61'),
    (4, 1, 'size is 4 x 4'), (1, 1, 'size is 1 x 1'), (2, 1, 'size is 2 x 2'),
    (3, 3, 'size is 3 x 3, .* each of 3 x 3 finer ones'), (12, 3, 'size is 12 x 12'),
    (13, 3, 'size is 13 x 13'), (189, 3, 'size is 189 x 189'), (307, 1, 'size is 307 x 307'),
    (5, 3, 'size is 5 x 5')])
def test_a_local_grid_of_no_such_size_is_refused(n, k, sentence):
    local = Grid(n, n, GRID.resolution / k, GRID.origin_x, GRID.origin_y)
    msg = map_from_occupancy(np.zeros((n, n), np.int8), local)
    with pytest.raises(ValueError, match=f'neighbourhood: {sentence}'):
        neighbourhood_from_grid(msg, GRID)


def test_finer_cells_must_lie_on_the_cells_of_the_workspace():
    local = Grid(9, 9, GRID.resolution / 3, GRID.origin_x + GRID.resolution / 3, GRID.origin_y)
    with pytest.raises(ValueError, match='cells off those of the workspace'):
        neighbourhood_from_grid(map_from_occupancy(np.zeros((9, 9), np.int8), local), GRID)


def test_a_cell_is_what_its_finer_cells_are():
    fine = np.zeros((9, 9), np.int8)
    fine[0, 1], fine[1, 0], fine[3, 3], fine[8, 8] = 100, -1, -1, 100
    assert cells_from_fine(fine, 3).tolist() == [[100, 0, 0], [0, -1, 0], [0, 0, 100]]


@given(grids, st.integers(0, 2**32))
def test_map_round_trip(grid, seed):
    occupancy = np.random.default_rng(seed).integers(-1, 101, grid.shape).astype(np.int8)
    read_grid, read = occupancy_from_map(map_from_occupancy(occupancy, grid, 2.5))
    np.testing.assert_array_equal(read, occupancy)
    assert read_grid.shape == grid.shape
    assert read_grid.resolution == pytest.approx(grid.resolution, rel=1e-7)
    assert (read_grid.origin_x, read_grid.origin_y) == (grid.origin_x, grid.origin_y)


@pytest.mark.parametrize(('name', 'value', 'sentence'), [
    ('info.width', 2**32 - 1, '600 cells of data, must be 20 x 4294967295'),
    ('data', array.array('b', [-2] * 600), 'values reach from -2 to -2, must be -1 to 100'),
    ('data', array.array('b', [0] * 599 + [101]), 'values reach from 0 to 101, must be'),
    ('data', array.array('b', [0] * 599 + [-2]), 'values reach from -2 to 0, must be'),
    ('data', array.array('b'), '0 cells of data'),
])
def test_a_map_that_is_none_is_refused(name, value, sentence):
    msg = map_from_occupancy(np.zeros(GRID.shape, dtype=np.int8), GRID)
    spoil(msg, name, value)
    with pytest.raises(ValueError, match=f'map: .*{sentence}'):
        occupancy_from_map(msg)


def test_a_map_of_another_shape_is_not_written():
    with pytest.raises(ValueError, match='occupancy has shape'):
        map_from_occupancy(np.zeros((2, 2), dtype=np.int8), GRID)


@pytest.mark.parametrize('x', [1e300, -1.7e308])
def test_an_origin_that_no_cell_has_is_refused(x):
    msg = grid_from_neighbourhood(Neighbourhood(1.0, 1, 1, np.zeros((3, 3), np.int8)), GRID)
    msg.info.origin.position.x = x
    with pytest.raises(ValueError, match='must be within'):
        neighbourhood_from_grid(msg, GRID)
