"""Map files that never end, are none, or stand for more than memory holds: refused in a second."""

import os
import time

import pytest

from world_maps.errors import WorldError
from world_maps.map_server import read_map_server

YAML = 'image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n'
BOMB = '\n'.join(['a0: &a0 [x, x]', *(
    f'a{i}: &a{i} [*a{i - 1}, *a{i - 1}]' for i in range(1, 40))]) + '\nmode: *a39\n'
PGM = b'P5\n2 2\n255\n' + bytes(4)


def refusal(folder):
    began = time.process_time()
    with pytest.raises(WorldError) as caught:
        read_map_server(folder / 'map.yaml')
    assert time.process_time() - began < 2.0
    assert len(str(caught.value)) < 400
    return str(caught.value)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'map.yaml').write_text(YAML)
    (tmp_path / 'map.pgm').write_bytes(PGM)
    assert read_map_server(tmp_path / 'map.yaml').occupancy.shape == (2, 2)
    return tmp_path


@pytest.mark.parametrize('more', [
    BOMB, 'a: &a {mode: x}\nb: {<<: *a}\n', 'mode: &m trinary\nother: *m\n', '<<: {mode: raw}\n'])
def test_yaml_that_stands_for_more_than_it_says(folder, more):
    (folder / 'map.yaml').write_text(YAML + more)
    assert 'map.yaml' in refusal(folder)


@pytest.mark.parametrize('name', ['map.yaml', 'map.pgm'])
@pytest.mark.parametrize('kind', ['pipe', 'endless', 'sparse'])
def test_what_is_no_map_file(folder, name, kind):
    path = folder / name
    path.unlink()
    if kind == 'pipe':
        os.mkfifo(path)
    elif kind == 'endless':
        path.symlink_to('/dev/zero')
    else:
        with path.open('wb') as file:
            file.truncate(2**33)
    assert name in refusal(folder)


@pytest.mark.parametrize('content', [
    b'P5\n#' + b'x' * 10**8 + b'\n2 2\n255\n' + bytes(4),
    b'P2\n2 2\n#' + b'x' * 10**8 + b'\n255\n0 0 0 0\n',
    b'P2\n2 2\n255\n0 0 #' + b'x' * 10**8 + b'\n0 0\n',
    b'P3\n2 2\n255\n' + b'#xxxxxxxx\n' * 10**7 + b'0 ' * 12,
    b'P5\n' + b'#\n' * 5 * 10**7 + b'2 2\n255\n' + bytes(4)], ids=range(5))
def test_comments_of_hundreds_of_megabytes(folder, content):
    (folder / 'map.pgm').write_bytes(content)
    assert 'take the comments out' in refusal(folder)


@pytest.mark.parametrize('content', [
    b'P5\n#' + b'x' * 60_000 + b'\n2 2\n255\n' + bytes(4),
    b'P5 #a\n2 #b\n 2 #c\n255\n' + bytes(4), b'P2 2 2 255 #d\n  0   0 #e\n   0   0 \n'])
def test_comments_that_people_write_stay(folder, content):
    (folder / 'map.pgm').write_bytes(content)
    assert read_map_server(folder / 'map.yaml').occupancy.shape == (2, 2)
