"""Opening any bag, whoever recorded it: one file or several, with or without its metadata."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import re
from typing import Final

import numpy as np

from msgs_bridge.bag_folder import BagError
from msgs_bridge.bag_metadata import NAME, read_yaml
from msgs_bridge.bag_records import Bag, BagReader, RawMessages
from msgs_bridge.mcap_scan import CompressedError, MAGIC

_ENDINGS: Final = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')
#: rosbag2 compresses messages one by one, or whole files; neither shows in the MCAP file.
_COMPRESSED: Final = re.compile(r'^ *compression_mode: *["\']?(message|file)\b', re.I | re.M)


def open_bag(path: Path | str) -> Bag:
    """
    Open any bag for reading raw messages: ours and other uncompressed MCAP files directly.

    Parameters
    ----------
    path : Path
        A file, or a folder with ``metadata.yaml``; without it, all files in the folder are read.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    path = Path(path)
    bag = _open_folder(path) if path.is_dir() else _open_file(path)
    _check_begun(bag)
    return bag


def missing_from(bag: Bag) -> str:
    """Say that not all of a bag is there; empty for a whole one."""
    for part in _cut_parts(bag):
        return f'what is not readable of {part.path.name} is missing: {part.damage}'
    return ''


def storage_files(folder: Path) -> list[Path]:
    """Return the files in a folder that hold messages, in the order of their numbers."""
    return sorted((path for path in folder.iterdir() if is_storage_file(path)), key=_by_number)


def is_storage_file(path: Path) -> bool:
    """Tell whether a file holds messages, by its name."""
    return path.name.endswith(_ENDINGS)


class JoinedBag:
    """
    The files of a bag whose ``metadata.yaml`` is missing, read as one.

    Parameters
    ----------
    path : Path
        The folder.
    parts : sequence of Bag
        In the order they were recorded.

    """

    def __init__(self, path: Path, parts: Sequence[Bag]) -> None:
        self.path = path
        self.parts = parts

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return {topic: kind for part in reversed(self.parts)
                for topic, kind in part.topics.items()}

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the bag."""
        tables = [part.messages(topic) for part in self.parts if topic in part.topics]
        none = np.zeros(0, dtype=np.int64)
        times = np.concatenate([none, *(table.log_times for table in tables)])
        return RawMessages.of(
            topic, self.topics.get(topic, ''), [message for table in tables for message in table],
            times.tolist())


class InLogOrder:
    """
    A bag whose messages come as they were received, in whatever order the file holds them.

    Parameters
    ----------
    bag : Bag

    """

    def __init__(self, bag: Bag) -> None:
        self.path = bag.path
        self._bag = bag

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return self._bag.topics

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the bag."""
        found = self._bag.messages(topic)
        order = np.argsort(found.log_times, kind='stable')
        return replace(found, starts=found.starts[order], sizes=found.sizes[order],
                       log_times=found.log_times[order])


def _cut_parts(bag: Bag) -> list[BagReader]:
    parts = bag.parts if isinstance(bag, JoinedBag) else [bag]
    return [part for part in parts if isinstance(part, BagReader) and not part.complete]


def _check_begun(bag: Bag) -> None:
    """Refuse a bag that was cut before it told of any topic."""
    for part in [] if bag.topics else _cut_parts(bag):
        is_void = part.path.stat().st_size == 0
        raise BagError(f'cannot read {part.path}: ' + (
            part.damage if is_void else f'it is cut off before its first topic: {part.damage}'))


def _open_folder(path: Path) -> Bag:
    files = storage_files(path)
    text = _metadata_text(path)
    is_plain = not _COMPRESSED.search(text)
    if is_plain and [file.suffix for file in files] == ['.mcap']:
        return _open_file(files[0])
    if isinstance(read_yaml(text), dict):
        try:
            return _open_foreign(path)
        except BagError:
            # rosbags opens all files or none, so one that is cut takes the others away.
            if not (is_plain and any(map(_is_cut, files))):
                raise
    if not files:
        raise BagError(f'cannot read {path}: there is no .mcap and no .db3 file in it')
    return JoinedBag(path, [_open_file(file) for file in files])


def _is_cut(path: Path) -> bool:
    """Tell whether an MCAP file does not end like one that was closed."""
    if path.suffix != '.mcap' or not path.is_file():
        return False
    with path.open('rb') as file:
        file.seek(max(file.seek(0, 2) - len(MAGIC), 0))
        return file.read() != MAGIC


def _open_file(path: Path) -> Bag:
    if path.exists() and not path.is_file():
        raise BagError(f'cannot read {path}: it is no regular file')
    if _is_compressed_whole(path):
        # Only the folder says how.
        return _open_foreign(path.parent)
    if path.suffix == '.mcap':
        try:
            return BagReader(path)
        except CompressedError:
            # Slow to import, and most bags are ours.
            from msgs_bridge.foreign_bag import check_sizes, CutBag

            check_sizes(path)
            if _is_cut(path):
                return CutBag(path)
    return _open_foreign(path)


def _is_compressed_whole(path: Path) -> bool:
    """Tell whether a file is all there is of a bag whose ``metadata.yaml`` says: compressed."""
    text = _metadata_text(path.parent)
    return bool(_COMPRESSED.search(text)) and isinstance(read_yaml(text), dict) and (
        storage_files(path.parent) == [path])


def _open_foreign(path: Path) -> Bag:
    # Slow to import, and most bags are ours.
    from msgs_bridge.foreign_bag import ForeignBag

    return ForeignBag(path)


def _metadata_text(path: Path) -> str:
    try:
        return (path / NAME).read_text(errors='replace')
    except OSError:
        return ''


def _by_number(path: Path) -> list[str | int]:
    """Return what sorts the tenth file behind the ninth."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)]
