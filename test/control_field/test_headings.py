import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.headings import (
    heading_from_step, heading_from_vector, headings_from_vectors, STEP_COL, STEP_LENGTH, STEP_ROW,
    UNIT)
from control_field.kernels.interpolation import heading_of
from strategies import headings, steady

numbers = st.floats(allow_nan=True, allow_infinity=True)


def test_headings_go_round_counter_clockwise_from_x():
    angles = np.arctan2(STEP_ROW, STEP_COL) % (2 * math.pi)
    assert np.allclose(angles, np.arange(8) * math.pi / 4)
    assert np.allclose(np.hypot(*UNIT.T), 1.0)
    assert np.allclose(STEP_LENGTH, [1.0, math.sqrt(2.0)] * 4)
    with pytest.raises(ValueError, match='read-only'):
        STEP_ROW[0] = 5


@given(headings, st.floats(1e-6, 1e6), st.floats(-0.99, 0.99))
@steady
def test_the_nearest_heading_wins_whatever_the_length(heading, length, off):
    angle = heading * math.pi / 4 + off * math.pi / 8
    vx, vy = length * math.cos(angle), length * math.sin(angle)
    assert heading_from_vector(vx, vy) == heading
    assert headings_from_vectors(np.array([vx]), np.array([vy])).tolist() == [heading]


def test_between_two_headings_the_counter_clockwise_one_wins():
    assert heading_from_vector(math.cos(math.pi / 8), math.sin(math.pi / 8)) == 1
    assert heading_from_vector(0.0, 1.0) == 2
    assert heading_from_vector(1.0, 0.0) == 0


@given(st.lists(st.tuples(numbers, numbers), max_size=8))
@steady
def test_many_are_judged_as_one_is(vectors):
    vx, vy = np.array(vectors).reshape(-1, 2).T
    many = headings_from_vectors(vx, vy)
    assert many.dtype == np.int8
    assert many.tolist() == [heading_from_vector(x, y) for x, y in vectors]


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
@steady
def test_the_kernel_judges_alike_above_its_threshold(vx, vy):
    if math.hypot(vx, vy) > 1e-8:
        assert heading_of(vx, vy) == heading_from_vector(vx, vy)


def test_no_direction_has_no_heading():
    for vx, vy in ((0.0, 0.0), (math.nan, 1.0), (1.0, math.inf), (-0.0, 0.0)):
        assert heading_from_vector(vx, vy) == -1
    assert heading_of(0.0, 1e-10) == -1


@given(st.integers(-3, 3), st.integers(-3, 3))
@steady
def test_only_steps_to_neighbours_have_a_heading(d_row, d_col):
    if max(abs(d_row), abs(d_col)) == 1:
        heading = heading_from_step(d_row, d_col)
        assert (STEP_ROW[heading], STEP_COL[heading]) == (d_row, d_col)
    else:
        with pytest.raises(ValueError, match='is not a step'):
            heading_from_step(d_row, d_col)
