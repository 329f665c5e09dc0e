from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import CellBox, Grid
from control_field.windows import moved
from strategies import few

boxes = st.tuples(*[st.integers(-6, 6)] * 2, *[st.integers(0, 9)] * 2).map(
    lambda each: CellBox(each[0], each[1], each[0] + each[2], each[1] + each[3]))


@few
@given(boxes, boxes)
def test_every_cell_of_both_windows_keeps_its_value(first, second):
    lattice = Grid(1, 1, 0.25, -0.125, -0.125)
    old, new = lattice.window(first), lattice.window(second)
    values = np.arange(old.n_rows * old.n_cols * 2, dtype=np.int16).reshape(*old.shape, 2)
    there = moved(values, old, new, -7)
    assert there.shape == (*new.shape, 2)
    assert there.dtype == values.dtype
    for row, col in np.ndindex(new.shape):
        at = old.cell_from_world(*new.world_from_cell(row, col))
        expected = values[at].tolist() if old.contains(*at) else [-7, -7]
        assert there[row, col].tolist() == expected


def test_cells_of_another_lattice_have_no_place():
    with pytest.raises(ValueError, match='do not share their cells'):
        moved(np.zeros((2, 2)), Grid(2, 2, 0.25), Grid(2, 2, 0.25, 0.1), 0)
