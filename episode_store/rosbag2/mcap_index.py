"""Where the messages of an MCAP file are: from its index, all at once."""

from collections.abc import Iterator
import struct
from typing import Final
import zlib

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.mcap_scan import (
    CHANNEL_OP, CHUNK_INDEX_OP, CompressedError, Cursor, CutError, FOOTER_OP, MAGIC, McapIndex,
    MESSAGE, MESSAGE_INDEX_OP, MESSAGE_OP, METADATA_INDEX_OP, METADATA_OP, read_channel,
    read_schema, RECORD, scan, Schema, SCHEMA_OP, START, STATISTICS_OP, U4, U8)

_FOOTER_BYTES: Final = RECORD + 20
#: Bytes of a message index before its entries, and of a chunk index without offsets, compression.
_INDEX_BYTES: Final = RECORD + 6
_CHUNK_INDEX_BYTES: Final = 64
#: Messages, schemas, channels, attachments, metadata records, chunks.
_STATISTICS: Final = struct.Struct('<QHIIII')
#: No file reaches so far; greater numbers would overflow in sums.
_FAR: Final = 2**62
_MESSAGE_DTYPE: Final[np.dtype[np.void]] = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8')])


def read_index(data: memoryview, verify: bool = False) -> McapIndex:
    """
    Find all messages of a whole file through its index, of any other by scanning it.

    Parameters
    ----------
    data : memoryview of bytes
        The file.
    verify : bool
        Whether to look at every chunk of a whole file, too: bytes may have changed on the disk.

    Raises
    ------
    CompressedError
        If a chunk is compressed.
    BagError
        If it is no MCAP file.

    """
    span = _summary(data)
    if span is None:
        return scan(data)
    if verify and (scanned := scan(data)).n_lost:
        return scanned
    try:
        found = _indexed(data, span)
        damage = ''
    except (CutError, struct.error, UnicodeDecodeError):
        found, damage = None, 'its index does not fit the rest'
    if found is None:
        found = scan(data)
        found.damage = damage if found.complete else found.damage
    return found


def _summary(data: memoryview) -> tuple[int, int] | None:
    """Return where the index of a whole file begins and ends."""
    end = len(data) - len(MAGIC) - _FOOTER_BYTES
    if end < len(MAGIC) or not bytes(data[-len(MAGIC):]) == bytes(data[:len(MAGIC)]) == MAGIC:
        return None
    opcode, length = START.unpack_from(data, end)
    start, _, crc = struct.unpack_from('<QQI', data, end + RECORD)
    if (opcode, length) != (FOOTER_OP, 20) or not len(MAGIC) <= start < end:
        return None
    # The checksum covers the index and the footer up to itself.
    if crc and zlib.crc32(data[start:end + _FOOTER_BYTES - 4]) != crc:
        return None
    return start, end


