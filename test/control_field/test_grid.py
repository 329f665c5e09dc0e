import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from strategies import steady

grids = st.builds(
    Grid, st.integers(1, 300), st.integers(1, 300), st.floats(0.01, 10.0),
    st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))


@steady
@given(grids, st.floats(0, 1, exclude_max=True), st.floats(0, 1, exclude_max=True))
def test_the_centre_of_a_cell_lies_in_it(grid, down, right):
    cell = int(down * grid.n_rows), int(right * grid.n_cols)
    assert grid.contains(*cell)
    assert grid.cell_from_world(*grid.world_from_cell(*cell)) == cell


@steady
@given(grids, st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), max_size=5))
def test_many_points_are_converted_as_one_is(grid, points):
    cells = grid.cells_from_world(np.array(points).reshape(-1, 2))
    assert [tuple(cell) for cell in cells.tolist()] == [
        grid.cell_from_world(x, y) for x, y in points]
    centres = grid.world_from_cells(cells)
    assert [tuple(p) for p in centres.tolist()] == [
        grid.world_from_cell(*cell) for cell in cells.tolist()]


def test_a_cell_holds_its_lower_and_left_edge():
    grid = Grid(4, 6, 0.5, 1.0, -2.0)
    assert grid.shape == (4, 6)
    assert grid.world_from_cell(0, 0) == (1.25, -1.75)
    assert grid.cell_from_world(1.0, -2.0) == (0, 0)
    assert grid.cell_from_world(1.5, -2.0) == (0, 1)
    assert grid.cell_from_world(1.0, -1.5) == (1, 0)
    assert grid.cell_from_world(math.nextafter(1.5, 0.0), -2.0) == (0, 0)


def test_what_lies_outside_is_told_and_kept_apart():
    grid = Grid(2, 3, 1.0)
    assert grid.cell_from_world(-0.1, 2.5) == (2, -1)
    assert not grid.contains(2, 0)
    assert not grid.contains(0, 3)
    assert not grid.contains(-1, 0)
    assert grid.contains(1, 2)


@pytest.mark.parametrize(('sizes', 'why'), [
    ((0, 3), 'n_rows is 0, must be 1 to 100000'), ((3, 100_001), 'n_cols is 100001'),
    ((100_000, 100_000), '100000 x 100000 cells are more than 16777216')])
def test_sizes_that_no_workspace_has_are_refused(sizes, why):
    with pytest.raises(ValueError, match=why):
        Grid(*sizes, 0.25)


def test_a_great_workspace_is_one():
    assert Grid(4096, 4096, 0.05).contains(4095, 4095)


def test_points_no_integer_can_hold_lie_outside_without_a_warning():
    grid = Grid(2, 3, 1.0)
    cells = grid.cells_from_world(np.array([[1e300, -1e300], [1e19, 0.5]]))
    assert not any(grid.contains(*cell) for cell in cells.tolist())


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
def test_what_is_no_point_has_no_cell(bad):
    with pytest.raises(ValueError, match='is not a point'):
        Grid(2, 3, 1.0).cell_from_world(bad, 0.0)
    with pytest.raises(ValueError, match='is not a point'):
        Grid(2, 3, 1.0).cell_from_world(0.0, bad)


@pytest.mark.parametrize(('values', 'named'), [
    ((0, 3, 1.0), 'n_rows is 0'),
    ((3, -1, 1.0), 'n_cols is -1'),
    ((3, 100_001, 1.0), 'n_cols is 100001'),
    ((3, 3, 0.0), 'resolution is 0.0'),
    ((3, 3, -1.0), 'resolution'),
    ((3, 3, math.nan), 'resolution'),
    ((3, 3, math.inf), 'resolution'),
    ((3, 3, 1.0, math.nan), 'origin'),
    ((3, 3, 1.0, 0.0, math.inf), 'origin'),
])
def test_what_is_no_grid_is_refused_by_name(values, named):
    with pytest.raises(ValueError, match=named):
        Grid(*values)


@pytest.mark.parametrize('frame_id', ['a' * 256, 'a\nb'])
def test_a_frame_has_a_name_that_can_be_shown(frame_id):
    with pytest.raises(ValueError, match='frame_id') as caught:
        Grid(2, 3, 0.5, frame_id=frame_id)
    assert len(str(caught.value)) < 200


def test_it_is_said_in_words():
    assert str(Grid(13, 37, 0.4, -7.3, -2.6, 'map')) == (
        "13 x 37 cells of 0.4 m from (-7.3, -2.6) in 'map'")


def test_a_workspace_that_is_not_square_says_which_side_is_which():
    assert Grid(10, 12, 0.5).size == '10 x 12 cells of 0.5 m (rows x columns: 6 m in x, 5 m in y)'
    assert Grid(4, 4, 0.5).size == '4 x 4 cells of 0.5 m'
