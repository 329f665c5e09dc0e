"""Workspaces that fit themselves: windows of one lattice, whose cells never move."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import (
    cell_side, CellBox, default_lattice, fitted_box, fitted_workspace, Grid, TooLargeError)
from strategies import steady

sides = st.sampled_from([0.05, 0.1, 0.25, 0.3, 1.0, 1.0 / 3.0])
places = st.floats(-500.0, 500.0)
lattices = st.builds(Grid, st.just(1), st.just(1), sides, places, places)
edges = st.integers(-60, 60)
boxes = st.builds(lambda a, b, n, m: CellBox(a, b, a + n, b + m), edges, edges,
                  st.integers(0, 40), st.integers(0, 40))


@pytest.mark.parametrize(('radius', 'side'), [
    (0.105, 0.25), (0.22, 0.5), (0.175, 0.4), (0.001, 0.05), (0.005, 0.05), (0.0051, 0.1),
    (0.08, 0.2), (0.48, 1.0)])
def test_cells_are_the_smallest_that_hold_the_robot(radius, side):
    assert cell_side(radius) == side


@given(st.floats(1e-3, 10.0))
@steady
def test_a_cell_holds_the_robot_with_room_and_no_smaller_one_does(radius):
    side = cell_side(radius)
    assert side >= 2.0 * radius + 0.04 - 1e-9 > side - 0.05 - 1e-9
    assert math.isclose(side / 0.05, round(side / 0.05))


@pytest.mark.parametrize('radius', [0.0, -0.1, math.nan, math.inf])
def test_what_is_no_radius_has_no_cells(radius):
    with pytest.raises(ValueError, match='radius of the robot'):
        cell_side(radius)


def test_a_robot_at_0_0_stands_in_the_middle_of_a_cell():
    for side in (0.05, 0.25, 0.3):
        grid = fitted_workspace(default_lattice(side, 'map'), np.zeros((1, 2)))
        assert grid.world_from_cell(*grid.cell_from_world(0.0, 0.0)) == pytest.approx((0, 0))
        assert grid.frame_id == 'map'


@given(lattices, boxes, boxes)
@steady
def test_every_cell_of_a_window_keeps_its_place(lattice, first, second):
    one, other = lattice.window(first), lattice.window(second)
    offset = one.offset_to(other)
    assert offset == (first.low_row - second.low_row, first.low_col - second.low_col)
    cells = np.argwhere(np.ones(one.shape))
    assert np.allclose(one.world_from_cells(cells),
                       other.world_from_cells(cells + offset), atol=2e-9, rtol=0.0)
    assert other.offset_to(one) == (-offset[0], -offset[1])


@given(lattices, st.lists(boxes, min_size=1, max_size=20))
@steady
def test_windows_of_one_lattice_do_not_drift_however_often_they_grow(lattice, grown):
    anchor = lattice.lattice
    box, grid = grown[0], anchor.window(grown[0])
    for more in grown[1:]:
        box = box.union(more)
        grid = grid.lattice.window(box)
    again = anchor.window(box)
    assert (grid.origin_x, grid.origin_y) == pytest.approx(
        (again.origin_x, again.origin_y), abs=1e-9 * len(grown))
    assert again.lattice.offset_to(anchor) == (0, 0)


def test_a_window_of_all_cells_is_the_grid_itself():
    grid = Grid(3, 4, 0.25, 0.1 + 0.2, 1e-12)
    assert grid.window(grid.box) is grid


def test_the_cell_that_holds_0_0_names_a_lattice():
    assert Grid(20, 20, 0.25, -2.0, -3.0).lattice == Grid(1, 1, 0.25, 0.0, 0.0)
    assert Grid(5, 5, 0.25, 7.125, -0.125).lattice == default_lattice(0.25)
    off = Grid(5, 5, 0.25, 7.1250001, -0.1250001)
    assert off.lattice.offset_to(default_lattice(0.25)) == (0, 0)


@pytest.mark.parametrize('other', [
    Grid(4, 4, 0.25, frame_id='map'), Grid(4, 4, 0.5), Grid(4, 4, 0.25001),
    Grid(4, 4, 0.25, 0.125), Grid(4, 4, 0.25, 0.0, 0.001)])
def test_other_frames_cells_and_places_are_of_another_lattice(other):
    assert Grid(4, 4, 0.25).offset_to(other) is None
    assert other.offset_to(Grid(4, 4, 0.25)) is None


def test_what_messages_round_is_of_the_same_lattice():
    assert Grid(4, 4, 0.25).offset_to(Grid(9, 9, 0.25, 2.5001, -0.7501)) == (3, -10)


class TestTheRule:
    """8 cells around the robot, 1 around what was seen, multiples of 8."""

    def test_one_place(self):
        assert fitted_box(CellBox(0, 0, 0, 0)) == CellBox(-8, -8, 15, 15)
        assert fitted_box(CellBox(8, -1, 8, -1)) == CellBox(0, -16, 23, 7)

    def test_what_is_seen_beyond(self):
        been = CellBox(0, 0, 0, 0)
        assert fitted_box(been, CellBox(-7, 0, 14, 15)) == CellBox(-8, -8, 15, 23)
        assert fitted_box(been, CellBox(-8, 0, 0, 0)).low_row == -16
        assert fitted_box(None, CellBox(0, 0, 0, 0)) == CellBox(-8, -8, 7, 7)

    def test_nothing(self):
        assert fitted_box(None) is None

    @given(boxes, st.none() | boxes)
    @steady
    def test_it_holds_both_and_is_no_larger_than_it_must_be(self, been, seen):
        box = fitted_box(been, seen)
        least = been.widened(8) if seen is None else been.widened(8).union(seen.widened(1))
        assert box.union(least) == box
        assert all(0 <= abs(a - b) <= 7 for a, b in zip(box, least, strict=True))
        assert all(edge % 8 == 0 for edge in (*box[:2], box[2] + 1, box[3] + 1))


def test_a_drive_of_half_a_metre_and_one_of_400():
    lattice = default_lattice(0.25)
    for end, shape in (((0.5, 0.0), (24, 24)), ((400.0, 0.0), (24, 1624)),
                       ((-400.0, 400.0), (1624, 1624))):
        grid = fitted_workspace(lattice, np.array([[0.0, 0.0], end]))
        assert grid.shape == shape
        assert grid.contains(*grid.cell_from_world(*end))
        assert grid.offset_to(lattice) is not None


def test_too_large_a_place_is_refused_with_a_resolution_that_fits():
    far = np.array([[0.0, 0.0], [400.0, 400.0]])
    with pytest.raises(TooLargeError, match=r'8024 x 8024 .* with resolution (0\.\d+)') as caught:
        fitted_workspace(default_lattice(0.05), far)
    side = float(str(caught.value).rpartition('resolution ')[2].partition(' ')[0])
    assert fitted_workspace(default_lattice(side), far).shape < (4096, 4096)


@given(st.floats(1e2, 1e9), st.floats(1e2, 1e9))
@steady
def test_the_resolution_that_is_named_fits_however_large_the_place(x, y):
    far = np.array([[0.0, 0.0], [x, y]])
    try:
        fitted_workspace(default_lattice(0.05), far)
    except TooLargeError as error:
        side = float(str(error).rpartition('resolution ')[2].partition(' ')[0])
        fitted_workspace(default_lattice(side), far)
