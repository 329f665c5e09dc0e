"""What other readers of maps make of it where Python's libraries do it their own way."""

import itertools
import struct
import zlib

import numpy as np
import pytest

from world_maps.map_image import read_pixels
from world_maps.world import load_world, WorldError

YAML = ('image: map.png\nresolution: 0.5\norigin: [1.0, 2.0, 0.0]\nnegate: 0\n'
        'occupied_thresh: 0.65\nfree_thresh: 0.196\n')
#: PNG's kinds of colour, by the number of channels.
COLOUR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}
#: Values of 16 bits whose low byte decides, and others.
DEEP = (0, 255, 256, 26213, 26214, 52427, 52428, 65280, 65534, 65535)


def png(rows, bits, n_channels, seen_through=None):
    """Write a PNG of any depth, which Pillow cannot."""
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack(
            '>I', zlib.crc32(kind + data))

    lines = []
    for row in rows:
        text = ''.join(format(value, f'0{bits}b') for value in np.ravel(row))
        text += '0' * (-len(text) % 8)
        lines.append(b'\0' + int(text, 2).to_bytes(len(text) // 8, 'big'))
    width = np.size(rows[0]) // n_channels
    header = struct.pack('>IIBBBBB', width, len(rows), bits, COLOUR_TYPES[n_channels], 0, 0, 0)
    see = b'' if seen_through is None else chunk(b'tRNS', struct.pack('>H', seen_through))
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header) + see
            + chunk(b'IDAT', zlib.compress(b''.join(lines))) + chunk(b'IEND', b''))


def weighed(colours):
    """Return the grey of 16-bit colours: their luma, cut to eight bits."""
    red, green, blue = (colours[..., i].astype(int) for i in range(3))
    return (299 * red + 587 * green + 114 * blue + 500) // 1000 // 257


@pytest.mark.parametrize('n_channels', [1, 2, 3, 4])
def test_no_bit_of_a_deep_png_is_lost(tmp_path, n_channels):
    values = np.array(list(itertools.islice(itertools.cycle(
        itertools.product(DEEP, repeat=min(n_channels, 3))), 999)))
    pixels = np.full((999, n_channels), 65535)
    pixels[:, :values.shape[1]] = values
    if n_channels in (2, 4):
        pixels[:, -1] = np.resize(DEEP[-4:], 999)
    path = tmp_path / 'map.png'
    path.write_bytes(png(pixels.reshape(27, -1).tolist(), 16, n_channels))
    found = read_pixels(path)
    grey = weighed(pixels) if n_channels > 2 else pixels[:, 0] // 257
    np.testing.assert_array_equal(found.grey.ravel(), grey)
    opaque = pixels[:, -1] == 65535 if n_channels in (2, 4) else np.full(999, True)
    np.testing.assert_array_equal(found.alpha.ravel() == 255, opaque)


@pytest.mark.parametrize('white', [256, 1000, 65535])
@pytest.mark.parametrize('kind', ['P3', 'P6'])
def test_nor_of_a_deep_ppm(tmp_path, kind, white):
    values = np.random.default_rng(7).integers(0, white + 1, (4, 5, 3))
    data = values.astype('>u2').tobytes() if kind == 'P6' else (
        '\n# 7 comments\n'.join(map(str, values.ravel().tolist())).encode())
    path = tmp_path / 'map.ppm'
    path.write_bytes(f'{kind}\n# 9\n5 4\n{white}\n'.encode() + data)
    wide = np.floor(values * (65535 / white) + 0.5)
    np.testing.assert_array_equal(read_pixels(path).grey, weighed(wide))
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(WorldError, match='is no complete image'):
        read_pixels(path)


@pytest.mark.parametrize('bits', [1, 2, 4, 8])
def test_the_grey_that_is_seen_through_is_found_at_every_depth(tmp_path, bits):
    values = list(range(min(2 ** bits, 16)))
    path = tmp_path / 'map.png'
    path.write_bytes(png([values], bits, 1, seen_through=1))
    assert read_pixels(path).alpha[0].tolist() == [0 if it == 1 else 255 for it in values]


class TestTheYamlFile:
    @staticmethod
    def load(folder, text):
        (folder / 'map.png').write_bytes(png([[255, 0]], 8, 1))
        path = folder / 'map.yaml'
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_world(path)

    @pytest.mark.parametrize('again', [
        'negate: 1', 'image: other.png', 'resolution: 0.5', '"free_thresh": 0.25'])
    def test_a_key_given_twice_is_refused_with_both_lines(self, tmp_path, again):
        key = again.split(':')[0].strip('"')
        line = 1 + [each.split(':')[0] for each in YAML.splitlines()].index(key)
        with pytest.raises(WorldError) as caught:
            self.load(tmp_path, f'{YAML}{again}\n')
        assert f"it says '{key}' twice, in line {line} and in line 7: keep one of them" in str(
            caught.value)

    @pytest.mark.parametrize('written', ['010', '"10"', "'10.0'", '1e1', '+10', '10.', '1.0E+1'])
    def test_a_number_is_what_map_server_reads(self, tmp_path, written):
        grid = self.load(tmp_path, YAML.replace('0.5', written)).grid
        assert grid.resolution == 10.0

    @pytest.mark.parametrize('written', ['1_0', '1:30', '0o10', '10 m', 'true', '', '[10]'])
    def test_what_is_no_number_for_map_server_is_none_here(self, tmp_path, written):
        with pytest.raises(WorldError, match='resolution must be a number'):
            self.load(tmp_path, YAML.replace('0.5', written))

    @pytest.mark.parametrize(('written', 'is_dark_free'), [
        ('1', True), ('yes', True), ('On', True), ('"true"', True), ('y', True), ('no', False),
        ("'0'", False), ('FALSE', False)])
    def test_negate_in_words(self, tmp_path, written, is_dark_free):
        world = self.load(tmp_path, YAML.replace('negate: 0', f'negate: {written}'))
        assert world.occupancy.tolist() == [[100, 0] if is_dark_free else [0, 100]]

    @pytest.mark.parametrize('change', [
        lambda text: b'\xef\xbb\xbf' + text.encode(), lambda text: text.encode('utf-16'),
        lambda text: text.replace('\n', '\r\n').encode(),
        lambda text: text.replace(': ', ':\t').encode(),
        lambda text: b'%YAML 1.2\n---\n' + text.encode() + b'...\n',
        lambda text: b'\n# made by hand\n' + text.replace('\n', '  # why\n').encode()], ids=[
            'BOM', 'UTF-16', 'CRLF', 'tabs', 'YAML 1.2', 'comments'])
    def test_however_it_is_written(self, tmp_path, change):
        world = self.load(tmp_path, change(YAML))
        assert world.occupancy.tolist() == [[0, 100]]
        assert world.notes == ()

    def test_an_image_whose_name_is_a_number(self, tmp_path):
        (tmp_path / '010').write_bytes(png([[0, 255]], 8, 1))
        assert self.load(tmp_path, YAML.replace('map.png', '010')).occupancy.tolist() == [[100, 0]]
