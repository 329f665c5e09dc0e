"""Worlds that are sent by anybody: what becomes of them, and what is refused."""

import io
import json
import os

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from PIL import Image
import pytest

from frame_helpers import frame_from_bytes
from page_node.big_frames import bytes_from_frame
from page_node.exchange import MOST_UPLOADED
from page_node.refusal import RefusedError
from page_node.worlds.folder import MOST_WORLDS, shipped, WorldsFolder
from page_node.worlds.tasks import tasks_in
from page_node.worlds.uploads import MOST_HEADER, MOST_PIXELS, pixels_from_upload
from page_node.worlds.world_files import frame_of, list_of, path_of, save
from world_maps.world import find_world, load_world

BINARY = 'application/octet-stream'
DRAWN = {'type': 'drawn', 'resolution': 0.25, 'origin': [0.0, 0.0]}
CELLS = np.array([[0, 1, 0], [0, 0, 1]], np.uint8)
YAML = """image: any/where.pgm
resolution: 0.1
origin: [1, 2, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


def drawn(cells=CELLS, **header):
    return bytes_from_frame({**DRAWN, **header}, {'cells': cells})


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, 'png')
    return file.getvalue()


def picture(shape=(4, 6)):
    """Return a PNG that is white but for one black pixel, at its upper left corner."""
    pixels = np.full(shape, 255, np.uint8)
    pixels[0, 0] = 0
    return png(pixels)


def saved(folder, body, media_type=BINARY, name='hall', **query):
    save(str(folder), name, body, media_type, query)
    return frame_from_bytes(frame_of(str(folder), name))


def refusal(function, *arguments):
    with pytest.raises(RefusedError) as error:
        function(*arguments)
    assert error.value.status >= 400
    assert '\n' not in str(error.value)
    return error.value.code


class TestWhatIsTaken:
    def test_drawn_cells_are_the_world_that_the_simulator_loads(self, tmp_path):
        header, arrays = saved(tmp_path / 'worlds', drawn(origin=[-1.0, 2.5]))
        np.testing.assert_array_equal(arrays['occupancy'], CELLS * 100)
        assert (header['rows'], header['cols'], header['resolution']) == (2, 3, 0.25)
        assert header['origin'] == [-1.0, 2.5]
        world = load_world(find_world(path_of(str(tmp_path / 'worlds'), 'hall')))
        np.testing.assert_array_equal(world.occupancy, CELLS * 100)
        assert (world.grid.origin_x, world.grid.origin_y) == (-1.0, 2.5)

    def test_an_image_needs_its_resolution(self, tmp_path):
        header, arrays = saved(tmp_path, picture(), 'image/png', resolution='0.05')
        assert (header['rows'], header['cols'], header['resolution']) == (4, 6, 0.05)
        assert arrays['occupancy'][3, 0] == 100
        assert arrays['occupancy'].sum() == 100
        frame = bytes_from_frame({'type': 'image', 'resolution': 0.05},
                                 {'image': np.frombuffer(picture(), np.uint8)})
        np.testing.assert_array_equal(saved(tmp_path, frame)[1]['occupancy'], arrays['occupancy'])
        assert refusal(saved, tmp_path, picture(), 'image/png') == 'no_resolution'

    def test_map_servers_two_files_whatever_the_image_is_called(self, tmp_path):
        pgm = b'P5\n3 2\n255\n' + bytes([254, 0, 254, 254, 254, 0])
        header, arrays = saved(tmp_path, bytes_from_frame(
            {'type': 'map_server', 'yaml': YAML}, {'image': np.frombuffer(pgm, np.uint8)}))
        assert (header['resolution'], header['origin']) == (0.1, [1.0, 2.0])
        np.testing.assert_array_equal(arrays['occupancy'], [[0, 0, 100], [0, 100, 0]])

    def test_a_smaller_picture_shows_every_wall(self, tmp_path):
        cells = np.zeros((300, 100), np.uint8)
        cells[299, 0] = 1
        saved(tmp_path, drawn(cells))
        header, arrays = frame_from_bytes(frame_of(str(tmp_path), 'hall', 64))
        assert (header['rows'], header['cols'], header['resolution']) == (60, 20, 1.25)
        assert arrays['occupancy'][59, 0] == 100

    def test_the_largest_that_can_be_drawn_can_be_saved(self, tmp_path):
        body = drawn(np.zeros((MOST_PIXELS, MOST_PIXELS), np.uint8))
        assert len(body) <= MOST_UPLOADED + MOST_HEADER + 4
        assert saved(tmp_path, body)[0]['rows'] == MOST_PIXELS

    def test_what_is_saved_again_takes_the_place_of_the_first(self, tmp_path):
        saved(tmp_path, drawn())
        before = list_of(str(tmp_path))[0]
        os.utime(tmp_path / 'hall.pgm', (0, 0))
        os.utime(tmp_path / 'hall.yaml', (1, 1))
        assert saved(tmp_path, drawn(1 - CELLS))[1]['occupancy'].sum() == 400
        after = list_of(str(tmp_path))[0]
        assert after['changed'] >= before['changed']
        assert sorted(each.name for each in tmp_path.iterdir()) == ['hall.pgm', 'hall.yaml']

    def test_all_are_listed_and_know_their_names(self, tmp_path):
        assert [each['name'] for each in list_of(str(tmp_path / 'none'))] == sorted(shipped())
        saved(tmp_path, drawn())
        assert list_of(str(tmp_path))[0]['own']
        folder = WorldsFolder(tmp_path)
        for name in ('hall', 'task1'):
            assert folder.name_of(path_of(str(tmp_path), name)) == name
        assert folder.name_of(str(shipped()['open'].path)) == 'open'
        assert folder.name_of('/somewhere/else.yaml') == ''


class TestWhatIsRefused:
    @pytest.mark.parametrize('name', ['', '..', '../x', 'a/b', '.hidden', 'a' * 65, 'ä', 'a\n',
                                      'a.yaml', '-p', 'a\0'])
    def test_names_that_are_no_file_names(self, tmp_path, name):
        assert refusal(save, str(tmp_path / 'w'), name, drawn(), BINARY, {}) == 'bad_name'
        assert refusal(frame_of, str(tmp_path / 'w'), name) == 'bad_name'
        assert not (tmp_path / 'w').exists()

    def test_worlds_that_come_with_us_stay_as_they_are(self, tmp_path):
        assert refusal(saved, tmp_path, drawn(), BINARY, 'task1') == 'shipped'

    @pytest.mark.parametrize(('body', 'code'), [
        (b'', 'malformed'), (b'\xff\xff\xff\xff{}', 'malformed'), (b'\2\0\0\0{}', 'malformed'),
        (drawn() + b'x', 'malformed'), (drawn()[:-1], 'malformed'), (b'[]' * 9, 'malformed'),
        (drawn(resolution=0), 'no_resolution'), (drawn(resolution='much'), 'no_resolution'),
        (drawn(resolution=True), 'no_resolution'), (drawn(resolution=None), 'no_resolution'),
        (drawn(origin=[1.0]), 'malformed'), (drawn(origin=[1e9, 0.0]), 'malformed'),
        (drawn(origin='here'), 'malformed'), (drawn(type='film'), 'malformed'),
        (drawn(np.zeros(6, np.uint8)), 'malformed'),
        (drawn(np.zeros((1, 4097), np.uint8)), 'too_large'),
        (bytes_from_frame(DRAWN, {'cells': np.zeros((2, 2), np.float32)}), 'malformed'),
        (bytes_from_frame({'type': 'map_server', 'yaml': 'image: [', }, {
            'image': np.zeros(9, np.uint8)}), 'unreadable'),
        (bytes_from_frame({'type': 'map_server', 'yaml': YAML}, {
            'image': np.zeros(9, np.uint8)}), 'unreadable'),
        (bytes_from_frame({'type': 'map_server', 'yaml': '- 1'}, {
            'image': np.zeros(9, np.uint8)}), 'unreadable'),
        (bytes_from_frame({'type': 'map_server', 'yaml': 7}, {
            'image': np.zeros(9, np.uint8)}), 'malformed')])
    def test_what_is_no_world(self, tmp_path, body, code):
        assert refusal(saved, tmp_path / 'w', body) == code
        assert not (tmp_path / 'w').exists()

    @pytest.mark.parametrize(('image', 'code'), [
        (b'no image', 'unreadable'), (picture()[:40], 'unreadable'),
        (picture((1, 5000)), 'too_large'), (b'P5\n99999 99999\n255\n', 'unreadable')])
    def test_images_that_are_none_or_unpack_to_too_much(self, tmp_path, image, code):
        assert refusal(lambda: saved(
            tmp_path, image, 'image/png', resolution='0.05')) == code
        assert list_of(str(tmp_path))[0]['own'] is False

    def test_too_many(self, tmp_path):
        for n in range(MOST_WORLDS):
            (tmp_path / f'w{n}.yaml').touch()
        assert refusal(saved, tmp_path, drawn()) == 'too_many'

    def test_a_folder_that_cannot_be_written(self, tmp_path):
        (tmp_path / 'file').touch()
        assert refusal(saved, tmp_path / 'file', drawn()) == 'not_written'

    @given(st.binary(max_size=200))
    @settings(deadline=None)
    def test_anything_is_a_world_or_refused(self, body):
        for media_type in (BINARY, 'image/png'):
            with pytest.raises(RefusedError):
                pixels_from_upload(body, media_type, {'resolution': '0.05'})

    @given(st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=9),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
            st.sampled_from(['type', 'arrays', 'name', 'dtype', 'shape', 'yaml', 'cells']),
            inner, max_size=5), max_leaves=12))
    @settings(deadline=None)
    def test_any_header_is_one_or_refused(self, header):
        text = json.dumps(header).encode()
        with pytest.raises(RefusedError):
            pixels_from_upload(len(text).to_bytes(4, 'little') + text + b'rest', BINARY, {})


class TestWhatLeadsOut:
    def test_a_link_is_no_world(self, tmp_path):
        outside, folder = tmp_path / 'outside', tmp_path / 'worlds'
        saved(outside, drawn(), name='secret')
        folder.mkdir()
        (folder / 'hall.yaml').symlink_to(outside / 'secret.yaml')
        for function in (frame_of, path_of):
            assert refusal(function, str(folder), 'hall') == 'unreadable'

    @pytest.mark.parametrize('image', ['/etc/passwd', '../outside/secret.pgm', 'link.pgm'])
    def test_nor_is_a_file_that_names_an_image_outside(self, tmp_path, image):
        outside, folder = tmp_path / 'outside', tmp_path / 'worlds'
        saved(outside, drawn(), name='secret')
        saved(folder, drawn())
        (folder / 'link.pgm').symlink_to(outside / 'secret.pgm')
        text = (folder / 'hall.yaml').read_text()
        (folder / 'hall.yaml').write_text(text.replace('hall.pgm', image))
        assert refusal(frame_of, str(folder), 'hall') == 'unreadable'

    def test_saving_over_a_link_leaves_what_it_leads_to(self, tmp_path):
        outside, folder = tmp_path / 'outside', tmp_path / 'worlds'
        saved(outside, drawn(), name='secret')
        before = (outside / 'secret.pgm').read_bytes()
        folder.mkdir()
        (folder / 'hall.yaml').symlink_to(outside / 'secret.yaml')
        (folder / 'hall.pgm').symlink_to(outside / 'secret.pgm')
        saved(folder, drawn(1 - CELLS))
        assert (outside / 'secret.pgm').read_bytes() == before


def test_tasks_are_listed_with_how_much_they_hold(tmp_path):
    assert tasks_in(str(tmp_path / 'none')) == []
    for path in ('hall/0001_demo', 'hall/0002_trial', 'kitchen', '.git'):
        (tmp_path / path).mkdir(parents=True, exist_ok=True)
    assert tasks_in(str(tmp_path)) == [
        {'name': 'hall', 'episodes': 2}, {'name': 'kitchen', 'episodes': 0}]
    (tmp_path / 'file').touch()
    assert refusal(tasks_in, str(tmp_path / 'file')) == 'folder'
