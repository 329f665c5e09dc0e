"""Bags of others in whatever shape they are left."""

import re
import shutil
import struct

from mcap.writer import CompressionType, Writer
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bridge_helpers import demonstration_bag, GRID
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.mcap_scan import CHUNK_OP, DATA_END_OP, MAGIC, RECORD, START
from episode_store.rosbag2.writer import McapFile
from external_bags import EXTERNAL, external_bag, external_demonstration


@pytest.mark.parametrize('storage', list(StoragePlugin), ids=str)
@pytest.mark.parametrize('compression', [None, CompressionMode.STORAGE], ids=str)
@pytest.mark.parametrize('metadata', [None, ': : [', '', '- 1'])
def test_metadata_may_be_missing_or_broken(tmp_path, storage, compression, metadata):
    if compression is not None and storage is StoragePlugin.SQLITE3:
        pytest.skip('sqlite3 has no chunks')
    path = external_bag(tmp_path / 'bag', storage, compression)
    whole = external_demonstration(path, GRID, EXTERNAL)[0]
    (path / 'metadata.yaml').unlink()
    if metadata is not None:
        (path / 'metadata.yaml').write_text(metadata)
    again = external_demonstration(path, GRID, EXTERNAL)[0]
    np.testing.assert_array_equal(again.cells, whole.cells)
    np.testing.assert_array_equal(again.stamps, whole.stamps)


def test_files_without_metadata_are_read_in_the_order_of_their_numbers(tmp_path):
    folder = demonstration_bag(tmp_path / 'ours')
    split = tmp_path / 'split'
    split.mkdir()
    for number in (10, 9):
        shutil.copyfile(mcap_path(folder), split / f'split_{number}.mcap')
    shutil.copyfile(next(external_bag(tmp_path / 'bag', StoragePlugin.SQLITE3).glob('*.db3')),
                    split / 'split_11.db3')
    bag, once = open_bag(split), open_bag(folder)
    assert bag.topics == {**once.topics, EXTERNAL['odom']: 'nav_msgs/msg/Odometry'}
    found, part = bag.messages('/odom'), once.messages('/odom')
    assert list(found) == 2 * list(part)
    assert found.type_name == part.type_name
    np.testing.assert_array_equal(found.log_times, np.tile(part.log_times, 2))
    assert len(bag.messages(EXTERNAL['odom'])) == 200
    assert len(bag.messages('/nothing')) == 0


def test_the_order_in_the_file_does_not_matter(tmp_path):
    bag = open_bag(demonstration_bag(tmp_path))
    file = McapFile(tmp_path / 'shuffled.mcap', None)
    for topic, kind in bag.topics.items():
        file.add_channel(topic, kind, b'', {})
    records = list(bag.records())
    for place in np.random.default_rng(1).permutation(len(records)).tolist():
        channel, log_time, publish_time, message = records[place]
        file.add(channel.topic, message, log_time, publish_time)
    file.finish('shuffled.mcap')
    cells = [external_demonstration(path, GRID)[0].cells
             for path in (bag.path, tmp_path / 'shuffled.mcap')]
    np.testing.assert_array_equal(*cells)


def test_of_a_file_that_is_cut_it_is_said_that_something_is_missing(tmp_path):
    folder = demonstration_bag(tmp_path)
    (folder / 'metadata.yaml').unlink()
    assert external_demonstration(folder, GRID)[2] == ()
    bag = mcap_path(folder)
    bag.write_bytes(bag.read_bytes()[:bag.stat().st_size // 2])
    [note] = external_demonstration(folder, GRID)[2]
    assert note.startswith('what is not readable of 0001_demo_0.mcap is missing: the chunk at')
    shutil.copyfile(bag, folder / '0001_demo_1.mcap')
    assert note in external_demonstration(folder, GRID)[2]


def packed_file(path, compression):
    """Write a drive into one file of many compressed chunks, as other recorders do."""
    bag = open_bag(demonstration_bag(path.parent / 'ours'))
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=8192, compression=compression)
        writer.start('ros2', '')
        channels = {}
        for topic, kind in bag.topics.items():
            channels[topic] = writer.register_channel(
                topic, 'cdr', writer.register_schema(kind, 'ros2msg', b''))
        for channel, log_time, publish_time, message in bag.records():
            writer.add_message(channels[channel.topic], log_time, message, publish_time)
        writer.finish()
    return path


def chunks(data):
    """Return where the chunks of a file begin and end."""
    at, found = len(MAGIC), []
    while data[at] != DATA_END_OP:
        opcode, length = START.unpack_from(data, at)
        if opcode == CHUNK_OP:
            found.append((at, at + RECORD + length))
        at += RECORD + length
    return found


PACKINGS = pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])


