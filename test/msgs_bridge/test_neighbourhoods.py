"""Occupancy grids: the 3x3 local grid and whole maps."""

import array
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from bridge_helpers import grids, spoil
from control_field.grid import Grid
from msgs_bridge.messages.neighbourhoods import (
    grid_from_neighbourhood, map_from_occupancy, Neighbourhood, neighbourhood_from_grid,
    occupancy_from_map)

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
    ('info.width', 4, 'size is 3 x 4, must be 3 x 3'),
    ('info.height', 2**32 - 1, 'must be 3 x 3'),
    ('data', array.array('b', [0] * 8), '8 cells of data, must be 3 x 3'),
    ('data', array.array('b'), '0 cells of data'),
    ('data', array.array('b', [0] * 8 + [50]), 'a cell is 50, must be 0, 100 or -1'),
    ('info.resolution', 0.3, 'resolution is 0.3 m, must be 0.25 m'),
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


@pytest.mark.parametrize('cells', [np.zeros((3, 4)), np.full((3, 3), 7)])
def test_no_neighbourhood(cells):
    with pytest.raises(ValueError, match='neighbourhood: '):
        Neighbourhood(0.0, 0, 0, cells.astype(np.int8))


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
