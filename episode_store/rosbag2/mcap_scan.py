"""
Read MCAP record by record: whatever is readable of a file, whole or cut, wherever it was cut.

A file is hostile until checked: every length is compared with the bytes that are there before
anything is read, and nothing is allocated that a header merely claims. The index at the end of a
file is not trusted: reading all records is as fast (ADR 27).
"""

from array import array
from collections import defaultdict
from dataclasses import dataclass, field
from io import BytesIO
import struct
from typing import Any, Final, NamedTuple
import zlib

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import ChunkIndex
from mcap.records import Metadata as MetadataRecord
from mcap.records import Schema as SchemaRecord
from mcap.stream_reader import StreamReader
import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError

MAGIC: Final = b'\x89MCAP0\r\n'
#: Bytes of a record's opcode and length, and of a message's channel, sequence and two times.
RECORD: Final = 9
MESSAGE: Final = RECORD + 22
START: Final = struct.Struct('<BQ')
#: Numbers rather than members of an enumeration: there are thousands of records.
FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP, METADATA_OP, DATA_END_OP = map(int, (
    Opcode.FOOTER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.METADATA,
    Opcode.DATA_END))
#: Of a chunk: size and checksum without compression, and the length of its compression's name.
_CHUNK: Final = struct.Struct('<16xQII')
_U8: Final = struct.Struct('<Q')
#: Of a message: opcode, length, channel.
_MESSAGE: Final = struct.Struct('<BQH')
_LONGEST_NAME: Final = 32
#: Metadata records that a file may have; recorders write one or two.
_MOST_METADATA: Final = 10_000
#: A footer's record up to its checksum: opcode, length, where the index begins, where its offsets.
_FOOTER: Final = struct.Struct('<BQQQ')
#: From here on opcodes are for records that a program adds for itself.
_PRIVATE: Final = 0x80
_IN_CHUNK: Final = (SCHEMA_OP, CHANNEL_OP, MESSAGE_OP)


class CompressedError(BagError):
    """The file holds compressed chunks, which another reader must unpack."""


class CutError(Exception):
    """A record ends before its fields do."""


#: Raised by reading a record that is cut or was damaged.
_DAMAGE: Final = (CutError, McapError, struct.error, UnicodeDecodeError)


class Schema(NamedTuple):
    """How the messages of a channel are defined."""

    name: str
    encoding: str
    data: bytes


class Channel(NamedTuple):
    """A topic of the file."""

    number: int
    schema: Schema
    topic: str
    encoding: str
    metadata: dict[str, str]


class Chunk(NamedTuple):
    """Where the records of a chunk lie [bytes], and what they are without its compression."""

    compression: str
    size: int
    crc: int
    at: int
    end: int


@dataclass
class McapContents:
    """
    What an MCAP file holds.

    Parameters
    ----------
    channels : dict of int to Channel
    metadata : list of (str, dict)
        Metadata records, in order.
    starts : dict of int to ndarray of int64
        For each channel where its message records begin, [bytes], in the order they were written.
    n_lost : int
        Bytes that may have held messages and are not readable.
    damage : str
        What is not readable, and why; empty for a whole file.
    complete : bool
        Whether all messages are there: the file is whole, or was cut after the last of them.

    """

    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    starts: dict[int, npt.NDArray[np.int64]] = field(default_factory=dict)
    n_lost: int = 0
    damage: str = ''
    complete: bool = False


def scan(data: memoryview, verify: bool = False) -> McapContents:
    """
    Find all messages of a file, as far as it is readable.

    Parameters
    ----------
    data : memoryview of bytes
        The file.
    verify : bool
        Whether to compare the chunks of a closed file with their checksums, too: bytes may have
        changed on the disk. Those of a file that is damaged are compared in any case.

    Raises
    ------
    CompressedError
        If a chunk is compressed.
    BagError
        If it is no MCAP file.

    """
    found = Scan(data, verify).run()
    return Scan(data, True).run() if found.damage and not verify else found


