from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import allowed_steps, remember_local_grid, StepRules
from control_field.kernels.trials import see
from control_field.local_grid import (
    BLOCKED, crop_neighbourhood, FREE, masks_from_neighbourhood, UNKNOWN)
from oracles import allowed_from_blocked, neighbourhood_from_masks
from strategies import knowns, masks, occupancies, steady


@given(masks, masks)
@steady
def test_masks_survive_the_way_there_and_back(blocked, unknown):
    local_grid = neighbourhood_from_masks(blocked, unknown)
    assert local_grid[1, 1] == FREE
    assert masks_from_neighbourhood(local_grid) == (blocked, unknown & ~blocked)


@given(hnp.arrays(np.int8, (3, 3)))
@steady
def test_what_is_neither_free_nor_unknown_is_blocked(local_grid):
    blocked, unknown = masks_from_neighbourhood(local_grid)
    for heading in range(8):
        state = local_grid[1 + STEP_ROW[heading], 1 + STEP_COL[heading]]
        assert bool(unknown >> heading & 1) == (state == UNKNOWN)
        assert bool(blocked >> heading & 1) == (state not in (UNKNOWN, FREE))


def test_bit_0_is_the_neighbour_in_x_and_bit_2_the_one_in_y():
    local_grid = np.zeros((3, 3), np.int8)
    local_grid[1, 2], local_grid[2, 1] = BLOCKED, UNKNOWN
    assert masks_from_neighbourhood(local_grid) == (1 << 0, 1 << 2)


def test_another_shape_is_refused():
    with pytest.raises(ValueError, match=r'3x3, not \(3, 4\)'):
        masks_from_neighbourhood(np.zeros((3, 4), np.int8))


@given(occupancies((0, 0, -1, 100)), st.integers(-3, 10), st.integers(-3, 10))
@steady
def test_the_crop_is_the_map_with_walls_around_it(occupancy, row, col):
    around = np.pad(occupancy, 15, constant_values=BLOCKED)
    expected = around[row + 14:row + 17, col + 14:col + 17]
    local_grid = crop_neighbourhood(occupancy, row, col)
    assert local_grid.dtype == np.int8
    assert np.array_equal(local_grid, expected)
    inside = 0 <= row < occupancy.shape[0] and 0 <= col < occupancy.shape[1]
    if inside:
        assert masks_from_neighbourhood(local_grid)[0] == see(occupancy, row, col)


@given(masks, st.booleans())
@steady
def test_local_grid_and_map_allow_the_same_steps(blocked, cutting):
    known = np.full((3, 3), UNKNOWN, np.int8)
    remember_local_grid(known, 1, 1, blocked, 0)
    assert allowed_from_blocked(blocked, cutting) == allowed_steps(
        known, 1, 1, StepRules(cutting, False, 8))


@given(masks)
@steady
def test_a_body_does_not_cut_corners_and_a_point_does(blocked):
    body, point = allowed_from_blocked(blocked), allowed_from_blocked(blocked, True)
    assert point == ~blocked & 0xFF
    for heading in range(8):
        beside = blocked >> (heading - 1) % 8 & 1 or blocked >> (heading + 1) % 8 & 1
        assert bool(body >> heading & 1) == (
            bool(point >> heading & 1) and not (heading % 2 and beside))


@given(knowns, masks, masks, st.data())
@steady
def test_what_was_seen_is_remembered_and_the_rest_stays(known, blocked, unknown, data):
    row = data.draw(st.integers(0, known.shape[0] - 1))
    col = data.draw(st.integers(0, known.shape[1] - 1))
    before = known.copy()
    n_occupied = remember_local_grid(known, row, col, blocked, unknown)
    shown = neighbourhood_from_masks(blocked & ~unknown, unknown)
    expected = np.pad(before, 1)
    window = expected[row:row + 3, col:col + 3]
    window[shown != UNKNOWN] = shown[shown != UNKNOWN]
    assert np.array_equal(known, expected[1:-1, 1:-1])
    at = (row, col)
    assert n_occupied == ((known == BLOCKED) & (before != BLOCKED)).sum()
    assert known[at] == FREE
