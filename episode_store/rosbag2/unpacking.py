"""Unpack files, chunks and messages up to a bound: 30 kB of zstd can become 100 GB."""

from bz2 import BZ2Decompressor
from pathlib import Path
import shutil
import sys
import tempfile
from typing import Any, BinaryIO, Final

from rosbags.rosbag2 import reader as rosbags_reader

from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.reader import Bag, MOST_IN_MEMORY, RawMessages
from msgs_bridge.untrusted.files import open_regular

#: Largest chunk or message that is unpacked, [bytes]; recorders write chunks of 1 to 16 MiB.
MOST_OF_A_CHUNK: Final = 2**28
#: Most that a file that was packed, as a whole or in chunks, may come to on the disk, [bytes].
MOST_OF_A_BAG: Final = 2 * 2**30
#: How many times its bytes the chunks of a larger file may become.
_MOST_TIMES: Final = 200
_STEP: Final = 2**20
#: The libraries that rosbags unpacks with, wherever it has them from.
_zstd: Final[Any] = rosbags_reader.zstd  # type: ignore[attr-defined, unused-ignore]
_lz4: Final[Any] = sys.modules['lz4.frame']
_UNPACKERS: Final = {'zstd': _zstd.ZstdDecompressor, 'lz4': _lz4.LZ4FrameDecompressor,
                     'bz2': BZ2Decompressor}
#: Frames that may follow each other in a chunk or a message; recorders write one.
_MOST_FRAMES: Final = 64


def unpack(data: bytes, size: int = MOST_OF_A_CHUNK, kind: str = 'zstd') -> bytes:
    """
    Unpack a chunk or a message.

    Parameters
    ----------
    data : bytes
        Packed.
    size : int, [bytes]
        Its declared size once unpacked; no more is unpacked than that.
    kind : str
        ``zstd``, ``lz4`` or ``bz2``.

    Raises
    ------
    ValueError
        If it becomes larger, or is cut off.

    """
    most = min(size, MOST_OF_A_CHUNK)
    unpacked, rest, n_frames = b'', data, 0
    while rest:
        n_frames += 1
        if n_frames > _MOST_FRAMES:
            raise ValueError(f'{len(data)} packed bytes have more than {_MOST_FRAMES} frames')
        unpacker = _UNPACKERS[kind]()
        # One byte more tells what is too large from what just fits.
        unpacked += bytes(unpacker.decompress(rest, most + 1 - len(unpacked)))
        if len(unpacked) > most:
            raise ValueError(f'{len(data)} packed bytes become more than the {most} they may')
        if not unpacker.eof:
            raise ValueError(f'{len(data)} packed bytes end in the middle')
        rest = unpacker.unused_data
    return unpacked


class Room:
    """
    Counts the bytes that were unpacked.

    Parameters
    ----------
    most : int, optional, [bytes]
        Most that they may come to; that of a whole bag by default.

    """

    def __init__(self, most: int | None = None) -> None:
        self._most = MOST_OF_A_BAG if most is None else most
        self._used = 0

    def take(self, n_bytes: int) -> None:
        """Count more bytes; BagError if they become too many."""
        self._used += n_bytes
        if self._used > self._most:
            raise BagError(f'unpacked it has more than {self._most} bytes')


def room_for_chunks(n_packed: int) -> Room:
    """Return the room for all chunks of a file of so many bytes, one after the other."""
    return Room(max(MOST_OF_A_BAG, _MOST_TIMES * n_packed))


class UnpackedMessages(Bag):
    """
    A bag whose messages are compressed one by one, which only ``metadata.yaml`` tells.

    Parameters
    ----------
    packed : Bag

    """

    def __init__(self, packed: Bag) -> None:
        self._packed, self.path = packed, packed.path
        self.topics, self.counts, self.notes = packed.topics, packed.counts, packed.notes
        self.damage, self.complete = packed.damage, packed.complete
        self.recorded = packed.recorded

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; BagError if one cannot be unpacked."""
        found, room = self._packed.messages(topic), Room(MOST_IN_MEMORY)
        unpacked = []
        # What decompressors raise is of many types.
        try:
            for message in found:
                unpacked.append(unpack(message))
                room.take(len(unpacked[-1]))
        except Exception as error:
            raise BagError(f'cannot read {self.path}: a message of {topic} cannot be unpacked: '
                           f'{error}') from None
        return RawMessages.of(topic, found.type_name, unpacked, found.log_times.tolist())


def unpack_file(path: Path, folder: Path) -> Path:
    """
    Unpack a file that was packed as a whole, ``x.mcap.zstd``, into a folder.

    Raises
    ------
    BagError
        If it is no regular file, cannot be unpacked, or becomes too large, which is found before
        a byte of it is written.

    """
    try:
        with open_regular(path) as packed:
            n_bytes = _unpacked_size(path, packed)
            free = shutil.disk_usage(folder).free
            if n_bytes > free:
                raise BagError(f'cannot read {path}: unpacked it has {n_bytes} bytes, in '
                               f'{tempfile.gettempdir()} {free} are free')
            packed.seek(0)
            with _zstd.open(packed, 'rb') as file, (folder / path.stem).open('wb') as copy:
                shutil.copyfileobj(file, copy, _STEP)
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
    return folder / path.stem


def _unpacked_size(path: Path, packed: BinaryIO) -> int:
    n_bytes = 0
    try:
        with _zstd.open(packed, 'rb') as file:
            while part := file.read(_STEP):
                n_bytes += len(part)
                if n_bytes > MOST_OF_A_BAG:
                    raise BagError(
                        f'cannot read {path}: unpacked it has more than {MOST_OF_A_BAG} bytes; '
                        f'unpack it with `zstd -d` if that is meant')
    except (EOFError, _zstd.ZstdError) as error:
        raise BagError(f'cannot read {path}: it cannot be unpacked: {error}') from None
    return n_bytes