@PACKINGS
def test_of_a_compressed_file_that_is_cut_its_whole_chunks_are_read(tmp_path, compression):
    path = packed_file(tmp_path / 'bag.mcap', compression)
    data, whole = path.read_bytes(), open_bag(path).messages('/odom')
    places = chunks(data)
    assert len(places) > 5
    start, end = places[4]
    for n_bytes in (start, start + 20, end - 1):
        path.write_bytes(data[:n_bytes])
        bag = open_bag(path)
        found = bag.messages('/odom')
        assert 20 < len(found) < len(whole)
        assert list(found) == list(whole)[:len(found)]
        np.testing.assert_array_equal(found.log_times, whole.log_times[:len(found)])
        record, _, [note] = external_demonstration(path, GRID)
        assert len(record.cells) > 1
        assert note.startswith('what is not readable of bag.mcap is missing: ')
        there = f'the chunk at byte {start} is cut, {n_bytes - start} of {end - start} bytes'
        assert n_bytes == start or there in note


@PACKINGS
@pytest.mark.parametrize('n_missing', [0, 30])
def test_a_chunk_that_would_fill_the_memory_is_not_unpacked(tmp_path, compression, n_missing):
    path = packed_file(tmp_path / 'bag.mcap', compression)
    data = bytearray(path.read_bytes())
    start, _ = chunks(data)[2]
    struct.pack_into('<Q', data, start + RECORD + 16, 2**28 + 1)
    path.write_bytes(data[:len(data) - n_missing])
    with pytest.raises(BagError, match=f'chunk at byte {start} has 268435457 bytes unpacked'):
        open_bag(path)


def test_a_compression_that_is_not_known_is_named(tmp_path):
    path = packed_file(tmp_path / 'bag.mcap', CompressionType.ZSTD)
    path.write_bytes(path.read_bytes().replace(b'\4\0\0\0zstd', b'\4\0\0\0zst9'))
    with pytest.raises(BagError, match=r"bag.mcap: its chunks are compressed with 'zst9'"):
        open_bag(path)


@PACKINGS
@pytest.mark.parametrize('n', [1, 8, 40])
def test_a_compressed_file_that_lost_no_more_than_its_end_lacks_nothing(tmp_path, compression, n):
    path = packed_file(tmp_path / 'bag.mcap', compression)
    record, _, notes = external_demonstration(path, GRID)
    path.write_bytes(path.read_bytes()[:-n])
    again, _, again_notes = external_demonstration(path, GRID)
    np.testing.assert_array_equal(again.cells, record.cells)
    assert notes == again_notes == ()


def test_a_chunk_that_cannot_be_unpacked_is_left_out_of_a_cut_file(tmp_path):
    path = packed_file(tmp_path / 'bag.mcap', CompressionType.ZSTD)
    data = bytearray(path.read_bytes()[:-1])
    whole = len(open_bag(path).messages('/odom'))
    start, end = chunks(data)[2]
    data[start + 80:end] = bytes(end - start - 80)
    path.write_bytes(data)
    assert 0 < len(open_bag(path).messages('/odom')) < whole
    [note] = external_demonstration(path, GRID)[2]
    assert note.endswith(f'the chunk at byte {start} cannot be unpacked')


