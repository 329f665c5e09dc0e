"""Maps are read as map_server of today reads them, and what is made do with is said."""

import math
from pathlib import Path
import struct
import zlib

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from PIL import Image
import pytest

from world_maps.map_cells import cells_from_pixels, turned, turned_corner
from world_maps.map_image import read_pixels
from world_maps.world import load_world, WorldError

IMAGES = ('L', 'LA', 'RGB', 'RGBA', 'P', '1', 'I;16', 'P5', 'P6')
CHANNELS = {'LA': 2, 'RGB': 3, 'RGBA': 4, 'P6': 3}
#: Grey values that stand beside a threshold, and opacities that do.
VALUES = st.sampled_from((0, 1, 50, 100, 101, 127, 128, 205, 254, 255)) | st.integers(0, 255)

SHARES = st.sampled_from((0.0, 0.196, 0.25, 0.65, 1.0)) | st.floats(0, 1)


def write_yaml(folder, image='map.png', **changes):
    """Write a YAML file for an image that lies there."""
    fields = {'image': image, 'resolution': 0.5, 'origin': '[1.0, 2.0, 0.0]', 'negate': 0,
              'occupied_thresh': 0.65, 'free_thresh': 0.196, **changes}
    path = folder / 'map.yaml'
    path.write_text(''.join(f'{key}: {value}\n' for key, value in fields.items()))
    return path


def save_grey(folder, rows, image='map.png'):
    Image.fromarray(np.array(rows, dtype=np.uint8)).save(folder / image)


def refusal(path):
    with pytest.raises(WorldError) as caught:
        load_world(path)
    assert '\n' not in str(caught.value)
    assert caught.value.path.parent == path.parent
    return str(caught.value)


@st.composite
def images(draw):
    """Draw the pixels of a small image, how it is stored, and the largest value if PNM."""
    kind = draw(st.sampled_from(IMAGES))
    rows, cols = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    n = rows * cols * CHANNELS.get(kind, 1)
    white = draw(st.sampled_from((20, 100, 200, 255))) if kind[1:] in ('5', '6') else 255
    if kind == 'I;16':
        flat = draw(st.lists(st.integers(0, 65535), min_size=n, max_size=n))
    else:
        flat = [min(value, white) for value in draw(st.lists(VALUES, min_size=n, max_size=n))]
    return kind, np.array(flat).reshape(rows, cols, -1), white


def store(folder, kind, pixels, white):
    """Write an image file; palettes hold grey and what a bitmap cannot hold is black or white."""
    values = pixels[:, :, 0] if pixels.shape[2] == 1 else pixels
    path = folder / ('map.png' if kind in Image.MODES or kind == 'I;16' else 'map.pgm')
    if kind in ('P5', 'P6'):
        header = f'{kind}\n{pixels.shape[1]} {pixels.shape[0]}\n{white}\n'.encode()
        path.write_bytes(header + values.astype(np.uint8).tobytes())
    elif kind == 'I;16':
        Image.fromarray(values.astype(np.uint16)).save(path)
    elif kind == 'P':
        image = Image.fromarray(values.astype(np.uint8), 'L').convert('P')
        image.save(path, transparency=205)
    elif kind == '1':
        Image.fromarray(values > 127).save(path)
    else:
        Image.fromarray(values.astype(np.uint8), kind).save(path)
    return path


def expected_grey(kind, pixel, white):
    """Return one pixel's grey and whether it is wholly opaque: 16-bit luma, cut to 8 bits."""
    if kind == 'I;16':
        return int(pixel[0]) // 257, True
    if kind == '1':
        return (255 if pixel[0] > 127 else 0), True
    wide = [math.floor(int(value) * 65535 / white + 0.5) for value in pixel]
    if kind in ('L', 'LA', 'P', 'P5'):
        opaque = pixel[0] != 205 if kind == 'P' else kind != 'LA' or pixel[1] == 255
        return wide[0] // 257, bool(opaque)
    luma = (299 * wide[0] + 587 * wide[1] + 114 * wide[2] + 500) // 1000
    return luma // 257, kind != 'RGBA' or pixel[3] == 255


