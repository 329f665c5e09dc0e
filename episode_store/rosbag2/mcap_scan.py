"""
MCAP record by record: what is readable of a file, wherever it was cut.

A file is hostile until checked: every length is compared with the bytes that are there before
anything is read, and nothing is allocated that a header merely claims.
"""

from dataclasses import dataclass, field
import struct
from typing import Final, NamedTuple
import zlib

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError

MAGIC: Final = b'\x89MCAP0\r\n'
#: Bytes of a record's opcode and length, and of a message's channel, sequence and two times.
RECORD: Final = 9
MESSAGE: Final = RECORD + 22
FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP = range(2, 7)
MESSAGE_INDEX_OP, CHUNK_INDEX_OP = 7, 8
STATISTICS_OP, METADATA_OP, METADATA_INDEX_OP, DATA_END_OP = 0x0B, 0x0C, 0x0D, 0x0F
START: Final = struct.Struct('<BQ')
U2, U4, U8 = struct.Struct('<H'), struct.Struct('<I'), struct.Struct('<Q')
_IN_CHUNK: Final = (SCHEMA_OP, CHANNEL_OP, MESSAGE_OP)


class CompressedError(BagError):
    """The file holds compressed chunks, which another reader must unpack."""


class CutError(Exception):
    """A record ends before its fields do."""


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


