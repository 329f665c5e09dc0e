"""What is seen from a cell: all that a straight line comes to, and nothing behind it."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.kernels.visibility import look, remember_cells
from control_field.rays import rays_within, visible_cells

reaches = st.integers(1, 9)


def window_of(reach, seed, share=0.2):
    side = 2 * reach + 1
    return np.where(np.random.default_rng(seed).random((side, side)) < share, 100, 0).astype(
        np.int8)


@pytest.mark.parametrize('reach', [1, 2, 7, 14, 30])
def test_where_nothing_stands_all_is_seen(reach):
    window = np.zeros((2 * reach + 1,) * 2, np.int8)
    np.testing.assert_array_equal(visible_cells(window, rays_within(reach)), window)


@given(reaches, st.integers(0, 2**32))
def test_what_is_seen_is_true_and_the_nine_always_are(reach, seed):
    window = window_of(reach, seed)
    seen = visible_cells(window, rays_within(reach))
    assert ((seen == window) | (seen == -1)).all()
    nine = slice(reach - 1, reach + 2)
    np.testing.assert_array_equal(seen[nine, nine], window[nine, nine])


@given(reaches, st.integers(0, 2**32))
def test_turned_and_mirrored_worlds_look_turned_and_mirrored(reach, seed):
    window, rays = window_of(reach, seed), rays_within(reach)
    seen = visible_cells(window, rays)
    for change in (np.rot90, np.transpose, np.flipud):
        np.testing.assert_array_equal(
            visible_cells(np.ascontiguousarray(change(window)), rays), change(seen))


@given(reaches, st.integers(0, 2**32))
def test_from_the_map_it_is_the_same_as_from_the_window(reach, seed):
    window, rays = window_of(reach, seed), rays_within(reach)
    seen = np.zeros_like(window)
    look(window, reach, reach, rays, seen)
    np.testing.assert_array_equal(seen, visible_cells(window, rays))
    # At the edge of a map what lies outside is blocked.
    around = np.pad(window, reach, constant_values=100)
    look(window, 0, reach, rays, seen)
    np.testing.assert_array_equal(
        seen, visible_cells(around[:2 * reach + 1, reach:3 * reach + 1], rays))


@given(reaches, st.integers(0, 2**32))
def test_taking_an_obstacle_away_hides_nothing(reach, seed):
    window, rays = window_of(reach, seed), rays_within(reach)
    seen = visible_cells(window, rays)
    for cell in np.argwhere(window)[:3]:
        fewer = window.copy()
        fewer[tuple(cell)] = 0
        assert ((visible_cells(fewer, rays) != -1) | (seen == -1)).all()


def test_behind_a_wall_nothing_is_seen_and_between_two_cells_corner_to_corner_neither():
    window = np.zeros((9, 9), np.int8)
    window[6] = 100
    seen = visible_cells(window, rays_within(4))
    assert (seen[:7] == window[:7]).all()
    assert (seen[7:] == -1).all()
    window = np.zeros((9, 9), np.int8)
    window[4, 5] = window[5, 4] = 100
    seen = visible_cells(window, rays_within(4))
    assert (seen[6:, 6:] == -1).all()


def test_beyond_the_range_nothing_is_seen():
    seen = visible_cells(np.zeros((15, 15), np.int8), rays_within(7, 5.0))
    rows, cols = np.indices(seen.shape) - 7
    np.testing.assert_array_equal(seen, np.where(np.hypot(rows, cols) <= 5.0, 0, -1))


@given(st.integers(0, 2**32), st.sampled_from([3, 5, 9]))
def test_what_is_seen_is_remembered_and_nothing_else(seed, side):
    rng = np.random.default_rng(seed)
    known = rng.choice(np.array([0, 100, -1, 40], np.int8), (6, 7))
    row, col = int(rng.integers(6)), int(rng.integers(7))
    cells = rng.choice(np.array([0, 100, -1], np.int8), (side, side))
    before, seen = known.copy(), np.zeros(known.shape, np.bool_)
    n_occupied = remember_cells(known, seen, row, col, cells)
    expected, n = before.copy(), 0
    for i, j in np.ndindex(known.shape):
        r, c = i - row + side // 2, j - col + side // 2
        is_seen = 0 <= r < side and 0 <= c < side and cells[r, c] != -1
        assert seen[i, j] == (is_seen or (i, j) == (row, col))
        if is_seen:
            n += cells[r, c] == 100 != before[i, j]
            expected[i, j] = cells[r, c]
    expected[row, col] = 0
    np.testing.assert_array_equal(known, expected)
    assert n_occupied == n
