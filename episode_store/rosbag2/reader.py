"""Bags and their raw messages, and the reader of uncompressed MCAP files, which copies nothing."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import mmap
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.mcap_scan import Channel, MESSAGE, RECORD, scan
from msgs_bridge.untrusted.files import open_regular

#: Most that the messages of a topic may take in memory once unpacked, [bytes].
MOST_IN_MEMORY: Final = 2**30
_NOTHING: Final = np.zeros(0, dtype=np.int64)
_HEAD: Final[np.dtype[np.void]] = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8')])


@dataclass(frozen=True, eq=False)
class RawMessages:
    """
    Messages of one topic, serialised, in the order they were recorded.

    Parameters
    ----------
    topic, type_name : str
        Such as ``/odom`` and ``nav_msgs/msg/Odometry``.
    buffer : ndarray of uint8
        Holds all messages; may be a mapped file.
    starts, sizes : ndarray of int64, shape (n,), [bytes]
        Where each message lies in ``buffer``; within it, not overlapping.
    log_times : ndarray of int64, shape (n,), [ns]
        When each message was received.

    """

    topic: str
    type_name: str
    buffer: npt.NDArray[np.uint8]
    starts: npt.NDArray[np.int64]
    sizes: npt.NDArray[np.int64]
    log_times: npt.NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.starts)

    def __getitem__(self, i: int) -> bytes:
        """Return one message."""
        start = int(self.starts[i])
        return self.buffer[start:start + int(self.sizes[i])].tobytes()

    def __iter__(self) -> Iterator[bytes]:
        """Go through the messages."""
        return (self[i] for i in range(len(self)))

    def bytes_at(
        self, rows: npt.NDArray[np.int64], offset: int, n: int,
    ) -> npt.NDArray[np.uint8]:
        """Return the ``n`` bytes at an offset within some messages, shape (len(rows), n)."""
        return take(self.buffer, self.starts[rows] + offset, n)

    def first(self) -> 'RawMessages':
        """Return the first message alone."""
        return RawMessages(self.topic, self.type_name, self.buffer, self.starts[:1],
                           self.sizes[:1], self.log_times[:1])

    @classmethod
    def of(
        cls, topic: str, type_name: str, messages: list[bytes], log_times: list[int],
    ) -> 'RawMessages':
        """Join messages from another source in one buffer."""
        sizes = np.array([len(message) for message in messages], dtype=np.int64)
        return cls(topic, type_name, np.frombuffer(b''.join(messages), np.uint8),
                   np.cumsum(sizes) - sizes, sizes, np.array(log_times, dtype=np.int64))


class Bag(ABC):
    """
    What every bag can be asked, whoever recorded it.

    Parameters
    ----------
    path : Path
        Where it is.
    topics : dict of str to str
        The type of every topic.
    counts : dict of str to int
        The number of messages of every topic.
    notes : tuple of str
        Sentences on how it was found.
    damage : str
        What is wrong with its file; empty for a whole one.
    complete : bool
        Whether no message is missing at the end.
    recorded : tuple of int, [ns], or None
        When the first and the last message were received; None where only reading all would tell.

    """

    path: Path
    topics: dict[str, str]
    counts: dict[str, int]
    notes: tuple[str, ...] = ()
    damage: str = ''
    complete: bool = True
    recorded: tuple[int, int] | None = None

    @property
    def missing(self) -> str:
        """Return a sentence if part of the bag is missing; empty for a whole one."""
        return '' if self.complete else (
            f'what is not readable of {self.path.name} is missing: {self.damage}')

    @abstractmethod
    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic; none if it is not in the bag.

        Raises
        ------
        BagError
            If it cannot be read.

        """


