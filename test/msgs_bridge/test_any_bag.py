"""Bags of others in whatever shape they are left."""

import shutil

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bridge_helpers import demonstration_bag, GRID
from foreign_bags import FOREIGN, foreign_bag
from msgs_bridge.any_bag import open_bag
from msgs_bridge.bag_file import McapFile
from msgs_bridge.bag_folder import BagError, mcap_path
from msgs_bridge.episodes import read_foreign_demonstration


@pytest.mark.parametrize('storage', list(StoragePlugin), ids=str)
@pytest.mark.parametrize('compression', [None, CompressionMode.STORAGE], ids=str)
@pytest.mark.parametrize('metadata', [None, ': : [', '', '- 1'])
def test_metadata_may_be_missing_or_broken(tmp_path, storage, compression, metadata):
    if compression is not None and storage is StoragePlugin.SQLITE3:
        pytest.skip('sqlite3 has no chunks')
    path = foreign_bag(tmp_path / 'bag', storage, compression)
    whole = read_foreign_demonstration(path, GRID, FOREIGN)[0]
    (path / 'metadata.yaml').unlink()
    if metadata is not None:
        (path / 'metadata.yaml').write_text(metadata)
    again = read_foreign_demonstration(path, GRID, FOREIGN)[0]
    np.testing.assert_array_equal(again.cells, whole.cells)
    np.testing.assert_array_equal(again.stamps, whole.stamps)


def test_files_without_metadata_are_read_in_the_order_of_their_numbers(tmp_path):
    folder = demonstration_bag(tmp_path / 'ours')
    split = tmp_path / 'split'
    split.mkdir()
    for number in (10, 9):
        shutil.copyfile(mcap_path(folder), split / f'split_{number}.mcap')
    shutil.copyfile(next(foreign_bag(tmp_path / 'bag', StoragePlugin.SQLITE3).glob('*.db3')),
                    split / 'split_11.db3')
    bag, once = open_bag(split), open_bag(folder)
    assert bag.topics == {**once.topics, FOREIGN['odom']: 'nav_msgs/msg/Odometry'}
    found, part = bag.messages('/odom'), once.messages('/odom')
    assert list(found) == 2 * list(part)
    assert found.type_name == part.type_name
    np.testing.assert_array_equal(found.log_times, np.tile(part.log_times, 2))
    assert len(bag.messages(FOREIGN['odom'])) == 200
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
    cells = [read_foreign_demonstration(path, GRID)[0].cells
             for path in (bag.path, tmp_path / 'shuffled.mcap')]
    np.testing.assert_array_equal(*cells)


def test_of_a_file_that_is_cut_it_is_said_that_something_is_missing(tmp_path):
    folder = demonstration_bag(tmp_path)
    (folder / 'metadata.yaml').unlink()
    assert read_foreign_demonstration(folder, GRID)[2] == ()
    bag = mcap_path(folder)
    bag.write_bytes(bag.read_bytes()[:bag.stat().st_size // 2])
    [note] = read_foreign_demonstration(folder, GRID)[2]
    assert note.startswith('what is not readable of 0001_demo_0.mcap is missing: the chunk at')
    shutil.copyfile(bag, folder / '0001_demo_1.mcap')
    assert note in read_foreign_demonstration(folder, GRID)[2]


def test_a_compressed_file_that_was_not_closed_says_what_mends_it(tmp_path):
    path = next(foreign_bag(
        tmp_path / 'bag', StoragePlugin.MCAP, CompressionMode.STORAGE).glob('*.mcap'))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(BagError, match='cut off or was not closed, `mcap recover` mends that'):
        open_bag(path)
