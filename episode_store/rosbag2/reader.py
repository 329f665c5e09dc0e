"""Reading bags: the raw messages of a topic, without decoding or copying them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import mmap
from pathlib import Path
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.mcap_index import message_heads, read_index, take
from episode_store.rosbag2.mcap_scan import Channel, McapIndex, MESSAGE, RECORD, scan
from msgs_bridge.untrusted.files import open_regular

#: Most that the messages of a topic may come to in memory, where they were packed, [bytes].
MOST_IN_MEMORY: Final = 2**30
_NOTHING: Final = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class RawMessages:
    """
    Messages of one topic, serialised, in the order they were recorded.

    Parameters
    ----------
    topic, type_name : str
        Such as ``/odom`` and ``nav_msgs/msg/Odometry``.
    buffer : ndarray of uint8
        Holds all of them; may be a mapped file.
    starts, sizes : ndarray of int64, shape (n,), [bytes]
        Where each one lies in ``buffer``; within it, not overlapping.
    log_times : ndarray of int64, shape (n,), [ns]
        When each one was received.

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

    @classmethod
    def of(
        cls, topic: str, type_name: str, messages: list[bytes], log_times: list[int],
    ) -> 'RawMessages':
        """Put messages from elsewhere one behind the other."""
        sizes = np.array([len(message) for message in messages], dtype=np.int64)
        return cls(topic, type_name, np.frombuffer(b''.join(messages), np.uint8),
                   np.cumsum(sizes) - sizes, sizes, np.array(log_times, dtype=np.int64))


class Bag(Protocol):
    """What can be asked of any bag, whoever recorded it."""

    path: Path

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages of every topic."""

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the bag."""


class BagReader:
    """
    Read one MCAP file with uncompressed chunks, whole or cut.

    Parameters
    ----------
    path : Path
        The file; it is mapped, and read as far as it is asked for.
    verify : bool
        Whether to compare all chunks with their checksums: those that do not match are left out.
    follow : bool
        Whether the file may be a link that leads out of its folder: for paths a person typed.

    Raises
    ------
    BagError
        If it cannot be read, or is no MCAP file.
    CompressedError
        If its chunks are compressed.

    """

    def __init__(
        self, path: Path | str, verify: bool = False, follow: bool = False,
    ) -> None:
        self.path = Path(path)
        data = _mapped(self.path, None if follow else self.path.parent)
        try:
            self._data, self._index = self._read(data, verify)
        except BagError as error:
            raise type(error)(f'cannot read {self.path}: {error}') from None

    def _read(self, data: memoryview, verify: bool) -> tuple[memoryview, McapIndex]:
        """Return where the messages of a file lie: in which bytes, and where in these."""
        return data, read_index(data, verify)

    @property
    def damage(self) -> str:
        """Say why the end of the file is not readable; empty for a whole one."""
        return self._index.damage

    @property
    def complete(self) -> bool:
        """Tell whether no message is missing at the end."""
        return self._index.complete

    @property
    def n_lost_bytes(self) -> int:
        """Return how many bytes that may have held messages are not readable."""
        return self._index.n_lost

    @property
    def metadata(self) -> list[tuple[str, dict[str, str]]]:
        """Return the metadata records, in order."""
        return self._index.metadata

    @property
    def channels(self) -> Mapping[int, Channel]:
        """Return the channels by number, in the order they were named."""
        return self._index.channels

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return {channel.topic: channel.schema.name for channel in self.channels.values()}

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages of every topic."""
        counts = dict.fromkeys(self.topics, 0)
        for number, channel in self.channels.items():
            counts[channel.topic] += len(self._index.starts.get(number, _NOTHING))
        return counts

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the file."""
        numbers = [n for n, channel in self.channels.items() if channel.topic == topic]
        return self.messages_of(numbers, topic)

    def messages_of(self, numbers: list[int], topic: str = '') -> RawMessages:
        """Return the messages of some channels, in the order they were written."""
        # Before the index may be given up, and the channel with it.
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
        """Return heads and places of messages; an index that proves wrong is given up."""
        for _ in range(2):
            starts = [self._index.starts.get(number, _NOTHING) for number in numbers]
            at = np.sort(np.concatenate(starts)) if len(starts) > 1 else (starts or [_NOTHING])[0]
            heads = message_heads(self._data, at, numbers)
            if heads is not None:
                return heads, at
            self._index = scan(self._data)
        raise BagError(f'cannot read {self.path}: its messages overlap')


def _mapped(path: Path, within: Path | None) -> memoryview:
    """Map a file into memory."""
    try:
        with open_regular(path, within) as file:
            # An empty file cannot be mapped.
            if file.seek(0, 2) == 0:
                return memoryview(b'')
            return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
