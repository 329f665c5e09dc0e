from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from control_field.local_grid import crop_neighbourhood
from control_field.robot.measurement_model import continuity, likelihood, UPHEAVAL

STATES = st.sampled_from([0, 100])
MAPS = st.lists(STATES, min_size=81, max_size=81).map(
    lambda cells: np.array(cells, np.int8).reshape(9, 9))
STEPS = st.integers(-3, 3)


def places(*cells):
    return tuple(np.array(numbers) for numbers in zip(*cells, strict=True))


@given(MAPS)
def test_what_is_seen_from_a_cell_fits_that_cell(world):
    local_grid = crop_neighbourhood(world, 4, 4)
    fit = likelihood(world, local_grid, *places((4, 4), (5, 4), (4, 2)))
    assert fit[0] == 1.0 >= fit.max()
    assert fit.min() >= UPHEAVAL


@given(MAPS)
def test_an_unseen_map_and_an_unknown_local_grid_contradict_nothing(world):
    here = places((4, 4))
    assert likelihood(np.full_like(world, -1), crop_neighbourhood(world, 4, 4), *here) == 1.0
    assert likelihood(world, np.full((3, 3), -1, np.int8), *here) == 1.0


def test_each_cell_that_is_wrong_makes_it_less_likely_down_to_upheaval():
    world = np.zeros((9, 9), np.int8)
    fits = []
    for n in range(10):
        local_grid = np.zeros(9, np.int8)
        local_grid[:n] = 100
        fits.append(float(likelihood(world, local_grid.reshape(3, 3), *places((4, 4)))[0]))
    assert fits[:2] == [1.0, 0.1]
    assert sorted(fits, reverse=True) == fits
    assert fits[-1] == UPHEAVAL


def test_beyond_the_map_the_rim_counts():
    world = np.zeros((9, 9), np.int8)
    assert (likelihood(world, world[:3, :3], *places((-5, 4), (40, 40))) == 1.0).all()


@given(MAPS, STEPS, STEPS)
def test_two_local_grids_of_one_world_fit_the_step_between_them(world, rows, cols):
    last, now = crop_neighbourhood(world, 4, 4), crop_neighbourhood(world, 4 + rows, 4 + cols)
    assert continuity(last, now, *places((rows, cols)))[0] == 1.0


def test_a_pattern_that_shifts_shows_which_way_the_robot_went():
    world = np.zeros((9, 9), np.int8)
    world[:6, 5] = 100
    last, now = crop_neighbourhood(world, 5, 4), crop_neighbourhood(world, 6, 4)
    fit = continuity(last, now, *places((1, 0), (0, 0), (0, 1), (-1, 0)))
    assert fit[0] == 1.0
    assert fit[1:].max() < 0.1


def test_far_away_there_is_nothing_to_compare():
    free, full = np.zeros((3, 3), np.int8), np.full((3, 3), 100, np.int8)
    assert (continuity(free, full, *places((3, 0), (-9, 2), (0, 50))) == 1.0).all()