def _records(data: memoryview, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Go through records: opcode, and where the content begins and ends."""
    while start < end:
        opcode, length = START.unpack_from(data, start)
        start += RECORD
        if start + length > end:
            raise CutError
        yield opcode, start, start + length
        start += length


def _indexed(data: memoryview, span: tuple[int, int]) -> McapIndex | None:
    """Read the index; None if it does not tell of all messages."""
    found = McapIndex(complete=True)
    schemas: dict[int, Schema] = {}
    chunks: dict[int, list[int]] = {}
    n_chunks = n_messages = -1
    for opcode, start, end in _records(data, *span):
        if opcode == CHUNK_INDEX_OP:
            chunks.setdefault(end - start, []).append(start)
        elif opcode == SCHEMA_OP:
            read_schema(Cursor(data, start, end), schemas)
        elif opcode == CHANNEL_OP:
            read_channel(Cursor(data, start, end), schemas, found.channels)
        elif opcode == METADATA_INDEX_OP:
            found.metadata.append(_metadata_at(data, Cursor(data, start, end), span[0]))
        elif opcode == STATISTICS_OP and end - start >= _STATISTICS.size:
            n_messages, *_, n_chunks = _STATISTICS.unpack_from(data, start)
    if n_chunks != sum(map(len, chunks.values())) or (n_messages and not n_chunks):
        return None
    parts = [_message_indexes(data, length, np.array(starts)) for length, starts in chunks.items()]
    found.starts = _message_starts(data, np.concatenate(parts), span[0]) if parts else {}
    if n_messages not in (-1, sum(map(len, found.starts.values()))):
        return None
    return found


def _metadata_at(data: memoryview, cursor: Cursor, end: int) -> tuple[str, dict[str, str]]:
    at = cursor.number(U8)
    if at + RECORD > end:
        raise CutError
    opcode, length = START.unpack_from(data, at)
    if opcode != METADATA_OP or at + RECORD + length > end:
        raise CutError
    inner = Cursor(data, at + RECORD, at + RECORD + length)
    return inner.text(), inner.mapping()


def _message_indexes(
    data: memoryview, length: int, starts: npt.NDArray[np.int64],
) -> npt.NDArray[np.int64]:
    """
    Read the chunk index records of one length.

    Returns
    -------
    ndarray of int64, shape (k, 3)
        Channel, where its message index lies, and where the chunk's records begin.

    """
    n_offsets, spare = divmod(length - _CHUNK_INDEX_BYTES, 10)
    if n_offsets < 0 or spare:
        # Nothing else in the record has a variable length but the compression's name.
        _check_uncompressed(data, int(starts[0]), length)
        raise CutError
    table = take(np.frombuffer(data, np.uint8), starts, length).view(np.dtype([
        ('times', '<u8', 2), ('chunk', '<u8'), ('chunk_length', '<u8'), ('n_bytes', '<u4'),
        ('offsets', [('channel', '<u2'), ('at', '<u8')], (n_offsets,)), ('index_length', '<u8'),
        ('n_compression', '<u4'), ('sizes', '<u8', 2)])).reshape(-1)
    if (table['n_bytes'] != 10 * n_offsets).any() or table['n_compression'].any():
        _check_uncompressed(data, int(starts[0]), length)
        raise CutError
    found = np.empty((len(starts), n_offsets, 3), dtype=np.int64)
    found[..., 0] = table['offsets']['channel']
    found[..., 1] = np.minimum(table['offsets']['at'], _FAR)
    # In front of the records stand the chunk's times, size, checksum, compression and length.
    found[..., 2] = np.minimum(table['chunk'], _FAR)[:, np.newaxis] + (RECORD + 40)
    return found.reshape(-1, 3)


def _check_uncompressed(data: memoryview, start: int, length: int) -> None:
    cursor = Cursor(data, start, start + length)
    cursor.raw(32)
    cursor.raw(cursor.number(U4))
    cursor.number(U8)
    compression = cursor.text()
    if compression:
        raise CompressedError(f'its chunks are compressed with {compression[:20]}')


def _message_starts(
    data: memoryview, indexes: npt.NDArray[np.int64], end: int,
) -> dict[int, npt.NDArray[np.int64]]:
    """Read all message index records: where the messages of each channel begin, ascending."""
    if not len(indexes):
        return {}
    buffer = np.frombuffer(data, np.uint8)
    channels, at, base = indexes.T
    if at.min() < len(MAGIC) or at.max() + _INDEX_BYTES > end:
        raise CutError
    heads = take(buffer, at, _INDEX_BYTES).view(np.dtype([
        ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('n_bytes', '<u4')])).reshape(-1)
    n_bytes = heads['n_bytes'].astype(np.int64)
    n_entries = n_bytes // 16
    if ((heads['opcode'] != MESSAGE_INDEX_OP) | (heads['channel'] != channels)).any() or (
            at + _INDEX_BYTES + n_bytes).max() > end or n_bytes.sum() > end:
        raise CutError
    first = np.cumsum(n_entries) - n_entries
    place = np.repeat(at + _INDEX_BYTES - 16 * first, n_entries) + 16 * np.arange(n_entries.sum())
    offsets = np.minimum(take(buffer, place, 16).view('<u8')[:, 1], _FAR).astype(np.int64)
    starts = np.repeat(base, n_entries) + offsets
    owners = np.repeat(channels, n_entries)
    return {int(number): np.sort(starts[owners == number]) for number in np.unique(channels)}


def message_heads(
    data: memoryview, starts: npt.NDArray[np.int64], channels: list[int],
) -> npt.NDArray[np.void] | None:
    """
    Return opcode, length, channel, sequence and times of the messages at ``starts``.

    Parameters
    ----------
    data : memoryview of bytes
        The file.
    starts : ndarray of int64, shape (n,), [bytes]
        Ascending.
    channels : list of int
        To which they must belong.

    Returns
    -------
    structured ndarray, shape (n,), or None
        None if there is no such message at one of the places, or two of them overlap.

    """
    end = len(data)
    if len(starts) and (starts[0] < len(MAGIC) or starts[-1] > end - MESSAGE):
        return None
    heads = take(np.frombuffer(data, np.uint8), starts, MESSAGE).view(_MESSAGE_DTYPE).reshape(-1)
    room = np.diff(starts, append=end) - RECORD
    sound = (heads['opcode'] == MESSAGE_OP) & np.isin(heads['channel'], channels) & (room > 0)
    sound &= (heads['length'] >= MESSAGE - RECORD) & (heads['length'] <= room.astype(np.uint64))
    return heads if sound.all() else None


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
