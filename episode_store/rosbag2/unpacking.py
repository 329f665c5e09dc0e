"""
Unpacking what others packed, up to a bound: 30 kB of zstd can become 100 GB.

`rosbags`, which reads packed bags, knows no bounds; importing this module gives it some.
"""

from collections.abc import Iterable
from pathlib import Path
import shutil
import sys
import tempfile
from typing import Any, BinaryIO, Final

from rosbags.rosbag2 import reader as rosbags_reader
from rosbags.rosbag2 import storage_mcap

from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.reader import MOST_IN_MEMORY
from msgs_bridge.untrusted.files import open_regular

#: Largest chunk or message that is unpacked, [bytes]; recorders write chunks of 1 to 16 MiB.
MOST_OF_A_CHUNK: Final = 2**28
#: Most that a file that was packed, as a whole or in chunks, may come to on the disk, [bytes].
MOST_OF_A_BAG: Final = 2 * 2**30
_STEP: Final = 2**20
#: What rosbags itself unpacks with, wherever it has it from.
_zstd: Final[Any] = rosbags_reader.zstd  # type: ignore[attr-defined, unused-ignore]
_lz4: Final[Any] = sys.modules['lz4.frame']


def unpack(data: bytes, size: int = MOST_OF_A_CHUNK, kind: str = 'zstd') -> bytes:
    """
    Unpack a chunk or a message.

    Parameters
    ----------
    data : bytes
        Packed.
    size : int, [bytes]
        What it says it becomes; of what it really becomes no more is unpacked.
    kind : str
        ``zstd`` or ``lz4``.

    Raises
    ------
    ValueError
        If it becomes more, or it ends in the middle.

    """
    most = min(size, MOST_OF_A_CHUNK)
    unpacked, rest = b'', data
    while rest:
        unpacker = _zstd.ZstdDecompressor() if kind == 'zstd' else _lz4.LZ4FrameDecompressor()
        # One byte more tells what is too large from what just fits.
        unpacked += bytes(unpacker.decompress(rest, most + 1 - len(unpacked)))
        if len(unpacked) > most:
            raise ValueError(f'{len(data)} packed bytes become more than the {most} they may')
        if not unpacker.eof:
            raise ValueError(f'{len(data)} packed bytes end in the middle')
        rest = unpacker.unused_data
    return unpacked


storage_mcap.DECOMPRESSORS['zstd'] = unpack
storage_mcap.DECOMPRESSORS['lz4'] = lambda data, size: unpack(data, size, 'lz4')


def unpack_all(messages: Iterable[bytes]) -> list[bytes]:
    """Unpack messages that were packed one by one; ValueError if that becomes too much."""
    unpacked: list[bytes] = []
    room = Room(MOST_IN_MEMORY)
    for message in messages:
        unpacked.append(unpack(message))
        room.take(len(unpacked[-1]))
    return unpacked


class Room:
    """
    Counts what was unpacked.

    Parameters
    ----------
    most : int, optional, [bytes]
        That it may come to; that of a whole bag by default.

    """

    def __init__(self, most: int | None = None) -> None:
        self._most = MOST_OF_A_BAG if most is None else most
        self._used = 0

    def take(self, n_bytes: int) -> None:
        """Take in that more was unpacked; BagError if that is too much."""
        self._used += n_bytes
        if self._used > self._most:
            raise BagError(f'unpacked it has more than {self._most} bytes')


def check_packed(path: Path) -> None:
    """
    Count what a file that was packed as a whole becomes, before a byte of it is kept.

    Parameters
    ----------
    path : Path
        Any file of a bag; what does not end in ``.zstd`` is only looked at.

    Raises
    ------
    BagError
        If it is no regular file, cannot be unpacked, or becomes too much.

    """
    try:
        with open_regular(path) as packed:
            n_bytes = _unpacked_size(path, packed) if path.suffix == '.zstd' else 0
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
    free = shutil.disk_usage(tempfile.gettempdir()).free
    if n_bytes > free:
        raise BagError(f'cannot read {path}: unpacked it has {n_bytes} bytes, in '
                       f'{tempfile.gettempdir()} {free} are free')


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
