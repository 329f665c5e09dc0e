"""Neighbourhoods from larger occupancy grids."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, crop_neighbourhood, FREE, UNKNOWN
from msgs_bridge.messages.neighbourhoods import map_from_occupancy, occupancy_from_map
from msgs_bridge.sensing.local_grid_from_costmap import neighbourhood_from_costmap

GRID = Grid(20, 20, 0.25, -1.0, 2.0)


def fine_map(states, factor, grid=GRID):
    """Return the same map with each cell cut into ``factor`` x ``factor``."""
    costmap = Grid(grid.n_rows * factor, grid.n_cols * factor, grid.resolution / factor,
                   grid.origin_x, grid.origin_y)
    return costmap, np.kron(states, np.ones((factor, factor), dtype=np.int8)).astype(np.int8)


maps = st.integers(0, 2**32 - 1).map(
    lambda seed: np.random.default_rng(seed).choice(
        np.array([FREE, BLOCKED, UNKNOWN], np.int8), (20, 20)))
indices = st.integers(0, 19)


@given(maps, st.integers(1, 7), indices, indices)
def test_a_finer_map_of_the_same_cells_shows_the_same(states, factor, row, col):
    costmap, values = fine_map(states, factor)
    np.testing.assert_array_equal(
        neighbourhood_from_costmap(costmap, values, (row, col), GRID),
        crop_neighbourhood(states, row, col))


@given(maps, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.02, 0.6), indices, indices)
def test_a_map_that_lies_anyhow_is_pooled(states, x, y, side, row, col):
    """Against pooling over points, a few a cell."""
    costmap = Grid(20, 20, side, x, y)
    cells = neighbourhood_from_costmap(costmap, states, (row, col), GRID)
    steps = (np.arange(60) + 0.5) / 60
    for i in range(3):
        for j in range(3):
            if not GRID.contains(row - 1 + i, col - 1 + j):
                assert cells[i, j] == BLOCKED
                continue
            low_x = GRID.origin_x + (col - 1 + j + steps) * GRID.resolution
            low_y = GRID.origin_y + (row - 1 + i + steps) * GRID.resolution
            at = np.floor((low_y - y) / side).astype(int), np.floor((low_x - x) / side).astype(int)
            inside = [(k >= 0) & (k < 20) for k in at]
            seen = np.full((60, 60), UNKNOWN, np.int8)
            places = np.ix_(inside[0], inside[1])
            seen[places] = states[np.ix_(at[0][inside[0]], at[1][inside[1]])]
            if (seen == BLOCKED).any():
                assert cells[i, j] == BLOCKED
            elif cells[i, j] != BLOCKED:  # what blocked it may be narrower than the points
                known = (seen != UNKNOWN).mean()
                if abs(known - 0.5) > 0.05:
                    assert cells[i, j] == (FREE if known > 0.5 else UNKNOWN)


@pytest.mark.parametrize(('value', 'lethal', 'state'), [
    (64, 65, FREE), (65, 65, BLOCKED), (100, 65, BLOCKED), (99, 100, FREE), (100, 100, BLOCKED),
    (-1, 65, UNKNOWN), (1, 1, BLOCKED)])
def test_the_threshold(value, lethal, state):
    states = np.zeros((20, 20), np.int8)
    states[5, 6] = value
    cells = neighbourhood_from_costmap(GRID, states, (5, 5), GRID, lethal=lethal)
    expected = np.zeros((3, 3), np.int8)
    expected[1, 2] = state
    np.testing.assert_array_equal(cells, expected)


def test_one_lethal_cell_is_enough():
    states = np.zeros((20, 20), np.int8)
    costmap, values = fine_map(states, 5)
    values[5 * 5 + 2, 6 * 5 + 4] = 100
    cells = neighbourhood_from_costmap(costmap, values, (5, 5), GRID)
    assert cells[1, 2] == BLOCKED
    assert (cells == BLOCKED).sum() == 1


@pytest.mark.parametrize(('radius', 'n_blocked'), [(0.0, 1), (0.12, 1), (0.16, 2), (0.3, 6)])
def test_a_disc_that_would_touch_it(radius, n_blocked):
    """The cell whose lower left part is lethal lies 0.125 m from the next centre to the left."""
    costmap, values = fine_map(np.zeros((20, 20), np.int8), 25)
    values[5 * 25 + 12, 6 * 25] = 100
    cells = neighbourhood_from_costmap(costmap, values, (5, 6), GRID, radius=radius)
    assert (cells == BLOCKED).sum() == n_blocked


def test_what_the_costmap_does_not_cover_is_unknown():
    costmap = Grid(10, 10, 0.05, GRID.origin_x + 10 * 0.25, GRID.origin_y + 10 * 0.25)
    cells = neighbourhood_from_costmap(costmap, np.zeros((10, 10), np.int8), (10, 10), GRID)
    np.testing.assert_array_equal(
        cells, [[UNKNOWN] * 3, [UNKNOWN, FREE, FREE], [UNKNOWN, FREE, FREE]])


def test_another_frame_is_an_error_that_names_both():
    costmap = Grid(10, 10, 0.05, frame_id='map')
    with pytest.raises(ValueError, match="costmap: frame is 'map', must be 'odom'"):
        neighbourhood_from_costmap(costmap, np.zeros((10, 10), np.int8), (3, 3), GRID)


def test_a_shape_that_is_not_the_costmaps():
    with pytest.raises(ValueError, match='shape'):
        neighbourhood_from_costmap(GRID, np.zeros((3, 3), np.int8), (3, 3), GRID)


@pytest.mark.parametrize('resolution', [1e-40, 1e-6, 1e6])
def test_cells_of_no_use_are_refused_before_anything_is_computed(resolution):
    msg = map_from_occupancy(np.zeros((4, 5), np.int8), Grid(4, 5, 0.25))
    msg.info.resolution = resolution
    with pytest.raises(ValueError, match=r'costmap: resolution is .*, must be 1e-05 to 100000'):
        occupancy_from_map(msg, 'costmap')