class BagReader(Bag):
    """
    Read one MCAP file with uncompressed chunks, whole or cut.

    Parameters
    ----------
    path : Path
        The file; it is mapped, so that only what is asked for is read.
    verify : bool
        Whether to compare all chunks with their checksums and leave out those that differ.
    follow : bool
        Whether the file may be a link that leads out of its folder: for paths a person typed.
    where : Path, optional
        A copy of it that is read in its place.

    Attributes
    ----------
    channels : mapping of int to Channel
        By number, in the order they were named.
    metadata : list of (str, dict)
        The metadata records, in order.
    n_lost_bytes : int
        How many bytes that may have held messages are not readable.

    Raises
    ------
    BagError
        If it cannot be read, or is no MCAP file.
    CompressedError
        If its chunks are compressed.

    """

    def __init__(
        self, path: Path | str, verify: bool = False, follow: bool = False,
        where: Path | None = None,
    ) -> None:
        self.path = Path(path)
        self._data = mapped(where or self.path, None if follow else self.path.parent)
        try:
            found = scan(self._data, verify)
        except BagError as error:
            raise type(error)(f'cannot read {self.path}: {error}') from None
        self._starts = found.starts
        self.channels: Mapping[int, Channel] = found.channels
        self.metadata = found.metadata
        self.n_lost_bytes = found.n_lost
        self.damage, self.complete = found.damage, found.complete
        self.topics, self.counts = topics_and_counts(found.channels, {
            number: len(starts) for number, starts in found.starts.items()})

    @property
    def recorded(self) -> tuple[int, int] | None:  # type: ignore[override]
        """Return when the first and the last message were received, [ns]."""
        times = self._heads(list(self.channels))[0]['log_time']
        return (int(times.min()), int(times.max())) if len(times) else None

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the file."""
        numbers = [n for n, channel in self.channels.items() if channel.topic == topic]
        return self.messages_of(numbers, topic)

    def messages_of(self, numbers: list[int], topic: str = '') -> RawMessages:
        """Return the messages of some channels, in the order they were written."""
        type_name = self.channels[numbers[0]].schema.name if numbers else ''
        heads, at = self._heads(numbers)
        return RawMessages(
            topic, type_name, np.frombuffer(self._data, np.uint8), at + MESSAGE,
            heads['length'].astype(np.int64) - (MESSAGE - RECORD),
            np.minimum(heads['log_time'], 2**63 - 1).astype(np.int64))

    def records(self) -> Iterator[tuple[Channel, int, int, bytes]]:
        """Go through all messages in file order: channel, log and publish time [ns], message."""
        heads, starts = self._heads(list(self.channels))
        for head, at in zip(heads, starts.tolist(), strict=True):
            yield (self.channels[int(head['channel'])], int(head['log_time']),
                   int(head['publish_time']),
                   bytes(self._data[at + MESSAGE:at + RECORD + int(head['length'])]))

    def _heads(self, numbers: list[int]) -> tuple[npt.NDArray[np.void], npt.NDArray[np.int64]]:
        """Return the heads of the messages of some channels, and where they begin."""
        at = np.sort(np.concatenate([
            _NOTHING, *(self._starts.get(number, _NOTHING) for number in numbers)]))
        found = take(np.frombuffer(self._data, np.uint8), at, MESSAGE)
        return found.view(_HEAD).reshape(-1), at


def topics_and_counts(
    channels: Mapping[int, Channel], n_messages: Mapping[int, int],
) -> tuple[dict[str, str], dict[str, int]]:
    """Return type and number of messages of every topic; several channels may be of one."""
    topics = {channel.topic: channel.schema.name for channel in channels.values()}
    counts = dict.fromkeys(topics, 0)
    for number, channel in channels.items():
        counts[channel.topic] += n_messages.get(number, 0)
    return topics, counts


def mapped(path: Path, within: Path | None) -> memoryview:
    """Map a file into memory; it must not lead out of a folder."""
    try:
        with open_regular(path, within) as file:
            # An empty file cannot be mapped.
            if file.seek(0, 2) == 0:
                return memoryview(b'')
            return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None


def take(
    buffer: npt.NDArray[np.uint8], starts: npt.NDArray[np.int64], n: int,
) -> npt.NDArray[np.uint8]:
    """
    Return the ``n`` bytes at each place of a buffer, shape (len(starts), n).

    Every place must leave ``n`` bytes; the copy runs at the speed of memory, whatever ``n``.
    """
    if n == 0 or len(starts) == 0:
        return np.zeros((len(starts), n), dtype=np.uint8)
    windows: npt.NDArray[np.void] = np.ndarray(
        (len(buffer) - n + 1,), np.dtype((np.void, n)), buffer, 0, (1,))
    return windows[starts].view(np.uint8).reshape(len(starts), n)
