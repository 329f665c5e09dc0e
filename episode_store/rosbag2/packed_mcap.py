"""Read MCAP files with compressed chunks, whole or cut; one chunk at a time is unpacked."""

from collections import Counter
from collections.abc import Collection
from itertools import chain
from pathlib import Path
import struct
from typing import Final
import zlib

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.mcap_scan import Chunk, McapContents, MESSAGE, RECORD, Scan
from episode_store.rosbag2.reader import (
    Bag, mapped, MOST_IN_MEMORY, RawMessages, topics_and_counts)
from episode_store.rosbag2.unpacking import MOST_OF_A_CHUNK, Room, room_for_chunks, unpack

#: Of a message: its length, and when it was received.
_HEAD: Final = struct.Struct('<xQ6xQ')
#: Of a chunk: when its first and last message were received.
_TIMES: Final = struct.Struct('<QQ')


class PackedMcap(Bag):
    """
    Read one MCAP file with compressed chunks; those that cannot be unpacked are left out.

    Parameters
    ----------
    path : Path
        The file; it may be a link, as for paths a person typed.
    where : Path, optional
        A copy of it that is read in its place.

    Raises
    ------
    BagError
        If it cannot be read, or becomes too much.

    """

    def __init__(self, path: Path, where: Path | None = None) -> None:
        self.path = path
        self._data = mapped(where or path, None)
        walk = self._walk()
        self._channels = walk.found.channels
        self.damage, self.complete = walk.found.damage, walk.found.complete
        self.topics, self.counts = topics_and_counts(self._channels, walk.counts)
        self.recorded = walk.recorded

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the file."""
        numbers = [n for n, channel in self._channels.items() if channel.topic == topic]
        walk = self._walk(numbers) if numbers else PackedScan(self._data)
        return RawMessages.of(topic, self.topics.get(topic, ''), walk.messages, walk.times)

    def _walk(self, wanted: Collection[int] = ()) -> 'PackedScan':
        walk = PackedScan(self._data, wanted)
        try:
            walk.run()
        except BagError as error:
            raise BagError(f'cannot read {self.path}: {error}') from None
        return walk


class PackedScan(Scan):
    """
    Reads a file, unpacks its chunks, and keeps the messages of some channels.

    Parameters
    ----------
    data : memoryview of bytes
        The file.
    wanted : collection of int
        The channels.

    """

    def __init__(self, data: memoryview, wanted: Collection[int] = ()) -> None:
        super().__init__(data)
        self._wanted = frozenset(wanted)
        self._unpacked = room_for_chunks(len(data))
        self._kept = Room(MOST_IN_MEMORY)
        self.counts: Counter[int] = Counter()
        self.messages: list[bytes] = []
        self.times: list[int] = []
        self.recorded: tuple[int, int] | None = None

    def run(self) -> McapContents:
        """Read up to the last readable record."""
        found = super().run()
        self._take_over()
        return found

    def _packed(self, start: int, chunk: Chunk) -> None:
        """Unpack a chunk and go through its records."""
        if chunk.compression not in ('zstd', 'lz4'):
            raise BagError(f'its chunks are compressed with {chunk.compression!r}, must be zstd '
                           f'or lz4')
        if chunk.size > MOST_OF_A_CHUNK:
            raise BagError(f'the chunk at byte {start} has {chunk.size} bytes unpacked, must be '
                           f'at most {MOST_OF_A_CHUNK}')
        packed = bytes(self.data[chunk.at:chunk.end])
        # What decompressors raise is of many types.
        try:
            records = unpack(packed, chunk.size, chunk.compression)
        except Exception:
            self.lose(start, chunk, 'cannot be unpacked')
            return
        self._unpacked.take(len(records))
        if chunk.crc and zlib.crc32(records) != chunk.crc:
            self.lose(start, chunk, 'does not match its checksum')
            return
        self._note_times(start)
        self._take_over()
        file, self.data, self.at = self.data, memoryview(records), 0
        try:
            self._records(len(records), top=False)
        finally:
            self._take_over()
            self.data, self.at = file, start

    def _note_times(self, start: int) -> None:
        """Note from when to when a chunk is; one without a message says 0."""
        first, last = _TIMES.unpack_from(self.data, start + RECORD)
        if last:
            before = self.recorded or (first, last)
            self.recorded = min(first, before[0]), max(last, before[1])

    def _take_over(self) -> None:
        """Count the messages that were found in the bytes at hand, and copy the wanted ones."""
        self.counts.update({number: len(starts) for number, starts in self.starts.items()})
        for start in sorted(chain.from_iterable(
                starts for number, starts in self.starts.items() if number in self._wanted)):
            length, time = _HEAD.unpack_from(self.data, start)
            self._kept.take(length)
            self.messages.append(bytes(self.data[start + MESSAGE:start + RECORD + length]))
            self.times.append(min(time, 2**63 - 1))
        self.starts.clear()
