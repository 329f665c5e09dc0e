"""What lies beside a bag and belongs to it: read, or said, or refused."""

from contextlib import closing
import os
import re
import shutil
import sqlite3

import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bridge_helpers import GRID
from episode_store.rosbag2.any_reader import notes_on, open_bag
from episode_store.rosbag2.errors import BagError
from external_bags import EXTERNAL, external_bag, external_demonstration, ros1_bag

ODOM = EXTERNAL['odom']


def sqlite_bag(tmp_path):
    folder = external_bag(tmp_path / 'bag', StoragePlugin.SQLITE3)
    return folder, next(folder.glob('*.db3'))


def killed(tmp_path, mode, n_kept=301):
    """
    Return the folder of a recording that was killed: what its last messages are lies beside it.

    Parameters
    ----------
    mode : str
        Of SQLite's journal: ``WAL`` or ``DELETE``.
    n_kept : int
        Messages in the file itself, of 400.

    """
    _, file = sqlite_bag(tmp_path / 'whole')
    folder = tmp_path / 'killed'
    folder.mkdir()
    copy = folder / 'run.db3'
    with closing(sqlite3.connect(file, isolation_level=None)) as base:
        rows = base.execute('SELECT * FROM messages ORDER BY id').fetchall()
        base.execute('DELETE FROM messages WHERE id > ?', (n_kept,))
        base.execute('VACUUM')
    live = tmp_path / 'live.db3'
    shutil.copyfile(file, live)
    with closing(sqlite3.connect(live, isolation_level=None)) as writer:
        writer.execute(f'PRAGMA journal_mode={mode}')
        writer.execute('PRAGMA wal_autocheckpoint=0')
        writer.execute('PRAGMA cache_size=1')  # the file itself is written before the end
        writer.execute('BEGIN')
        writer.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows[n_kept:])
        if mode == 'WAL':
            writer.execute('COMMIT')
        for path in tmp_path.glob('live.db3*'):
            shutil.copyfile(path, folder / path.name.replace('live', 'run'))
    assert copy.exists()
    return folder


