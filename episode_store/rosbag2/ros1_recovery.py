"""
What can be read of a ROS 1 bag that its recorder did not close: only the index is missing.

A recorder that was killed leaves chunks of connections and messages, and perhaps half a chunk at
the end. Whole records are read, as `rosbag reindex` would, and nothing is written.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
import mmap
from pathlib import Path
from typing import Any, Final, NamedTuple

from rosbags.rosbag1.reader import (
    Header, normalize, read_bytes, read_uint32, ReaderError, RecordType)
from rosbags.typesys.msg import normalize_msgtype

from control_field.words import counted
from msgs_bridge.untrusted.files import open_regular

_MAGIC: Final = b'#ROSBAG V2.0\n'
#: Raised by reading a record that is cut or makes no sense.
_DAMAGE: Final = (ReaderError, ValueError, IndexError)

#: Functions that unpack a chunk, by the name of its compression.
Unpackers = dict[str, Callable[[bytes], bytes]]


class RecordError(ValueError):
    """Bytes are not a bag of ROS 1."""


class _Record(NamedTuple):
    """A record: its type, its fields, and its data."""

    kind: int
    header: Header
    data: bytes


@dataclass
class Connection:
    """Who publishes what, as `rosbags` has it; ``msgcount`` messages of it are whole."""

    id: int
    topic: str
    msgtype: str
    digest: str
    msgcount: int = 0


class UnclosedBag:
    """
    A bag without an index.

    Parameters
    ----------
    path : Path
    unpackers : dict of str to callable
        May raise anything on bytes that they cannot unpack.

    """

    def __init__(self, path: Path, unpackers: Unpackers) -> None:
        self.path, self._unpackers = path, unpackers
        self._connections: dict[int, Connection] = {}
        #: Bytes that are no whole record, and chunks that cannot be unpacked.
        self.n_lost = self.n_damaged = 0
        for record in self._records():
            # One without what it must say is passed over.
            with suppress(*_DAMAGE):
                number = record.header.get_uint32('conn')
                if record.kind == RecordType.CONNECTION:
                    self._connect(number, record)
                elif number in self._connections:
                    self._connections[number].msgcount += 1

    @property
    def connections(self) -> list[Connection]:
        """Return all of them."""
        return list(self._connections.values())

    @property
    def note(self) -> str:
        """Return a sentence on how the bag was found."""
        n = sum(each.msgcount for each in self.connections)
        damaged = (f', {counted(self.n_damaged, "chunk")} cannot be unpacked'
                   if self.n_damaged else '')
        lost = f', the last {self.n_lost} bytes are cut off' if self.n_lost else ''
        return (f'{self.path.name} was not closed by its recorder: {counted(n, "message")} read '
                f'from what is whole{damaged}{lost}')

    def messages(self, wanted: Sequence[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """Go through the messages of some connections: which, when [ns], and what."""
        numbers = {each.id for each in wanted}
        for kind, header, data in self._records():
            with suppress(ReaderError):
                number = header.get_uint32('conn')
                if kind == RecordType.MSGDATA and number in numbers:
                    yield self._connections[number], header.get_time('time'), data

    def _connect(self, number: int, record: _Record) -> None:
        about = Header.read(BytesIO(len(record.data).to_bytes(4, 'little') + record.data))
        self._connections.setdefault(number, Connection(
            number, normalize(record.header.get_string('topic')),
            normalize_msgtype(about.get_string('type')), about.get_string('md5sum')))

    def _records(self) -> Iterator[_Record]:
        """Yield connections and messages, in chunks or not, as far as all is whole."""
        self.n_lost = self.n_damaged = 0
        with open_regular(self.path) as file, mmap.mmap(
                file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            if data.read(len(_MAGIC)) != _MAGIC:
                raise RecordError('it does not begin as a bag of ROS 1 does')
            for record in _whole_records(data):
                if record.kind == RecordType.CHUNK:
                    yield from self._in_chunk(record)
                else:
                    yield from _kept([record])
            self.n_lost = len(data) - data.tell()
            yield from _in_cut_chunk(data)

    def _in_chunk(self, chunk: _Record) -> Iterator[_Record]:
        # What decompressors raise is of many types. A chunk without data was begun and not
        # finished: its records follow.
        try:
            unpack = self._unpackers[chunk.header.get_string('compression')]
            unpacked = unpack(chunk.data) if chunk.data else b''
        except Exception:
            self.n_damaged += 1
            return
        yield from _kept(_whole_records(BytesIO(unpacked)))


def _whole_records(source: Any) -> Iterator[_Record]:
    """Yield records up to one that is not whole, where the source is left."""
    while True:
        at = source.tell()
        try:
            header = Header.read(source)
            record = _Record(header.get_uint8('op'), header, read_bytes(
                source, read_uint32(source)))
        except _DAMAGE:
            source.seek(at)
            return
        yield record


def _in_cut_chunk(source: Any) -> Iterator[_Record]:
    """Yield what is whole of a chunk without compression whose end is missing."""
    with suppress(*_DAMAGE):
        header = Header.read(source)
        if (header.get_uint8('op'), header.get_string('compression')) == (
                RecordType.CHUNK, 'none'):
            read_uint32(source)
            yield from _kept(_whole_records(BytesIO(source.read())))


def _kept(records: Iterable[_Record]) -> Iterator[_Record]:
    return (each for each in records if each.kind in (RecordType.CONNECTION, RecordType.MSGDATA))
