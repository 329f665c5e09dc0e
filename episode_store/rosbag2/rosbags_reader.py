"""Bags from other recorders that are not MCAP as we write it: sqlite3, compressed, cut."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
import json
import mmap
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any, Final, IO
import weakref

from rosbags.rosbag2 import Reader
from rosbags.rosbag2.storage_mcap import decompress

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.mcap_scan import (
    CHANNEL_OP, CHUNK_OP, Cursor, cut_chunk, MAGIC, McapIndex, MESSAGE_OP, RECORD, Scan, scan,
    SCHEMA_OP, START, U4, U8)
from episode_store.rosbag2.metadata import NAME
from episode_store.rosbag2.reader import Bag, BagReader, MOST_IN_MEMORY, RawMessages
from episode_store.rosbag2.sqlite_recovery import recovered
from episode_store.rosbag2.unpacking import check_packed, MOST_OF_A_CHUNK, Room, unpack_all
from msgs_bridge.untrusted.files import open_regular

#: What of a file is copied; all else says where things lie in it, or is none of the bag's.
_COPIED: Final = (SCHEMA_OP, CHANNEL_OP, MESSAGE_OP)


class ExternalBag:
    """
    Read a bag that `BagReader` cannot, through `rosbags`.

    Parameters
    ----------
    path : Path
        A file in ``.mcap`` or ``.db3``, also with ``.zstd`` behind it.

    Raises
    ------
    BagError
        If it cannot be read.

    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        check_packed(self.path)
        copy = recovered(self.path) if self.path.suffix == '.db3' else None
        if copy:
            weakref.finalize(self, shutil.rmtree, copy.path.parent, ignore_errors=True)
        self._where = copy.path if copy else self.path
        #: What there is to say of how it was found.
        self.notes = (copy.note,) if copy else ()
        # rosbags raises what it runs into, of many types, on a bag that is damaged.
        try:
            with _opened(self._where) as reader:
                self._topics = {item.topic: item.msgtype for item in reader.connections}
                self._counts = dict.fromkeys(self._topics, 0)
                for item in reader.connections:
                    self._counts[item.topic] += item.msgcount
        except Exception as error:
            raise self._error(error) from None

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return self._topics

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages of every topic."""
        return self._counts

    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic; none if it is not in the bag.

        Raises
        ------
        BagError
            If it cannot be read.

        """
        found: list[bytes] = []
        times: list[int] = []
        try:
            with _opened(self._where) as reader:
                wanted = [item for item in reader.connections if item.topic == topic]
                # No connection at all would mean every one.
                room = Room(MOST_IN_MEMORY)
                for _, time, message in reader.messages(wanted) if wanted else ():
                    room.take(len(message))
                    found.append(bytes(message))
                    times.append(time)
        except Exception as error:
            raise self._error(error) from None
        return RawMessages.of(topic, self._topics.get(topic, ''), found, times)

    def _error(self, error: Exception) -> BagError:
        text = ' '.join(str(error).split()) or type(error).__name__
        if isinstance(error, MemoryError):
            text = 'it claims sizes that no memory holds'
        if 'File end magic' in text:
            text = 'it is cut off or was not closed, `mcap recover` mends that'
        return BagError(f'cannot read {self.path}: {text}')


class UnpackedMessages:
    """
    A bag whose messages are compressed one by one, which only ``metadata.yaml`` tells.

    Parameters
    ----------
    packed : Bag

    """

    def __init__(self, packed: Bag) -> None:
        self.packed, self.path = packed, packed.path
        self.notes = getattr(packed, 'notes', ())

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return self.packed.topics

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages of every topic."""
        return self.packed.counts

    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic; none if it is not in the bag.

        Raises
        ------
        BagError
            If one cannot be unpacked.

        """
        found = self.packed.messages(topic)
        try:
            unpacked = unpack_all(found)
        # What decompressors raise is of many types.
        except Exception as error:
            raise BagError(f'cannot read {self.path}: a message of {topic} cannot be unpacked: '
                           f'{error}') from None
        return RawMessages.of(topic, found.type_name, unpacked, found.log_times.tolist())