def expected_cell(grey, opaque, mode, negate, high, low):
    """Return one cell of the OccupancyGrid, in single precision."""
    if mode == 'raw':
        return grey if grey <= 100 else -1
    shade = np.float32(grey) / np.float32(255)
    occupied = shade if negate else np.float32(1) - shade
    if not opaque:
        return -1
    if occupied <= np.float32(low):
        return 0
    if occupied >= np.float32(high):
        return 100
    if mode == 'trinary':
        return -1
    percent = (occupied - np.float32(low)) / np.float32(high - low) * np.float32(100)
    return math.floor(float(percent) + 0.5)


@given(image=images(), mode=st.sampled_from(('trinary', 'scale', 'raw')), negate=st.booleans(),
       thresholds=st.tuples(SHARES, SHARES))
@settings(max_examples=150, deadline=None)
def test_every_cell_is_map_servers(tmp_path_factory, image, mode, negate, thresholds):
    kind, values, white = image
    low, high = sorted(thresholds)
    pixels = read_pixels(store(tmp_path_factory.mktemp('map'), kind, values, white))
    cells = cells_from_pixels(pixels, mode, negate, high, low)
    expected = [[expected_cell(*expected_grey(kind, pixel, white), mode, negate, high, low)
                 for pixel in row] for row in values]
    np.testing.assert_array_equal(cells[::-1], expected)


class TestTransparency:
    @pytest.mark.parametrize('mode', ['trinary', 'scale'])
    def test_one_pixel_does_not_change_the_others(self, tmp_path, mode):
        pixels = np.full((1, 4, 4), 205, dtype=np.uint8)
        pixels[0, :, 3] = 255, 254, 0, 255
        pixels[0, 3, :3] = 254
        Image.fromarray(pixels).save(tmp_path / 'map.png')
        world = load_world(write_yaml(tmp_path, mode=mode, free_thresh=0.19))
        # In mode scale the first is hardly occupied at all.
        assert world.occupancy.tolist() == [[0 if mode == 'scale' else 100, 100, 100, 0]]

    def test_colours_are_weighed_as_the_eye_does(self, tmp_path):
        pixels = np.array([[[255, 255, 0], [0, 0, 255], [255, 0, 255]]], dtype=np.uint8)
        Image.fromarray(pixels).save(tmp_path / 'map.png')
        assert read_pixels(tmp_path / 'map.png').grey.tolist() == [[225, 29, 105]]


class TestNotes:
    def test_the_savers_unknown_that_becomes_free(self, tmp_path):
        save_grey(tmp_path, [[205, 205, 254, 0]])
        loose = load_world(write_yaml(tmp_path, free_thresh=0.25))
        assert loose.occupancy.tolist() == [[0, 0, 0, 100]]
        assert any('2 cells' in note and '205' in note and 'free_thresh: 0.196' in note
                   for note in loose.notes)
        strict = load_world(write_yaml(tmp_path))
        assert strict.occupancy.tolist() == [[100, 100, 0, 100]]
        assert not any('205' in note for note in strict.notes)
        assert any('2 of 4 cells are unknown' in note for note in strict.notes)

    def test_nothing_to_say_of_a_plain_map(self, tmp_path):
        save_grey(tmp_path, [[254, 0]])
        assert load_world(write_yaml(tmp_path)).notes == ()


