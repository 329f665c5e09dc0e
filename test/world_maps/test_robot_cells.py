"""The cells of a robot, made of the pixels of a map."""

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np

from control_field.grid import cell_side, default_lattice, Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import allowed_steps, StepRules
from world_maps.clearance import Clearance
from world_maps.raster import Raster
from world_maps.robot_cells import robot_cells, robot_grid
from world_maps.world import World

RULES = StepRules(corner_cutting=False, unknown_is_blocked=False, moves=8)


def raster(occupancy, size=0.05, x=0.0, y=0.0):
    return Raster(Grid(*occupancy.shape, size, x, y), occupancy)


def world_of(pixels, radius):
    grid = robot_grid(pixels.grid, cell_side(radius))
    return World(grid, robot_cells(pixels, grid, radius), drawn=pixels, robot_radius=radius)


def room_along(world, start, end):
    """Return the least room around the robot's disc on the straight way between two cells, [m]."""
    clearance = Clearance(world, world.robot_radius)
    ends = [np.array(world.grid.world_from_cell(*cell)) for cell in (start, end)]
    return min(clearance.at(*(ends[0] + share * (ends[1] - ends[0])))
               for share in np.linspace(0.0, 1.0, 26))


@given(
    occupancy=arrays(np.bool_, st.tuples(st.integers(8, 30), st.integers(8, 30)),
                     elements=st.booleans()).map(lambda cells: np.where(cells, 100, 0)),
    thin=st.integers(0, 30), size=st.sampled_from([0.02, 0.05, 0.08]),
    x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0), radius=st.sampled_from([0.06, 0.105, 0.22]))
@settings(max_examples=60)
def test_whoever_drives_from_centre_to_centre_touches_nothing(
        occupancy, thin, size, x, y, radius):
    keep = np.random.default_rng(thin).random(occupancy.shape) < 0.02 * thin / 30
    pixels = raster(np.where(keep, occupancy, 0).astype(np.int8), size, x, y)
    world = world_of(pixels, radius)
    for row, col in np.argwhere(world.occupancy == 0).tolist():
        steps = allowed_steps(world.occupancy, row, col, RULES)
        for heading in np.flatnonzero([steps >> h & 1 for h in range(8)]):
            there = row + STEP_ROW[heading], col + STEP_COL[heading]
            assert room_along(world, (row, col), there) >= -1e-6


@given(size=st.sampled_from([0.01, 0.03, 0.05]), x=st.floats(-50.0, 50.0),
       y=st.floats(-50.0, 50.0), radius=st.floats(0.05, 0.5))
def test_cells_lie_on_the_default_lattice_and_cover_the_map(size, x, y, radius):
    pixels = Grid(31, 47, size, x, y)
    cells = robot_grid(pixels, cell_side(radius))
    assert default_lattice(cell_side(radius)).offset_to(cells) is not None
    for low, high, first, end in zip(
            Raster(pixels, np.zeros(pixels.shape)).extent[:2],
            Raster(pixels, np.zeros(pixels.shape)).extent[2:],
            Raster(cells, np.zeros(cells.shape)).extent[:2],
            Raster(cells, np.zeros(cells.shape)).extent[2:], strict=True):
        assert first - 1e-6 <= low < first + cells.resolution + 1e-6
        assert end - cells.resolution - 1e-6 < high <= end + 1e-6


def test_a_free_cell_holds_the_disc_of_the_robot():
    occupancy = np.zeros((15, 15), dtype=np.int8)
    occupancy[7, 4] = 100  # 0.125 m from the middle: beside the disc of a Burger
    for radius, state in ((0.105, 0), (0.13, 100)):
        pixels = raster(occupancy, 0.05, -0.375, -0.375)
        assert robot_cells(pixels, Grid(1, 1, 0.25, -0.125, -0.125), radius) == state


def test_a_thin_wall_between_two_centres_takes_the_cells_of_one_side():
    occupancy = np.zeros((50, 75), dtype=np.int8)
    occupancy[:, 25] = 100  # of 1 cm, from 0.25 to 0.26 m; the centres are at 0.125 and 0.375
    cells = robot_cells(raster(occupancy, 0.01), Grid(2, 3, 0.25), 0.105)
    np.testing.assert_array_equal(cells, [[0, 100, 0]] * 2)


def test_a_post_in_the_corner_of_four_cells_takes_one_of_them():
    occupancy = np.zeros((100, 100), dtype=np.int8)
    occupancy[51, 51] = 100
    cells = robot_cells(raster(occupancy, 0.01), Grid(2, 2, 0.25, 0.25, 0.25), 0.105)
    np.testing.assert_array_equal(cells, [[0, 0], [0, 100]])


def test_pixels_that_hold_the_robot_are_its_cells():
    occupancy = np.where(np.random.default_rng(1).random((9, 12)) < 0.3, 100, 0).astype(np.int8)
    pixels = raster(occupancy, 0.25, 1.0, -2.0)
    np.testing.assert_array_equal(robot_cells(pixels, pixels.grid, 0.105), occupancy)