class Scan:
    """
    Reads a file record by record; behind damage it goes on at the next chunk.

    Parameters
    ----------
    data : memoryview of bytes
        The file.
    verify : bool
        Whether to compare chunks with their checksums.

    Raises
    ------
    BagError
        If it is no MCAP file.

    """

    def __init__(self, data: memoryview, verify: bool = True) -> None:
        if bytes(data[:len(MAGIC)]) != MAGIC[:len(data)]:
            raise BagError('it is no MCAP file')
        self.data = data
        self.verify = verify
        self.schemas: dict[int, Schema] = {}
        self.found = McapContents()
        self.starts: defaultdict[int, array[int]] = defaultdict(lambda: array('q'))
        self.at = len(MAGIC)

    def run(self) -> McapContents:
        """Read up to the last readable record; return the contents."""
        found, index_at = self.found, _index_start(self.data)
        try:
            self._records(len(self.data), top=True)
            if not index_at:
                self._damaged('it ends without its index' if len(self.data) else 'it is empty')
        except _DAMAGE as error:
            self._damaged(str(error) if isinstance(error, CutError) and str(error) else (
                f'the record at byte {self.at} is cut or makes no sense'))
            self._go_on(_chunk_starts(self.data, index_at))
        if not found.complete:
            found.n_lost += max(len(self.data) - self.at, 0)
        found.complete = found.complete and not found.n_lost
        found.starts = {channel: np.frombuffer(starts, dtype=np.int64)
                        for channel, starts in self.starts.items()}
        return found

    def _damaged(self, damage: str) -> None:
        """Keep the first damage."""
        self.found.damage = self.found.damage or damage

    def _go_on(self, starts: list[int]) -> None:
        """Go on behind a damaged record, at chunks named by the index."""
        for start in starts:
            if start > self.at:
                self.found.n_lost += start - self.at
                self.at = start
                try:
                    self._records(len(self.data), top=True)
                    return
                except _DAMAGE:
                    continue

    def _records(self, end: int, top: bool) -> None:
        """Read the records up to ``end``; `at` stays at the first that is not whole."""
        while self.at < end:
            self._messages(end)
            if self.at == end:
                return
            start, (opcode, length) = self.at, self._start(end, top)
            if opcode == CHUNK_OP:
                self._chunk(start, start + RECORD + length, end)
                continue
            if opcode == MESSAGE_OP or start + RECORD + length > end:
                raise CutError
            self._definition(opcode, start, length)
            self.at = start + RECORD + length
            if opcode == DATA_END_OP:
                self.found.complete = True
                return

    def _start(self, end: int, top: bool) -> tuple[int, int]:
        """Return opcode and length of the next record; a chunk may not hold just any."""
        if self.at + RECORD > end:
            raise CutError
        opcode, length = START.unpack_from(self.data, self.at)
        if not ((0 < opcode <= DATA_END_OP or opcode >= _PRIVATE) if top else opcode in _IN_CHUNK):
            raise CutError
        return opcode, length

    def _messages(self, end: int) -> None:
        """Keep where messages begin, up to another record or one that is not whole."""
        at, data, channels, starts = self.at, self.data, self.found.channels, self.starts
        while at + MESSAGE <= end:
            opcode, length, channel = _MESSAGE.unpack_from(data, at)
            following = at + RECORD + length
            if opcode != MESSAGE_OP or length < MESSAGE - RECORD or following > end:
                break
            if channel in channels:
                starts[channel].append(at)
            at = following
        self.at = at

    def _definition(self, opcode: int, start: int, length: int) -> None:
        """Read a schema, a channel or metadata; skip other records."""
        def read(kind: Any) -> Any:
            record = self.data[start + RECORD:start + RECORD + length]
            return kind.read(ReadDataStream(BytesIO(record)))

        if opcode == SCHEMA_OP:
            schema = read(SchemaRecord)
            self.schemas[schema.id] = Schema(schema.name, schema.encoding, schema.data)
        elif opcode == CHANNEL_OP:
            channel = read(ChannelRecord)
            self.found.channels[channel.id] = Channel(
                channel.id, self.schemas.get(channel.schema_id, Schema('', '', b'')),
                channel.topic, channel.message_encoding, channel.metadata)
        elif opcode == METADATA_OP:
            if len(self.found.metadata) == _MOST_METADATA:
                raise BagError(f'it has more than {_MOST_METADATA} metadata records')
            metadata = read(MetadataRecord)
            self.found.metadata.append((metadata.name, metadata.metadata))

    def _chunk(self, start: int, chunk_end: int, end: int) -> None:
        """Read the records of a chunk; of a cut one, those that are whole."""
        whole = chunk_end <= end
        try:
            chunk = self._chunk_head(start, chunk_end)
            if chunk.compression and whole:
                self._packed(start, chunk)
            elif not chunk.compression and chunk.end <= end and self._is_rotten(start, chunk):
                self._definitions(chunk)
                self.at = chunk.end
            elif not chunk.compression:
                self.at = chunk.at
                self._records(min(chunk.end, end), top=False)
        except (CutError, struct.error):
            if whole:
                raise
        if not whole:
            raise CutError(f'the chunk at byte {start} is cut, {end - start} of '
                           f'{chunk_end - start} bytes are there')
        self.at = chunk_end

    def _chunk_head(self, start: int, chunk_end: int) -> Chunk:
        """Read the head of a chunk."""
        size, crc, n_name = _CHUNK.unpack_from(self.data, start + RECORD)
        at = start + RECORD + _CHUNK.size
        if n_name > _LONGEST_NAME:
            raise CutError
        compression = bytes(self.data[at:at + n_name]).decode()
        at += n_name + _U8.size
        chunk = Chunk(compression, size, crc, at, at + _U8.unpack_from(self.data, at - 8)[0])
        if chunk.end > chunk_end:
            raise CutError
        return chunk

    def _packed(self, start: int, chunk: Chunk) -> None:
        """Read a chunk that is compressed."""
        raise CompressedError(f'its chunks are compressed with {chunk.compression[:20]}')

    def _definitions(self, chunk: Chunk) -> None:
        """Read only the schemas and channels of a chunk: later messages may need them."""
        starts, self.starts = self.starts, defaultdict(lambda: array('q'))
        self.at = chunk.at
        try:
            self._records(chunk.end, top=False)
        except _DAMAGE:
            pass  # everything before the bad bytes was read
        finally:
            self.starts = starts

    def _is_rotten(self, start: int, chunk: Chunk) -> bool:
        """Note a chunk that does not match its checksum; nothing in it is trusted."""
        if not self.verify or not chunk.crc or (
                zlib.crc32(self.data[chunk.at:chunk.end]) == chunk.crc):
            return False
        self.lose(start, chunk, 'does not match its checksum')
        return True

    def lose(self, start: int, chunk: Chunk, why: str) -> None:
        """Note a chunk of which nothing can be read."""
        self.found.n_lost += chunk.end - start
        self._damaged(f'the chunk at byte {start} {why}')


def _index_start(data: memoryview) -> int:
    """Return where the index of a file begins that was closed; 0 if there is none."""
    at = len(data) - len(MAGIC) - _FOOTER.size - 4
    if at < len(MAGIC) or bytes(data[-len(MAGIC):]) != MAGIC:
        return 0
    opcode, length, start, _ = _FOOTER.unpack_from(data, at)
    if (opcode, length) != (FOOTER_OP, 20) or not len(MAGIC) <= start < at:
        return 0
    # The checksum covers the index and the footer up to itself.
    crc = struct.unpack_from('<I', data, at + _FOOTER.size)[0]
    return int(start) if crc in (0, zlib.crc32(data[start:at + _FOOTER.size])) else 0


def _chunk_starts(data: memoryview, index_at: int) -> list[int]:
    """Return where chunks begin according to the index of a file."""
    if not index_at:
        return []
    starts = []
    try:
        for record in StreamReader(BytesIO(data[index_at:]), skip_magic=True).records:
            if isinstance(record, ChunkIndex):
                starts.append(record.chunk_start_offset)
    except (*_DAMAGE, OverflowError, MemoryError):
        pass  # everything before the bad bytes was read
    return sorted({start for start in starts if start < index_at})
