"""Worlds whose pixels are smaller than the robot: files, changes, and what is seen of them."""

from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from PIL import Image
import pytest

from control_field.grid import default_lattice, Grid
from control_field.local_grid import cells_from_fine
from world_maps.changes import ChangingWorld, in_cells
from world_maps.clearance import Clearance
from world_maps.movers import Disc
from world_maps.movers_file import load_movers
from world_maps.raster import Raster
from world_maps.robot_cells import robot_cells, robot_grid
from world_maps.window import true_window
from world_maps.world import load_world, save_world, World, WorldError


def room(n_rows=40, n_cols=60, *blocked):
    """Return the pixels of a room of 5 cm each, walled; (0, 0) is its lower left corner."""
    occupancy = np.zeros((n_rows, n_cols), dtype=np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    for rows, cols in blocked:
        occupancy[rows, cols] = 100
    return Raster(Grid(n_rows, n_cols, 0.05), occupancy)


def world_of(pixels, radius=0.105, side=0.25):
    grid = robot_grid(pixels.grid, side)
    return World(grid, robot_cells(pixels, grid, radius), 'room', drawn=pixels,
                 robot_radius=radius)


def saved(folder, pixels=None):
    pixels = pixels or room()
    return save_world(folder / 'room.yaml', World(pixels.grid, pixels.occupancy))


def draw(path, grey, mode='L'):
    Image.fromarray(np.array(grey, dtype=np.uint8), mode).save(path)
    return path


class TestLoading:
    @pytest.mark.parametrize(('radius', 'side'), [(0.105, 0.25), (0.175, 0.4), (0.22, 0.5)])
    def test_cells_are_of_the_robots_size(self, tmp_path, radius, side):
        world = load_world(saved(tmp_path), robot_radius=radius)
        assert world.grid.resolution == side
        assert default_lattice(side).offset_to(world.grid) is not None
        assert world.pixels.grid == Grid(40, 60, 0.05)
        np.testing.assert_array_equal(
            world.occupancy, robot_cells(room(), world.grid, radius))
        assert 'of 40 x 60 pixels of 0.05 m' in world.size

    def test_or_of_the_size_that_is_wanted(self, tmp_path):
        world = load_world(saved(tmp_path), resolution=0.3)
        assert world.grid.resolution == 0.3
        assert world.notes == ()

    def test_too_small_ones_are_remarked_upon(self, tmp_path):
        world = load_world(saved(tmp_path), resolution=0.05)
        assert world.grid == world.pixels.grid
        np.testing.assert_array_equal(world.occupancy[:3], 100)
        [note] = world.notes
        assert 'take cells of 0.13 m or more' in note

    def test_pixels_that_hold_the_robot_are_its_cells(self, tmp_path):
        pixels = Raster(Grid(3, 4, 0.25, 1.0, -2.0), np.zeros((3, 4)))
        world = load_world(saved(tmp_path, pixels), robot_radius=0.125)
        assert world.grid == world.pixels.grid == pixels.grid
        assert world.drawn is None

    def test_a_map_of_moving_ai_may_have_finer_cells(self, tmp_path):
        (tmp_path / 'a.map').write_text('type octile\nheight 1\nwidth 2\nmap\n.@\n')
        cells = load_world(tmp_path / 'a.map', resolution=0.5)
        assert cells.grid == Grid(3, 5, 0.5, -0.25, -0.25)
        np.testing.assert_array_equal(cells.occupancy[1], [100, 0, 100, 100, 100])

    def test_more_cells_than_there_may_be(self, tmp_path):
        with pytest.raises(WorldError, match=r'room.yaml: .* it would fit'):
            load_world(saved(tmp_path), resolution=1e-4)


class TestImageAlone:
    def test_dark_is_wall_and_resolution_its_pixels(self, tmp_path):
        path = draw(tmp_path / 'my.png', [[0, 127, 128], [255, 200, 90]])
        world = load_world(path, resolution=0.5)
        assert world.grid == Grid(2, 3, 0.5)
        np.testing.assert_array_equal(world.occupancy, [[0, 0, 100], [100, 100, 0]])
        assert load_world(path, resolution=0.05).grid.resolution == 0.25

    def test_it_does_not_say_how_large_it_is(self, tmp_path):
        with pytest.raises(WorldError, match='give resolution, the metres of a pixel'):
            load_world(draw(tmp_path / 'my.png', [[255]]))

    def test_what_shines_through_is_white_paper(self, tmp_path):
        path = draw(tmp_path / 'my.png', [[[0, 0, 0, 0], [0, 0, 0, 255]]], 'RGBA')
        np.testing.assert_array_equal(load_world(path, resolution=1.0).occupancy, [[0, 100]])

    def test_the_unknown_of_map_savers_is_no_floor(self, tmp_path):
        world = load_world(draw(tmp_path / 'my.pgm', [[0, 205, 254]]), resolution=1.0)
        np.testing.assert_array_equal(world.occupancy, [[100, 100, 0]])
        [note] = world.notes
        assert '1 of 3 pixels are of the grey 205' in note
        drawn = load_world(draw(tmp_path / 'drawn.pgm', [[3, 205, 254]]), resolution=1.0)
        np.testing.assert_array_equal(drawn.occupancy, [[100, 0, 0]])

    def test_the_yaml_file_beside_it_says_more(self, tmp_path):
        path = saved(tmp_path).with_suffix('.pgm')
        world = load_world(path, resolution=0.5)
        assert (world.grid.resolution, world.pixels.grid.resolution) == (0.5, 0.05)
        assert 'is read as room.yaml beside it says' in world.notes[0]
        path.with_suffix('.yaml').write_text('movers: []\n')
        assert load_world(path, resolution=0.5).pixels.grid.resolution == 0.5


class TestChanges:
    #: A wall across the room with a door of 50 cm.
    WALL = room(40, 60, (slice(0, 40), 30))

    def doors(self, folder, text):
        (folder / 'doors.yaml').write_text(f'changes:\n  - {text}\n')
        world = world_of(self.WALL)
        return world, load_movers(folder / 'doors.yaml', world).changes

    def test_a_door_opens_pixels_and_the_cells_they_make(self, tmp_path):
        world, changes = self.doors(tmp_path, '{at_trial: 1, open: [1.49, 0.7, 1.56, 1.3]}')
        changing = ChangingWorld(world, changes)
        assert changing.update(0.0, 0)
        opened = changing.world
        assert (opened.pixels.occupancy != world.pixels.occupancy).sum() == 12
        np.testing.assert_array_equal(
            opened.occupancy, robot_cells(opened.pixels, world.grid, 0.105))
        assert (world.occupancy[:, 6] == 100).all()
        assert (opened.occupancy[:, 6] == 0).any()

    def test_the_same_for_a_world_of_cells(self, tmp_path):
        world, [change] = self.doors(tmp_path, '{at_time: 2, open: [1.49, 0.7, 1.56, 1.3]}')
        cells = in_cells(change, world)
        assert cells.at_time == 2.0
        np.testing.assert_array_equal(
            cells.of(world.occupancy),
            world.with_pixels(change.of(world.pixels.occupancy)).occupancy)
        plain = replace(world, drawn=None)
        assert in_cells(change, plain) is change

    def test_no_pixel_closes_under_the_robot(self, tmp_path):
        world, changes = self.doors(tmp_path, '{at_time: 0, close: [0.4, 0.4, 1.0, 1.0]}')
        changing, robot = ChangingWorld(world, changes), Disc(0.5, 0.5, 0.105)
        changing.update(0.0, -1, robot)
        assert Clearance(changing.world, 0.105).at(0.5, 0.5) >= 0.0
        assert changing.world.pixels.occupancy[18, 18] == 100
        changing.update(0.0, -1)
        assert Clearance(changing.world, 0.105).at(0.5, 0.5) < 0.0

    def test_another_map_has_the_same_pixels(self, tmp_path):
        saved(tmp_path)
        world, [change] = self.doors(tmp_path, '{at_trial: 1, map: room.yaml}')
        np.testing.assert_array_equal(change.of(world.pixels.occupancy), room().occupancy)


def test_what_is_near_is_measured_to_the_pixels():
    world = world_of(room(40, 60, (20, 20)))
    assert Clearance(world, 0.105).at(0.9, 1.025) == pytest.approx(1.0 - 0.9 - 0.105)


@given(share=st.floats(0.0, 0.08), seed=st.integers(0, 99), reach=st.sampled_from([1, 3]),
       fine=st.sampled_from([3, 5]))
@settings(max_examples=40)
def test_what_is_seen_is_what_the_cells_of_the_map_say(share, seed, reach, fine):
    rng = np.random.default_rng(seed)
    pixels = room()
    pixels = Raster(pixels.grid, np.where(
        rng.random(pixels.grid.shape) < share, 100, pixels.occupancy))
    world = world_of(pixels)
    row, col = rng.integers(world.grid.shape).tolist()
    seen = true_window(world, (), row, col, reach)
    padded = np.pad(world.occupancy, reach, constant_values=100)
    true = padded[row:row + 2 * reach + 1, col:col + 2 * reach + 1].copy()
    true[reach, reach] = 0
    np.testing.assert_array_equal(seen, true)
    parts = cells_from_fine(true_window(world, (), row, col, reach, fine), fine)
    parts[reach, reach] = 0
    np.testing.assert_array_equal(parts, true)


def test_parts_show_where_in_a_blocked_cell_something_is():
    world = world_of(room(40, 60, (20, 20)))  # from 1 to 1.05 m, in the cell around (1, 1)
    cell = world.grid.cell_from_world(1.0, 1.0)
    parts = true_window(world, (), cell[0], cell[1] - 1, 1, 5)[5:10, 10:15]
    assert world.occupancy[cell] == 100
    # The middle part is from 0.975 to 1.025 m: the pixel has a share of it, and of three more.
    np.testing.assert_array_equal(np.argwhere(parts), [[2, 2], [2, 3], [3, 2], [3, 3]])


@given(share=st.floats(0.0, 0.03), seed=st.integers(0, 99), col=st.integers(0, 12))
@settings(max_examples=20)
def test_whoever_fits_in_the_pixels_is_clear_of_the_parts_of_smaller_cells(share, seed, col):
    pixels = room()
    noise = np.random.default_rng(seed).random(pixels.grid.shape) < share
    world = world_of(Raster(pixels.grid, np.where(noise, 100, pixels.occupancy)), 0.22, 0.25)
    for row in range(world.grid.n_rows):
        if world.occupancy[row, col] == 0:
            x, y = world.grid.world_from_cell(row, col)
            parts = true_window(world, (), row, col, 1, 5)
            near = World(Grid(15, 15, 0.05, x - 0.375, y - 0.375), parts)
            # A part is blocked by a pixel that it has the least share of.
            assert Clearance(near, 0.24 - 0.05 * 2**0.5).at(x, y) >= -1e-9


def test_a_cell_that_something_beside_it_blocks_shows_it_far_from_where_a_robot_may_be():
    world = world_of(room(), 0.22, 0.25)
    assert world.occupancy[1, 4] == 100  # from 0.125 to 0.375 m in y, free of pixels
    for col in (3, 4, 5):  # from wherever it is seen
        parts = true_window(world, (), 2, col, 1, 5)[:5, 5 * (5 - col):5 * (6 - col)]
        np.testing.assert_array_equal(np.argwhere(parts), [[0, 0]])
    assert true_window(world, (), 1, 4, 1, 5)[5:10, 5:10].sum() == 0


def test_what_is_shown_of_pixels_does_not_move_when_the_robot_does():
    noise = np.random.default_rng(5).random((40, 60)) < 0.02
    world = world_of(Raster(Grid(40, 60, 0.05), np.where(noise, 100, room().occupancy)))
    rows, cols = world.grid.shape
    seen = {cell: true_window(world, (), *cell, 1, 5) for cell in np.ndindex(rows, cols)}
    for row, col in np.ndindex(rows, cols - 1):
        here, there = seen[row, col][:, 5:], seen[row, col + 1][:, :10]
        for own, other, end in ((here, there, 0), (there, here, 5)):
            parts = own[5:10, end:end + 5], other[5:10, end:end + 5]
            # But for what stands beside the robot's own cell alone.
            assert (parts[0] == parts[1]).all() or not parts[0].any()
        np.testing.assert_array_equal(here[[*range(5), *range(10, 15)]],
                                      there[[*range(5), *range(10, 15)]])


def test_the_robots_own_cell_is_free_but_for_its_parts():
    world = world_of(room(40, 60, (20, 20)))
    cell = world.grid.cell_from_world(1.0, 1.0)
    assert true_window(world, (), *cell)[1, 1] == 0
    assert true_window(world, (), *cell, 1, 5)[5:10, 5:10].sum() == 400