@dataclass
class McapIndex:
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
        Why the rest is not readable; empty for a whole file.
    complete : bool
        Whether all messages are there: the file is whole, or was cut after the last of them.

    """

    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    starts: dict[int, npt.NDArray[np.int64]] = field(default_factory=dict)
    n_lost: int = 0
    damage: str = ''
    complete: bool = False


def scan(data: memoryview) -> McapIndex:
    """
    Find all messages record by record, as far as the file is readable.

    Parameters
    ----------
    data : memoryview of bytes
        The file.

    Raises
    ------
    CompressedError
        If a chunk is compressed.
    BagError
        If it is no MCAP file.

    """
    if bytes(data[:len(MAGIC)]) != MAGIC[:len(data)]:
        raise BagError('it is no MCAP file')
    walk = Scan(data)
    walk.run()
    return walk.index()


class Cursor:
    """Reads the fields of a record, never past its end."""

    def __init__(self, data: memoryview, at: int, end: int) -> None:
        self.data, self.at, self.end = data, at, end

    def number(self, form: struct.Struct) -> int:
        """Read an integer."""
        at = self._step(form.size)
        return int(form.unpack_from(self.data, at)[0])

    def raw(self, n: int) -> bytes:
        """Read ``n`` bytes."""
        at = self._step(n)
        return bytes(self.data[at:at + n])

    def text(self) -> str:
        """Read a text with its length."""
        return self.raw(self.number(U4)).decode()

    def mapping(self) -> dict[str, str]:
        """Read pairs of texts with their length."""
        n = self.number(U4)
        inner = Cursor(self.data, self._step(n), self.at)
        found = {}
        while inner.at < inner.end:
            key = inner.text()
            found[key] = inner.text()
        return found

    def _step(self, n: int) -> int:
        at = self.at
        if at + n > self.end:
            raise CutError
        self.at += n
        return at


class Scan:
    """
    Walks over a file record by record until it ends or makes no sense.

    Parameters
    ----------
    data : memoryview of bytes
        The file.

    """

    def __init__(self, data: memoryview) -> None:
        self.data = data
        self.schemas: dict[int, Schema] = {}
        self.found = McapIndex()
        self.starts: dict[int, list[int]] = {}
        self.at = len(MAGIC)

    def run(self) -> None:
        """Walk to where no record can be read any more."""
        found = self.found
        try:
            self._records(len(self.data), top=True)
            found.damage = found.damage or (
                'it ends without its index' if len(self.data) else 'it is empty')
        except (CutError, struct.error, UnicodeDecodeError) as error:
            found.damage = (found.damage or str(error)
                            or f'the record at byte {self.at} is cut or makes no sense')
        if not found.complete:
            found.n_lost += max(len(self.data) - self.at, 0)
        found.complete = found.complete and not found.n_lost

    def index(self) -> McapIndex:
        """Return what was found."""
        self.found.starts = {channel: np.array(starts, dtype=np.int64)
                             for channel, starts in self.starts.items()}
        return self.found

    def _records(self, end: int, top: bool) -> None:
        """Read the records up to ``end``; `at` stays at the first that is not whole."""
        while self.at < end:
            start, (opcode, length) = self.at, self._start(end, top)
            if opcode == CHUNK_OP:
                self._chunk(start, start + RECORD + length, end)
                continue
            if start + RECORD + length > end:
                raise CutError
            self._record(opcode, start, length)
            self.at = start + RECORD + length
            if opcode == DATA_END_OP:
                self.found.complete = True
                return

    def _start(self, end: int, top: bool) -> tuple[int, int]:
        """Return opcode and length of the next record; a chunk may not hold just any."""
        if self.at + RECORD > end:
            raise CutError
        opcode, length = START.unpack_from(self.data, self.at)
        if not (0 < opcode <= DATA_END_OP if top else opcode in _IN_CHUNK):
            raise CutError
        return opcode, length

    def _record(self, opcode: int, start: int, length: int) -> None:
        if opcode == MESSAGE_OP:
            if length < MESSAGE - RECORD:
                raise CutError
            channel = U2.unpack_from(self.data, start + RECORD)[0]
            if channel in self.found.channels:
                self.starts.setdefault(channel, []).append(start)
            return
        cursor = Cursor(self.data, start + RECORD, start + RECORD + length)
        if opcode == SCHEMA_OP:
            read_schema(cursor, self.schemas)
        elif opcode == CHANNEL_OP:
            read_channel(cursor, self.schemas, self.found.channels)
        elif opcode == METADATA_OP:
            self.found.metadata.append((cursor.text(), cursor.mapping()))

    def _chunk(self, start: int, chunk_end: int, end: int) -> None:
        """Read the records of a chunk; of one that is cut, those that are whole."""
        cursor = Cursor(self.data, start + RECORD, min(chunk_end, end))
        cursor.raw(28)
        compression = cursor.text()
        if compression:
            raise CompressedError(f'its chunks are compressed with {compression[:20]}')
        records_end = cursor.number(U8) + cursor.at
        if records_end > chunk_end:
            raise CutError
        self.at = cursor.at
        whole = chunk_end <= end
        if whole and self._is_rotten(start, cursor.at, records_end):
            self._definitions(records_end)
            self.at = chunk_end
            return
        try:
            self._records(min(records_end, end), top=False)
        except CutError:
            if whole:
                raise
        if not whole:
            raise cut_chunk(start, chunk_end, end)
        self.at = chunk_end

    def _definitions(self, end: int) -> None:
        """Read only the schemas and channels of a chunk: later messages may need them."""
        starts, self.starts = self.starts, {}
        try:
            self._records(end, top=False)
        except (CutError, struct.error, UnicodeDecodeError):
            pass  # what comes before the bad bytes is all there is
        finally:
            self.starts = starts

    def _is_rotten(self, start: int, at: int, end: int) -> bool:
        """Note a chunk that does not match its checksum; nothing in it can be believed."""
        crc = U4.unpack_from(self.data, start + RECORD + 24)[0]
        if not crc or zlib.crc32(self.data[at:end]) == crc:
            return False
        self.found.n_lost += end - start
        self.found.damage = (self.found.damage
                             or f'the chunk at byte {start} does not match its checksum')
        return True


def cut_chunk(start: int, chunk_end: int, end: int) -> CutError:
    """Say of a chunk how much of it is there."""
    return CutError(f'the chunk at byte {start} is cut, {end - start} of '
                    f'{chunk_end - start} bytes are there')


def read_schema(cursor: Cursor, schemas: dict[int, Schema]) -> None:
    """Read a schema record."""
    number = cursor.number(U2)
    name, encoding = cursor.text(), cursor.text()
    schemas[number] = Schema(name, encoding, cursor.raw(cursor.number(U4)))


def read_channel(
    cursor: Cursor, schemas: dict[int, Schema], channels: dict[int, Channel],
) -> None:
    """Read a channel record."""
    number, schema = cursor.number(U2), cursor.number(U2)
    channels[number] = Channel(
        number, schemas.get(schema, Schema('', '', b'')), cursor.text(), cursor.text(),
        cursor.mapping())