class TestYaw:
    @pytest.mark.parametrize(('yaw', 'quarters'), [
        (0.0, 0), (-0.0, 0), (math.pi / 2, 1), (1.57, 1), (3.14, 2), (-math.pi, 2), (3.14159, 2),
        (-1.5708, 3), (4.712, 3), (6.2832, 0)])
    def test_half_and_quarter_turns_are_exact(self, tmp_path, yaw, quarters):
        save_grey(tmp_path, [[254, 254, 0], [254, 254, 254]])
        straight = load_world(write_yaml(tmp_path))
        world = load_world(write_yaml(tmp_path, origin=f'[1.0, 2.0, {yaw!r}]'))
        turn = np.rint([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        for row, col in np.ndindex(straight.occupancy.shape):
            place = np.array(straight.grid.world_from_cell(row, col)) - (1.0, 2.0)
            cell = world.grid.cell_from_world(*(turn @ place + (1.0, 2.0)))
            assert world.occupancy[cell] == straight.occupancy[row, col]
        assert any('turned' in note for note in world.notes) == (quarters != 0)

    @pytest.mark.parametrize(('yaw', 'angle'), [
        ('0.5', '28.6479 degrees'), ('-2.0', '-114.592 degrees'), ('90', 'degrees?'),
        ('0.02', '1.14592 degrees')])
    def test_any_other_angle_is_refused_by_name(self, tmp_path, yaw, angle):
        save_grey(tmp_path, [[254]])
        assert angle in refusal(write_yaml(tmp_path, origin=f'[0, 0, {yaw}]'))

    @given(st.integers(1, 5), st.integers(1, 5), st.integers(0, 3))
    def test_four_turns_are_none(self, rows, cols, quarters):
        cells = np.arange(rows * cols, dtype=np.int8).reshape(rows, cols)
        np.testing.assert_array_equal(turned(turned(cells, quarters), 4 - quarters), cells)
        x, y = turned_corner((0.0, 0.0), cells.shape, 1.0, quarters)
        assert {abs(x), abs(y)} <= {0.0, float(rows), float(cols)}


class TestFilesAsTheyAre:
    def test_a_jpeg_of_any_name_is_read_and_called_so(self, tmp_path):
        grey = np.full((16, 16), 254, dtype=np.uint8)
        grey[:8] = 0
        Image.fromarray(grey).save(tmp_path / 'map.pgm', format='JPEG', quality=95)
        world = load_world(write_yaml(tmp_path, 'map.pgm'))
        np.testing.assert_array_equal(world.occupancy, np.where(grey[::-1] == 0, 100, 0))
        assert 'is a JPEG' in world.notes[0]

    @pytest.mark.parametrize(('kind', 'name'), [('GIF', 'GIF'), ('TIFF', 'TIFF'),
                                                ('WEBP', 'WebP')])
    def test_other_images_are_called_what_they_are(self, tmp_path, kind, name):
        Image.fromarray(np.zeros((2, 2), np.uint8)).save(tmp_path / 'map.png', format=kind)
        assert f'is a {name} file' in refusal(write_yaml(tmp_path))

    @pytest.mark.parametrize('size', [(19530, 14986), (90_000, 90_000), (150_000, 2)])
    def test_too_large_is_known_from_the_header(self, tmp_path, size):
        Image.fromarray(np.zeros((1, 1), np.uint8)).save(tmp_path / 'map.png')
        small = (tmp_path / 'map.png').read_bytes()
        header = b'IHDR' + struct.pack('>II', *size) + small[24:29]
        lying = small[:12] + header + struct.pack('>I', zlib.crc32(header)) + small[33:]
        (tmp_path / 'map.png').write_bytes(lying)
        message = refusal(write_yaml(tmp_path))
        assert f'{size[0]} x {size[1]} cells are too many' in message
        assert 'times smaller' in message

    @pytest.mark.parametrize('image', ['/home/somebody/maps/lab.png', 'maps/lab.png',
                                       'C:\\maps\\lab.png'])
    def test_a_path_of_another_machine(self, tmp_path, image):
        path = write_yaml(tmp_path, f"'{image}'")
        message = refusal(path)
        assert str(path) in message
        assert image in message
        save_grey(tmp_path, [[254, 0]], 'lab.png')
        world = load_world(path)
        assert world.occupancy.tolist() == [[0, 100]]
        assert image in world.notes[0]

    def test_a_path_that_is_right_is_taken(self, tmp_path):
        elsewhere = tmp_path / 'elsewhere'
        elsewhere.mkdir()
        save_grey(elsewhere, [[254]], 'lab.png')
        save_grey(tmp_path, [[0]], 'lab.png')
        world = load_world(write_yaml(tmp_path, elsewhere / 'lab.png'))
        assert world.occupancy.tolist() == [[0]]
        assert world.notes == ()

    def test_a_mode_that_unfolds_for_ever(self, tmp_path):
        lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
        lines += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]' for i in range(1, 40)]
        path = Path(write_yaml(tmp_path))
        path.write_text('\n'.join([*lines, path.read_text(), 'mode: *a39']))
        refusal(path)
