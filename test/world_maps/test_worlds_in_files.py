"""Worlds in files: what is written is read back, and what is malformed is refused in one line."""

import os
from pathlib import Path
import struct
import zlib

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
from PIL import Image
import pytest

from control_field.grid import Grid
from control_field.headings import N_HEADINGS, STEP_COL, STEP_ROW
from control_field.local_grid import crop_neighbourhood, masks_from_neighbourhood
from oracles import allowed_from_blocked
from world_maps.world import config_folders, find_world, load_world, save_world, World, WorldError

YAML = """\
image: {image}
resolution: 0.25
origin: [0.0, 0.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


def write_map(folder, pixels=None, text=YAML, image='map.pgm', **changes):
    """Write a map of 3 x 2 pixels (or other ones) and return its YAML file."""
    pixels = np.full((2, 3), 254, dtype=np.uint8) if pixels is None else pixels
    if image:
        Image.fromarray(pixels).save(folder / image)
    lines = text.format(image=image).splitlines()
    for name, value in changes.items():
        lines = [line for line in lines if not line.startswith(f'{name}:')]
        lines += [f'{name}: {value}'] if value is not None else []
    path = folder / 'map.yaml'
    path.write_text('\n'.join(lines) + '\n')
    return path


def refused(path, *words):
    """Load a world that cannot be loaded; check that the error is one line that names a file."""
    with pytest.raises(WorldError) as caught:
        load_world(path)
    message = str(caught.value)
    assert '\n' not in message
    assert len(message) < 600
    for word in words:
        assert word in message
    return message


@given(
    occupancy=arrays(np.int8, st.tuples(st.integers(1, 12), st.integers(1, 12)),
                     elements=st.sampled_from([0, 100])),
    resolution=st.floats(1e-3, 100.0), x=st.floats(-1e6, 1e6), y=st.floats(-1e6, 1e6))
@settings(max_examples=50)
def test_what_is_saved_is_loaded(tmp_path_factory, occupancy, resolution, x, y):
    world = World(Grid(*occupancy.shape, resolution, x, y), occupancy, 'here')
    path = save_world(tmp_path_factory.mktemp('worlds') / 'here.yaml', world)
    loaded = load_world(path)
    assert loaded.pixels.grid == world.grid
    assert loaded.name == 'here'
    np.testing.assert_array_equal(loaded.pixels.occupancy, occupancy)


def test_world_checks_its_cells_and_keeps_a_copy():
    cells = np.zeros((2, 3), dtype=np.int8)
    world = World(Grid(2, 3, 0.25), cells)
    cells[0, 0] = 100
    assert not world.is_blocked(0, 0)
    assert world.is_blocked(-1, 0)
    assert not world.occupancy.flags.writeable
    with pytest.raises(ValueError, match='shape'):
        World(Grid(3, 2, 0.25), cells)
    with pytest.raises(ValueError, match='free'):
        World(Grid(2, 3, 0.25), np.full((2, 3), -1, dtype=np.int8))
    one = np.zeros((2, 3), dtype=np.int8)
    one[1, 2] = 50
    with pytest.raises(ValueError, match='must be 0'):
        World(Grid(2, 3, 0.25), one)


class TestMapServer:
    def test_row_0_is_the_lowest_line_of_the_image(self, tmp_path):
        pixels = np.full((2, 3), 254, dtype=np.uint8)
        pixels[1, 0] = 0
        world = load_world(write_map(tmp_path, pixels))
        np.testing.assert_array_equal(world.occupancy, [[100, 0, 0], [0, 0, 0]])

    def test_unknown_is_blocked(self, tmp_path):
        pixels = np.array([[254, 150, 0]], dtype=np.uint8)
        world = load_world(write_map(tmp_path, pixels))
        np.testing.assert_array_equal(world.occupancy, [[0, 100, 100]])

    def test_negate(self, tmp_path):
        pixels = np.array([[254, 150, 0]], dtype=np.uint8)
        world = load_world(write_map(tmp_path, pixels, negate=1))
        np.testing.assert_array_equal(world.occupancy, [[100, 100, 0]])

    def test_scale_mode_splits_in_the_middle_and_raw_mode_at_50(self, tmp_path):
        pixels = np.array([[254, 150, 120, 0]], dtype=np.uint8)
        world = load_world(write_map(tmp_path, pixels, mode='scale'))
        np.testing.assert_array_equal(world.occupancy, [[0, 0, 100, 100]])
        pixels = np.array([[0, 49, 50, 100, 255]], dtype=np.uint8)
        world = load_world(write_map(tmp_path, pixels, mode='raw'))
        np.testing.assert_array_equal(world.occupancy, [[0, 0, 100, 100, 100]])

    @pytest.mark.parametrize('mode', ['L', 'RGB', 'P', '1', 'I;16'])
    def test_png_of_any_mode(self, tmp_path, mode):
        grey = np.array([[255, 0, 255], [255, 255, 0]], dtype=np.uint8)
        image = (Image.fromarray(grey.astype(np.uint16) * 257) if mode == 'I;16'
                 else Image.fromarray(grey).convert(mode))
        path = write_map(tmp_path, image='map.png')
        image.save(tmp_path / 'map.png')
        np.testing.assert_array_equal(load_world(path).occupancy, [[0, 0, 100], [0, 100, 0]])

    @pytest.mark.parametrize('pixels', [
        b'P2\n# a comment\n3 2\n255\n254 0 254\n254 254 0\n',
        b'P5\n3 2\n255\n\xfe\x00\xfe\xfe\xfe\x00',
        b'P5\n3 2\n255\n\xfe\x00\xfe\xfe\xfe\x00\n',
        b'P5 3 2 100\n\x64\x00\x64\x64\x64\x00',
        b'P5 3 2 65535\n\xff\xff\0\0\xff\xff\xff\xff\xff\xff\0\0'])
    def test_pgm_plain_binary_and_with_other_maxima(self, tmp_path, pixels):
        path = write_map(tmp_path)
        (tmp_path / 'map.pgm').write_bytes(pixels)
        np.testing.assert_array_equal(load_world(path).occupancy, [[0, 0, 100], [0, 100, 0]])

    def test_optional_fields_have_the_savers_values_and_are_named(self, tmp_path):
        path = write_map(tmp_path, negate=None, occupied_thresh=None, free_thresh=None)
        world = load_world(path)
        assert not world.occupancy.any()
        assert 'free_thresh: 0.196, negate: 0' in world.notes[0]

    @pytest.mark.parametrize(('name', 'value'), [('mode', 'Trinary'), ('negate', 'false')])
    def test_what_map_server_takes_as_well(self, tmp_path, name, value):
        assert not load_world(write_map(tmp_path, **{name: value})).occupancy.any()

    def test_more_cells_than_a_grid_has(self, tmp_path):
        path = write_map(tmp_path)
        (tmp_path / 'map.pgm').write_bytes(b'P5\n4500 4500\n255\n' + bytes(4500 * 4500))
        assert '4500 x 4500 cells' in refused(path, 'map.pgm')

    def test_numbers_as_yaml_1_1_does_not_read_them(self, tmp_path):
        assert load_world(write_map(tmp_path, resolution='5e-2')).pixels.grid.resolution == 0.05

    @pytest.mark.parametrize(('name', 'value'), [
        ('resolution', '.nan'), ('resolution', '.inf'), ('resolution', '0'), ('resolution', '-1'),
        ('resolution', 'wide'), ('resolution', '[1]'), ('resolution', None),
        ('resolution', '1' + '0' * 400), ('resolution', '1' + '0' * 6000),
        ('origin', None), ('origin', '3'), ('origin', '[1]'), ('origin', '[1, 2, 3, 4]'),
        ('origin', '[1, .nan, 0]'), ('origin', '[0, 0, 0.5]'), ('origin', '{x: 1, y: 2}'),
        ('origin', '[0, 0]'), ('resolution', 'true'), ('negate', '0.5'),
        ('negate', '2'), ('negate', 'perhaps'), ('occupied_thresh', '1.5'),
        ('free_thresh', '0.9'), ('free_thresh', '-1'), ('mode', 'cubic'), ('mode', '[trinary]'),
        ('image', '3'), ('image', "''"), ('image', '"a\\0b"'), ('image', None)])
    def test_wrong_fields(self, tmp_path, name, value):
        path = write_map(tmp_path)
        lines = [line for line in path.read_text().splitlines() if not line.startswith(name)]
        path.write_text('\n'.join([*lines, f'{name}: {value}' if value else '']))
        message = refused(path, 'map.yaml')
        assert name in message or 'no YAML' in message

    @pytest.mark.parametrize('text', [
        '', 'image', '[1, 2]', 'image: [', 'a: b: c', '\0', '!!python/object/apply:os.getcwd []',
        '[' * 5000, '{' * 30000, '- ' * 20000, '? ' * 20000, 'x' * 70_000,
        'a: &a [x]\nb: *nothing', '\xff\xfe', '&a [*a]', '? [a]\n: b'])
    def test_texts_that_are_no_map(self, tmp_path, text):
        path = tmp_path / 'map.yaml'
        path.write_bytes(text.encode('latin-1'))
        refused(path, 'map.yaml')

    def test_yaml_bomb(self, tmp_path):
        lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
        lines += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]' for i in range(1, 40)]
        path = tmp_path / 'map.yaml'
        path.write_text('\n'.join([*lines, 'image: *a39', 'resolution: *a39', 'origin: *a39']))
        refused(path, 'alias')

    @pytest.mark.parametrize('pixels', [
        b'', b'P5', b'P5\n3', b'P5\n3 2\n255\n', b'P5\n3 2\n255\n12345', b'P5\n3 2\n255\n1234567',
        b'P5\n2 2\n255\n123456', b'P5\n0 2\n255\n', b'P5\n-3 2\n255\n123456',
        b'P5\n3 2\n0\n123456', b'P5\n3 2\n99999\n123456', b'P5\na b\n255\n123456',
        b'P5\n100000 100000\n255\n123456', b'P5\n999999999 999999999\n255\n123456',
        b'P5\n1 900000\n255\n' + b'1' * 900_000, b'P2\n3 2\n255\n1 2 3', b'P2\n3 2\n255\n1 2 x 4',
        b'P2\n3 2\n255\n1 2 3 4 5 999', b'P2\n3 2\n255\n1 2 3 4 5 6 # 7\n7',
        b'P9\n3 2\n255\n123456', b'GIF89a', b'\x89PNG\r\n\x1a\n',
        b'P5\n3 2\n65535\n123456789'])
    def test_images_that_are_none(self, tmp_path, pixels):
        path = write_map(tmp_path)
        (tmp_path / 'map.pgm').write_bytes(pixels)
        assert 'Error' not in refused(path, 'map.pgm')

    def test_png_cut_anywhere_or_with_a_lying_size(self, tmp_path):
        path = write_map(tmp_path, np.eye(40, dtype=np.uint8) * 254, image='map.png')
        whole = (tmp_path / 'map.png').read_bytes()
        for end in range(0, len(whole) - 20, 7):
            (tmp_path / 'map.png').write_bytes(whole[:end])
            refused(path, 'map.png')
        header = b'IHDR' + struct.pack('>II', 90_000, 90_000) + whole[24:29]
        bomb = whole[:12] + header + struct.pack('>I', zlib.crc32(header)) + whole[33:]
        (tmp_path / 'map.png').write_bytes(bomb)
        refused(path, 'map.png')

    @given(st.binary(max_size=60))
    @settings(max_examples=60)
    def test_any_bytes_are_read_or_refused(self, tmp_path_factory, noise):
        folder = tmp_path_factory.mktemp('noise')
        path = write_map(folder)
        (folder / 'map.pgm').write_bytes(b'P5\n3 2\n255\n' + noise)
        if len(noise.rstrip()) > 6 or len(noise) < 6:
            refused(path, 'map.pgm')
        for name in ('map.yaml', 'map.map'):
            (folder / name).write_bytes(noise)
            refused(folder / name, name)


class TestFiles:
    def test_missing_file_and_missing_image(self, tmp_path):
        refused(tmp_path / 'none.yaml', 'none.yaml', 'no such file')
        path = write_map(tmp_path)
        (tmp_path / 'map.pgm').unlink()
        refused(path, 'map.pgm', 'no such file')

    def test_folders_and_pipes(self, tmp_path):
        (tmp_path / 'folder.map').mkdir()
        refused(tmp_path / 'folder.map', 'folder')
        os.mkfifo(tmp_path / 'pipe.yaml')
        refused(tmp_path / 'pipe.yaml', 'regular')
        refused(write_map(tmp_path, image=''), 'image')
        refused(write_map(tmp_path, image='map.pgm').with_suffix('.png'), '.yaml')
        path = write_map(tmp_path)
        (tmp_path / 'map.pgm').unlink()
        (tmp_path / 'map.pgm').mkdir()
        refused(path, 'folder')

    def test_names_that_no_file_system_takes(self, tmp_path):
        refused(tmp_path / ('x' * 300 + '.yaml'), 'too long')
        refused(tmp_path / 'line\nbreak.yaml', 'no such file')

    @pytest.mark.skipif(os.geteuid() == 0, reason='root reads everything')
    def test_unreadable(self, tmp_path):
        path = write_map(tmp_path)
        path.chmod(0)
        refused(path, 'cannot be read')

    def test_only_yaml_is_written(self, tmp_path):
        with pytest.raises(WorldError, match='yaml'):
            save_world(tmp_path / 'world.png', World(Grid(1, 1, 1.0), np.zeros((1, 1), np.int8)))


class TestMovingAi:
    HEADER = 'type octile\nheight 2\nwidth 3\nmap\n'

    def read(self, folder, text):
        path = folder / 'map.map'
        path.write_bytes(text.encode('latin-1'))
        return path

    def test_first_line_is_the_highest(self, tmp_path):
        world = load_world(self.read(tmp_path, self.HEADER + '.GS\n@.T\n'))
        np.testing.assert_array_equal(world.occupancy, [[100, 0, 100], [0, 0, 0]])
        assert world.grid == Grid(2, 3, 1.0)

    def test_water_is_blocked_and_line_ends_may_be_windows(self, tmp_path):
        text = (self.HEADER + 'OTW\n...').replace('\n', '\r\n')
        world = load_world(self.read(tmp_path, text))
        np.testing.assert_array_equal(world.occupancy, [[0, 0, 0], [100, 100, 100]])

    @pytest.mark.parametrize(('text', 'word'), [
        ('', 'octile'), ('map\n...\n', 'octile'), (HEADER, 'height'), (HEADER + '...\n', 'height'),
        (HEADER + '...\n...\n...\n', 'height'), (HEADER + '...\n..\n', 'line 6'),
        (HEADER + '....\n...\n', 'line 5'), (HEADER + '...\n.x.\n', 'line 6'),
        (HEADER + '...\n.\xe9.\n', 'line 6'), (HEADER.replace('2', 'two') + '...\n...\n', 'whole'),
        (HEADER.replace('2', '0') + '...\n...\n', 'cells'),
        (HEADER.replace('2', '999999999') + '...\n', 'cells'),
        (HEADER.replace('2', '9' * 15) + '...\n', 'whole'),
        (HEADER.replace('octile', 'tile') + '...\n...\n', 'octile'),
        (HEADER.replace('width 3\n', '') + '...\n...\n', 'octile')])
    def test_malformed(self, tmp_path, text, word):
        refused(self.read(tmp_path, text), 'map.map', word)


class TestShippedWorlds:
    START, GOAL, CORNER = (3, 2), (16, 15), (3, 15)

    @pytest.mark.parametrize('name', ['open', 'task1', 'task2'])
    def test_size_start_and_goal(self, name):
        world = load_world(find_world(name))
        assert world.grid == Grid(20, 20, 0.25)
        assert world.name == name
        for row, col in (self.START, self.GOAL):
            assert not crop_neighbourhood(world.occupancy, row, col).any()
        assert find_world(name).with_suffix('.pgm').read_bytes().startswith(b'P5\n20 20\n255\n')

    def test_open_is_open(self):
        assert not load_world(find_world('open')).occupancy.any()

    @pytest.mark.parametrize('name', ['task1', 'task2'])
    def test_the_demonstrated_way_is_blocked_but_there_is_another(self, name):
        world = load_world(find_world(name))
        assert world.occupancy[3, 2:16].any()
        assert name == 'task1' or world.occupancy[3:17, 15].any()
        assert self.GOAL in reachable(world, self.START)

    def test_task_1_is_one_block(self):
        rows, cols = np.nonzero(load_world(find_world('task1')).occupancy)
        assert sorted(set(rows)) == [2, 3, 4, 5]
        assert sorted(set(cols)) == [8, 9]
        assert len(rows) == 8

    def test_task_2_has_a_wall_with_one_door_off_the_demonstrated_column(self):
        world = load_world(find_world('task2'))
        assert np.flatnonzero(world.occupancy[10] == 0).tolist() == [11, 12]
        cells = world.occupancy.copy()
        cells[10] = 100
        closed = World(world.grid, cells)
        assert self.GOAL not in reachable(closed, self.START)
        # Nothing but the wall parts the free cells: every free cell can be a start.
        assert len(reachable(world, self.START)) == (world.occupancy == 0).sum()


def reachable(world, start):
    """Return the cells a robot with a body can get to."""
    found, waiting = {start}, [start]
    while waiting:
        row, col = waiting.pop()
        blocked, _ = masks_from_neighbourhood(crop_neighbourhood(world.occupancy, row, col))
        allowed = allowed_from_blocked(blocked)
        for heading in range(N_HEADINGS):
            cell = int(row + STEP_ROW[heading]), int(col + STEP_COL[heading])
            if allowed >> heading & 1 and cell not in found:
                found.add(cell)
                waiting.append(cell)
    return found


class TestFindWorld:
    def test_paths_are_taken_as_they_are(self):
        assert find_world('a/b.yaml') == Path('a/b.yaml')
        assert find_world('b.map') == Path('b.map')

    @pytest.mark.parametrize('name', ['nothing', '.', '..', 'task1 ', '*'])
    def test_unknown_names_are_answered_with_the_known_ones(self, name):
        with pytest.raises(WorldError, match='open, task1, task2'):
            find_world(name)

    def test_installed_worlds_are_found(self, tmp_path, monkeypatch):
        folder = tmp_path / 'share' / 'experience_controller' / 'config' / 'worlds'
        folder.mkdir(parents=True)
        save_world(folder / 'mine.yaml', World(Grid(1, 1, 1.0), np.zeros((1, 1), np.int8)))
        monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
        assert folder in config_folders('worlds')
        assert find_world('mine') == folder / 'mine.yaml'