class CutBag(BagReader):
    """
    Read an MCAP file with compressed chunks that was cut or not closed.

    What can be read are the chunks that are whole, unpacked into a file without a name.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    BagError
        If it cannot be read, or there is no room to unpack it.

    """

    def _read(self, data: memoryview, verify: bool) -> tuple[memoryview, McapIndex]:
        try:
            with TemporaryFile() as file:
                walk = _Unpacking(data, file)
                walk.run()
                file.flush()
                # What is mapped outlives the file.
                unpacked = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        except OSError as error:
            why = (error.strerror or str(error)).lower()
            raise BagError(f'it cannot be unpacked: {why}') from None
        there = walk.index()
        return unpacked, replace(
            scan(unpacked), damage=there.damage, n_lost=there.n_lost, complete=there.complete)


def check_sizes(path: Path) -> None:
    """
    Refuse an MCAP file with a chunk that becomes too large when it is unpacked.

    Raises
    ------
    BagError
        If there is one: a few bytes may claim to be, and become, all that memory holds.

    """
    with open_regular(path) as file, mmap.mmap(
            file.fileno(), 0, access=mmap.ACCESS_READ) as mapped, memoryview(mapped) as data:
        try:
            _Sizes(data).run()
        except BagError as error:
            raise BagError(f'cannot read {path}: {error}') from None


class _Sizes(Scan):
    """Walks over the chunks of a file without looking into them."""

    def _record(self, opcode: int, start: int, length: int) -> None:
        pass

    def _chunk(self, start: int, chunk_end: int, end: int) -> None:
        size = Cursor(self.data, start + RECORD + 16, min(chunk_end, end)).number(U8)
        if size > MOST_OF_A_CHUNK:
            raise BagError(f'the chunk at byte {start} has {size} bytes unpacked, must be at most '
                           f'{MOST_OF_A_CHUNK}')
        self.at = chunk_end


class _Unpacking(Scan):
    """Walks over a file and copies what is whole, chunks without their compression."""

    def __init__(self, data: memoryview, file: IO[bytes]) -> None:
        super().__init__(data)
        self._file = file
        self._room = Room()
        file.write(MAGIC)

    def _record(self, opcode: int, start: int, length: int) -> None:
        if opcode in _COPIED:
            self._file.write(self.data[start:start + RECORD + length])

    def _chunk(self, start: int, chunk_end: int, end: int) -> None:
        if chunk_end > end:
            raise cut_chunk(start, chunk_end, end)
        cursor = Cursor(self.data, start + RECORD, chunk_end)
        head = cursor.raw(28)
        compression, packed = cursor.text(), cursor.raw(cursor.number(U8))
        size, crc = U8.unpack_from(head, 16)[0], U4.unpack_from(head, 24)[0]
        self.at = chunk_end
        # rosbags raises what its decompressors do, of many types, on bytes that are damaged.
        try:
            records = decompress(packed, compression, size, crc)
        except Exception:
            self.found.n_lost += chunk_end - start
            self.found.damage = (self.found.damage
                                 or f'the chunk at byte {start} cannot be unpacked')
            return
        self._room.take(size)
        self._file.write(b''.join((
            START.pack(CHUNK_OP, 40 + size), head, U4.pack(0), U8.pack(size), records)))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open what has connections and messages: a bag, or a file that may be compressed as one."""
    if path.suffix != '.zstd':
        with _plainly_named(path) as plain, Reader(plain) as reader:
            yield reader
        return
    # rosbags unpacks a file if a metadata.yaml says so; without one its topics are not asked for.
    nothing = {'nanoseconds': 0, 'nanoseconds_since_epoch': 0}
    about = {
        'version': 9, 'relative_file_paths': [path.name], 'compression_format': 'zstd',
        'compression_mode': 'file', 'topics_with_message_count': [], 'message_count': 0,
        'storage_identifier': 'mcap' if path.stem.endswith('.mcap') else 'sqlite3',
        'duration': nothing, 'starting_time': nothing}
    with TemporaryDirectory() as folder:
        (Path(folder) / path.name).symlink_to(path.resolve())
        (Path(folder) / NAME).write_text(json.dumps({'rosbag2_bagfile_information': about}))
        with Reader(folder) as reader:
            storage: Any = reader.storage
            yield storage.storages[0]


@contextmanager
def _plainly_named(path: Path) -> Iterator[Path]:
    """Give a file a name without what SQLite takes for the end of it, such as ``run #3``."""
    if path.suffix != '.db3' or not set('?#%') & set(str(path)):
        yield path
        return
    with TemporaryDirectory() as folder:
        plain = Path(folder) / 'bag.db3'
        plain.symlink_to(path.resolve())
        yield plain