def test_a_split_compressed_bag_is_read_up_to_its_cut_with_its_metadata_too(tmp_path):
    folder = external_bag(tmp_path / 'bag', StoragePlugin.MCAP, CompressionMode.STORAGE)
    packed_file(folder / 'z_1.mcap', CompressionType.ZSTD)
    whole = len(open_bag(folder / 'z_1.mcap').messages('/odom'))
    shutil.rmtree(folder / 'ours')
    data = (folder / 'z_1.mcap').read_bytes()
    (folder / 'z_1.mcap').write_bytes(data[:len(data) // 2])
    metadata = (folder / 'metadata.yaml').read_text()
    (folder / 'metadata.yaml').write_text(re.sub(
        r'relative_file_paths:(\s+- )\S+', r'\g<0>\1z_1.mcap', metadata))
    bag = open_bag(folder)
    assert len(bag.messages(EXTERNAL['odom'])) == 200
    assert 0 < len(bag.messages('/odom')) < whole
    assert bag.missing.startswith('what is not readable of z_1.mcap is missing: ')


def test_where_there_is_no_room_to_unpack_a_file_that_is_said(tmp_path, monkeypatch):
    path = next(external_bag(
        tmp_path / 'bag', StoragePlugin.MCAP, CompressionMode.FILE).glob('*.zstd'))
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path / 'gone'))
    with pytest.raises(BagError, match=r'there is no room to copy a bag: No such'):
        open_bag(path)


def test_messages_compressed_one_by_one_are_read_up_to_a_cut(tmp_path):
    path = next(external_bag(
        tmp_path / 'bag', StoragePlugin.MCAP, CompressionMode.MESSAGE).glob('*.mcap'))
    data, whole = path.read_bytes(), list(open_bag(path).messages(EXTERNAL['odom']))
    assert len(whole) == 200
    path.write_bytes(data[:len(data) // 2])
    for name in (path, path.parent):
        found = open_bag(name)
        there = list(found.messages(EXTERNAL['odom']))
        assert 0 < len(there) < 200
        assert there == whole[:len(there)]
        assert found.missing.startswith(f'what is not readable of {path.name} is missing: ')


@pytest.mark.parametrize('storage', list(StoragePlugin), ids=str)
def test_messages_compressed_one_by_one_say_that_metadata_is_needed(tmp_path, storage):
    path = external_bag(tmp_path / 'bag', storage, CompressionMode.MESSAGE)
    assert external_demonstration(path, GRID, EXTERNAL)[2] == ()
    (path / 'metadata.yaml').unlink()
    with pytest.raises(BagError, match=r'compressed one by one \(zstd\).* put the metadata.yaml'):
        external_demonstration(path, GRID, EXTERNAL)


@pytest.mark.parametrize('n_bytes', [0, 4, 8, 20, 30, 60])
def test_a_file_that_ends_before_its_first_topic_says_so(tmp_path, n_bytes):
    path = next(external_bag(tmp_path / 'bag', StoragePlugin.MCAP).glob('*.mcap'))
    path.write_bytes(path.read_bytes()[:n_bytes])
    words = 'it is cut off before its first topic: ' if n_bytes else 'it is empty$'
    for name in (path, path.parent):
        with pytest.raises(BagError, match=f'cannot read {path}: {words}'):
            open_bag(name)


def test_an_empty_last_file_does_not_take_the_others_away(tmp_path):
    folder = external_bag(tmp_path / 'bag', StoragePlugin.MCAP)
    (folder / 'metadata.yaml').unlink()
    (folder / 'z_1.mcap').touch()
    assert external_demonstration(folder, GRID, EXTERNAL)[2] == (
        'what is not readable of z_1.mcap is missing: it is empty',)


def test_where_no_pose_is_left_what_is_missing_is_said_too(tmp_path):
    folder = demonstration_bag(tmp_path)
    (folder / 'metadata.yaml').unlink()
    bag = mcap_path(folder)
    first = int(open_bag(folder).messages('/odom').starts[0])
    bag.write_bytes(bag.read_bytes()[:first])
    with pytest.raises(BagError, match=r'no topic is odom, .*; what is not readable of .* is'):
        external_demonstration(folder, GRID)