class TestSqlite:
    def test_the_newest_messages_are_read_from_the_log(self, tmp_path):
        folder = killed(tmp_path, 'WAL')
        whole = external_demonstration(
            next((tmp_path / 'whole').rglob('*.db3')).parent, GRID, EXTERNAL)[0]
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        for name in (folder, folder / 'run.db3'):
            bag = open_bag(name)
            [note] = notes_on(bag)
            assert note == ('run.db3 was not closed by its recorder: 99 of 400 messages are read '
                            'from run.db3-wal')
            assert len(bag.messages(ODOM)) == bag.counts[ODOM] == 200
            record, _, notes = external_demonstration(name, GRID, EXTERNAL)
            assert notes == notes_on(bag)
            assert record.stamps[-1] > whole.stamps[-1] - 1.0
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before

    def test_what_was_half_written_is_taken_back(self, tmp_path):
        folder = killed(tmp_path, 'DELETE')
        assert (folder / 'run.db3-journal').stat().st_size
        [note] = notes_on(open_bag(folder))
        assert note.startswith('run.db3 was not closed by its recorder: ')
        assert sum(open_bag(folder).counts.values()) == 301

    def test_a_log_that_holds_nothing_more(self, tmp_path):
        folder = killed(tmp_path, 'WAL')
        (folder / 'run.db3-wal').write_bytes(b'nothing of a log')
        [note] = notes_on(open_bag(folder))
        assert note == ('run.db3 was not closed by its recorder: run.db3-wal beside it adds no '
                        'message; run.db3-wal is damaged or cut off: what else it held cannot be '
                        'read')
        (folder / 'run.db3-wal').write_bytes(b'')
        assert notes_on(open_bag(folder)) == ()

    @pytest.mark.parametrize('share', [0.3, 0.9])
    def test_a_log_that_was_cut_is_called_so(self, tmp_path, share):
        log = killed(tmp_path, 'WAL') / 'run.db3-wal'
        data = log.read_bytes()
        log.write_bytes(data[:int(share * len(data)) // 2 * 2 + 1])
        [note] = notes_on(open_bag(log.parent))
        assert note.endswith('run.db3-wal is damaged or cut off: what else it held cannot be read')

    def test_a_log_without_its_file_is_refused(self, tmp_path):
        folder = killed(tmp_path, 'WAL')
        (folder / 'run.db3').rename(folder / 'other.db3')
        with pytest.raises(BagError, match=r'run.db3-wal holds messages of run.db3, which is not'):
            open_bag(folder)

    def test_a_log_that_is_no_file_is_refused(self, tmp_path):
        folder = killed(tmp_path, 'WAL')
        (folder / 'run.db3-journal').symlink_to('/dev/zero')
        open_bag(folder)  # of no size, as SQLite sees it
        (folder / 'run.db3-wal').unlink()
        os.mkfifo(folder / 'run.db3-wal')
        open_bag(folder)

    def test_a_journal_that_names_another_file_is_refused(self, tmp_path):
        folder = killed(tmp_path, 'DELETE')
        with (folder / 'run.db3-journal').open('ab') as file:
            file.write(b'/home/a\0\0\0\x07\0\0\2\0' + b'\xd9\xd5\x05\xf9\x20\xa1\x63\xd7')
        with pytest.raises(BagError, match=r'run\.db3-journal names another'):
            open_bag(folder)

    @pytest.mark.parametrize('name', ['run #3.db3', 'run?mode=memory.db3', 'run%20.db3'])
    def test_names_that_are_addresses_to_sqlite(self, tmp_path, name):
        _, file = sqlite_bag(tmp_path)
        odd = tmp_path / name
        shutil.copyfile(file, odd)
        assert len(open_bag(odd).messages(ODOM)) == 200


class TestDescription:
    def test_a_file_that_was_renamed_is_read_and_that_is_said(self, tmp_path):
        for storage, ending in ((StoragePlugin.SQLITE3, 'db3'), (StoragePlugin.MCAP, 'mcap')):
            folder = external_bag(tmp_path / ending, storage)
            file = next(folder.glob(f'*.{ending}'))
            file.rename(folder / f'my_bag.{ending}')
            bag = open_bag(folder)
            assert len(bag.messages(ODOM)) == 200
            [note] = notes_on(bag)
            assert note == (f'metadata.yaml names {file.name}, which is not there; '
                            f'my_bag.{ending} is read in its place')

    def split(self, tmp_path, n=3):
        """Return the folder of a bag of several files; the first of them holds all."""
        folder, file = sqlite_bag(tmp_path)
        names = [file.name, *(f'part_{k}.db3' for k in range(1, n))]
        for name in names[1:]:
            shutil.copyfile(file, folder / name)
            with closing(sqlite3.connect(folder / name, isolation_level=None)) as part:
                part.execute('DELETE FROM messages')
        text = (folder / 'metadata.yaml').read_text()
        (folder / 'metadata.yaml').write_text(re.sub(
            r'(relative_file_paths:\n)( *- ).*\n',
            lambda m: m[1] + ''.join(f'{m[2]}{name}\n' for name in names), text))
        return folder, names

    @pytest.mark.parametrize('place', [0, 1, 2])
    def test_where_a_part_is_missing_the_bag_is_refused(self, tmp_path, place):
        folder, names = self.split(tmp_path)
        assert notes_on(open_bag(folder)) == ()
        (folder / names[place]).unlink()
        with pytest.raises(BagError, match=f'names {names[place]}, which is not there, so a part'):
            open_bag(folder)

    def test_one_of_several_files(self, tmp_path):
        folder, names = self.split(tmp_path)
        [note] = notes_on(open_bag(folder / names[0]))
        assert note.startswith(f'{names[0]} is one of 3 files of its bag, the others are not read')

    def test_what_is_not_described_is_not_read_and_named(self, tmp_path):
        folder, names = self.split(tmp_path)
        shutil.copyfile(folder / names[0], folder / 'part_9.db3')
        bag = open_bag(folder)
        assert len(bag.messages(ODOM)) == 200
        assert notes_on(bag) == (
            'part_9.db3 is not named in metadata.yaml and not read: name it by itself',)

    def test_other_files_than_all_that_are_described(self, tmp_path):
        folder, names = self.split(tmp_path)
        for name in names[1:]:
            (folder / name).unlink()
        (folder / names[0]).rename(folder / 'x.db3')
        [note] = notes_on(open_bag(folder))
        assert note.endswith('none of which is there; 1 other file are read in their place')

    @pytest.mark.parametrize(('count', 'said'), [
        (500, 'counts 500 messages, 400 are there: 100 are missing'),
        (300, 'counts 300 messages, 400 are there: more than it should be')])
    @pytest.mark.parametrize('storage', list(StoragePlugin), ids=str)
    def test_a_count_that_does_not_fit(self, tmp_path, storage, count, said):
        folder = external_bag(tmp_path / 'bag', storage)
        text = (folder / 'metadata.yaml').read_text()
        assert notes_on(open_bag(folder)) == ()
        (folder / 'metadata.yaml').write_text(
            text.replace('message_count: 400', f'message_count: {count}'))
        assert notes_on(open_bag(folder)) == (f'metadata.yaml {said}',)

    def test_one_file_alone_is_counted_too(self, tmp_path):
        folder, file = sqlite_bag(tmp_path)
        text = (folder / 'metadata.yaml').read_text()
        (folder / 'metadata.yaml').write_text(
            text.replace('message_count: 400', 'message_count: 500'))
        assert notes_on(open_bag(file)) == (
            'metadata.yaml counts 500 messages, 400 are there: 100 are missing',)

    def test_numbers_that_are_missing_without_a_description_are_named(self, tmp_path):
        folder, file = sqlite_bag(tmp_path)
        (folder / 'metadata.yaml').unlink()
        for number in (1, 2, 4):
            shutil.copyfile(file, folder / f'run_{number}.db3')
        file.unlink()
        [note] = notes_on(open_bag(folder))
        assert note == ('of the files run_1.db3 to run_4.db3 those of number 0, 3 are not there: '
                        'what was in them is missing')
        (folder / 'run_4.db3').rename(folder / 'run_0.db3')
        assert notes_on(open_bag(folder)) == ()

    def test_a_folder_without_any_file_says_what_was_there(self, tmp_path):
        folder, file = sqlite_bag(tmp_path)
        file.unlink()
        with pytest.raises(BagError, match=f'no .mcap, .db3 or .bag file .* names {file.name}'):
            open_bag(folder)


class TestCopies:
    def test_a_file_and_its_compressed_copy_are_one(self, tmp_path):
        folder = external_bag(tmp_path / 'bag', StoragePlugin.MCAP)
        (folder / 'metadata.yaml').unlink()
        file = next(folder.glob('*.mcap'))
        (folder / f'{file.name}.zstd').write_bytes(b'whatever')
        bag = open_bag(folder)
        assert len(bag.messages(ODOM)) == 200
        assert notes_on(bag) == (
            f'{file.name}.zstd is taken for a copy of {file.name} and not read',)

    def test_what_is_described_is_read_of_two_copies(self, tmp_path):
        folder, file = sqlite_bag(tmp_path)
        other = next(external_bag(tmp_path / 'other', StoragePlugin.MCAP).glob('*.mcap'))
        shutil.copyfile(other, folder / file.name.replace('.db3', '.mcap'))
        bag = open_bag(folder)
        assert len(bag.messages(ODOM)) == 200
        [note] = notes_on(bag)
        assert note.startswith('bag.mcap is taken for a copy of bag.db3')

    @pytest.mark.parametrize('name', ['bag.mcap.orig', 'bag.mcap.cut', 'bag.bag.orig', 'x.db3~'])
    def test_what_is_left_over_is_named(self, tmp_path, name):
        folder = external_bag(tmp_path / 'bag', StoragePlugin.MCAP)
        (folder / name).write_bytes(b'whatever')
        assert notes_on(open_bag(folder)) == (f'{name} lies beside it and is not read',)

    def test_of_two_copies_the_one_that_is_whole(self, tmp_path):
        folder = external_bag(tmp_path / 'bag', StoragePlugin.MCAP)
        (folder / 'metadata.yaml').unlink()
        file = next(folder.glob('*.mcap'))
        shutil.copyfile(file, folder / 'bag.orig.mcap')
        file.rename(folder / 'bag.mcap')
        assert notes_on(open_bag(folder)) == (
            'bag.orig.mcap is taken for a copy of bag.mcap and not read',)


def not_closed(path, share):
    """Take the index off a bag of ROS 1, and all behind a share of the rest, as a kill does."""
    data = path.read_bytes()
    place = data.index(b'index_pos=') + len(b'index_pos=')
    index = int.from_bytes(data[place:place + 8], 'little')
    start = 4117 if share else 0
    path.write_bytes(
        data[:place] + bytes(8) + data[place + 8:start + round(share * (index - start))]
        if share else data[:place] + bytes(8) + data[place + 8:4117])
    return path


class TestRos1:
    @pytest.mark.parametrize('compression', [None, *Ros1Writer.CompressionFormat])
    def test_a_drive_is_read(self, tmp_path, compression):
        path = ros1_bag(tmp_path / 'drive.bag', compression=compression)
        bag = open_bag(path)
        assert bag.topics == {'/odom': 'nav_msgs/msg/Odometry'}
        assert bag.counts == {'/odom': 100}
        record, _, notes = external_demonstration(path, GRID)
        assert notes == ()
        assert record.cells[0].tolist() == [2, 2]
        assert record.cells[-1].tolist() == [2, 9]

    @pytest.mark.parametrize('compression', [None, *Ros1Writer.CompressionFormat])
    @pytest.mark.parametrize('name', ['drive.bag', 'drive.bag.active'])
    @pytest.mark.parametrize('share', [1.0, 0.6])
    def test_one_that_was_not_closed_is_read_as_far_as_it_is_whole(
            self, tmp_path, compression, name, share):
        path = not_closed(ros1_bag(
            tmp_path / 'drive.bag', compression=compression, chunk=8192), share)
        path = path.rename(tmp_path / name)
        for each in (path, tmp_path):
            bag = open_bag(each)
            messages = bag.messages('/odom')
            assert len(messages) == bag.counts['/odom']
            assert 0 < len(messages) <= 100
            [note] = notes_on(bag)
            assert note.startswith(f'{name} was not closed by its recorder: {len(messages)} mess')
            assert ('bytes are cut off' in note) == (share < 1.0)
        if share == 1.0:
            assert len(messages) == 100

    def test_a_chunk_that_was_begun_counts(self, tmp_path):
        whole = open_bag(ros1_bag(tmp_path / 'whole.bag')).messages('/odom')
        path = not_closed(ros1_bag(tmp_path / 'drive.bag'), 0.7)
        data = bytearray(path.read_bytes())
        at = data.index(b'op=\x05') + 4
        while data[at - 4:at] != b'op=\x05' or at < 4096:
            at = data.index(b'op=\x05', at) + 4
        header = data.rindex(b'compression=none', 0, at + 40)
        start = max(at, header + len(b'compression=none'), data.index(b'size=', header - 40) + 9)
        data[start:start + 4] = bytes(4)  # as long as a chunk is written its size is 0
        path.write_bytes(data)
        found = open_bag(path).messages('/odom')
        assert 0 < len(found) < 100
        assert list(found) == list(whole)[:len(found)]

    def test_one_that_was_not_even_begun_says_what_mends_it(self, tmp_path):
        path = not_closed(ros1_bag(tmp_path / 'drive.bag'), 0.0)
        path = path.rename(tmp_path / 'drive.bag.active')
        for name in (path, tmp_path):
            with pytest.raises(BagError, match=r'not closed.*`rosbag reindex drive.bag.active`'):
                open_bag(name)

    def test_what_reindexing_has_put_aside_is_not_read_again(self, tmp_path):
        path = ros1_bag(tmp_path / 'drive.bag')
        shutil.copyfile(path, tmp_path / 'drive.orig.bag')
        bag = open_bag(tmp_path)
        assert len(bag.messages('/odom')) == 100
        assert notes_on(bag) == (
            'drive.orig.bag is taken for a copy of drive.bag and not read',)

    @pytest.mark.parametrize('compression', Ros1Writer.CompressionFormat)
    def test_a_chunk_that_would_fill_the_memory_is_not_unpacked(
            self, tmp_path, monkeypatch, compression):
        path = ros1_bag(tmp_path / 'drive.bag', compression=compression)
        monkeypatch.setattr('episode_store.rosbag2.unpacking.MOST_OF_A_CHUNK', 1000)
        with pytest.raises(BagError, match='packed bytes become more than the 1000 they may'):
            open_bag(path).messages('/odom')

    def test_no_bag_at_all(self, tmp_path):
        (tmp_path / 'drive.bag').write_bytes(b'#ROSBAG V2.0\n' + bytes(100))
        with pytest.raises(BagError, match=r'cannot read .*drive.bag: '):
            open_bag(tmp_path / 'drive.bag')


def test_whole_files_that_are_compressed_are_read_with_their_description(tmp_path):
    folder = external_bag(tmp_path / 'bag', StoragePlugin.SQLITE3, CompressionMode.FILE)
    assert [path.suffix for path in folder.iterdir() if path.suffix != '.yaml'] == ['.zstd']
    bag = open_bag(folder)
    assert len(bag.messages(ODOM)) == 200
    assert notes_on(bag) == ()
