"""
What can be read of a ROS 1 bag that its recorder did not close: only the index is missing.

A recorder that was killed leaves chunks of connections and messages, and perhaps half a chunk at
the end. Whole records are read, as `rosbag reindex` would, and nothing is written.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
import mmap
from pathlib import Path
import struct
from typing import Final

from rosbags.rosbag1.reader import normalize
from rosbags.typesys.msg import normalize_msgtype

from control_field.words import counted
from msgs_bridge.untrusted.files import open_regular

_MAGIC: Final = b'#ROSBAG V2.0\n'
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_SIZE: Final = struct.Struct('<I')
_TIME: Final = struct.Struct('<II')

#: Functions that unpack a chunk, by the name of its compression.
Unpackers = dict[str, Callable[[bytes], bytes]]
#: What a record is, its fields, and its data.
_Record = tuple[int, dict[bytes, bytes], memoryview]


class RecordError(ValueError):
    """Bytes are no record."""


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
        for op, fields, data in self._walk():
            if op == _CONNECTION:
                self._connect(fields, data)
            elif connection := self._connections.get(_number(fields, b'conn')):
                connection.msgcount += 1

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
        for op, fields, data in self._walk():
            number = _number(fields, b'conn')
            if op == _MESSAGE and number in numbers:
                yield self._connections[number], _time(fields), bytes(data)

    def _connect(self, fields: dict[bytes, bytes], data: memoryview) -> None:
        number, about = _number(fields, b'conn'), _fields(data)
        if number not in self._connections:
            self._connections[number] = Connection(
                number, normalize(_text(fields, b'topic')),
                normalize_msgtype(_text(about, b'type')), _text(about, b'md5sum'))

    def _walk(self) -> Iterator[_Record]:
        """Go through connections and messages, in chunks or not, as far as all is whole."""
        self.n_lost = self.n_damaged = 0
        with open_regular(self.path) as file:
            # What is mapped outlives the file.
            data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        if bytes(data[:len(_MAGIC)]) != _MAGIC:
            raise RecordError('it does not begin as a bag of ROS 1 does')
        at = len(_MAGIC)
        while at < len(data):
            try:
                (op, fields, body), at = _record(data, at)
            except RecordError:
                self.n_lost = len(data) - at
                yield from self._cut_chunk(data, at)
                return
            if op == _CHUNK:
                yield from self._chunk(fields, body)
            elif op in (_MESSAGE, _CONNECTION):
                yield op, fields, body

    def _chunk(self, fields: dict[bytes, bytes], body: memoryview) -> Iterator[_Record]:
        if not len(body):  # begun and not finished: its records follow
            return
        try:
            unpacked = memoryview(self._unpackers[_text(fields, b'compression')](bytes(body)))
        except Exception:
            # What decompressors raise is of many types.
            self.n_damaged += 1
            return
        yield from self._in_chunk(unpacked)

    def _cut_chunk(self, data: memoryview, at: int) -> Iterator[_Record]:
        """Go through what is whole of a chunk without compression whose end is missing."""
        try:
            fields, start = _header(data, at)
            if fields.get(b'op') == bytes([_CHUNK]) and _text(fields, b'compression') == 'none':
                yield from self._in_chunk(data[start + _SIZE.size:])
        except RecordError:
            return

    @staticmethod
    def _in_chunk(data: memoryview) -> Iterator[_Record]:
        at = 0
        while at < len(data):
            try:
                record, at = _record(data, at)
            except RecordError:
                return
            if record[0] in (_MESSAGE, _CONNECTION):
                yield record


def _record(data: memoryview, at: int) -> tuple[_Record, int]:
    """Return the record that begins somewhere, and where it ends."""
    fields, start = _header(data, at)
    body, end = _counted(data, start)
    op = fields.get(b'op', b'')
    if len(op) != 1:
        raise RecordError('it does not say what it is')
    return (op[0], fields, body), end


def _header(data: memoryview, at: int) -> tuple[dict[bytes, bytes], int]:
    header, end = _counted(data, at)
    return _fields(header), end


def _fields(header: memoryview) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(header):
        field, at = _counted(header, at)
        name, is_one, value = bytes(field).partition(b'=')
        if not is_one:
            raise RecordError('a field has no name')
        fields[name] = value
    return fields


def _counted(data: memoryview, at: int) -> tuple[memoryview, int]:
    """Return the bytes behind their number, and where they end."""
    start = at + _SIZE.size
    if start > len(data):
        raise RecordError('it ends in the middle')
    end = start + int(_SIZE.unpack_from(data, at)[0])
    if end > len(data):
        raise RecordError('it ends in the middle')
    return data[start:end], end


def _number(fields: dict[bytes, bytes], name: bytes) -> int:
    value = fields.get(name, b'')
    return int(_SIZE.unpack(value)[0]) if len(value) == _SIZE.size else -1


def _time(fields: dict[bytes, bytes]) -> int:
    value = fields.get(b'time', b'')
    if len(value) != _TIME.size:
        return 0
    sec, nanosec = _TIME.unpack(value)
    return int(sec) * 1_000_000_000 + int(nanosec)


def _text(fields: dict[bytes, bytes], name: bytes) -> str:
    try:
        return fields[name].decode()
    except (KeyError, UnicodeDecodeError):
        raise RecordError(f'it has no {name.decode()}') from None
