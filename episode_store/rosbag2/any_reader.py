"""Open any bag, whoever recorded it: one file or several, with or without its metadata."""

from collections.abc import Iterator, Sequence
from pathlib import Path
import shutil
import weakref

import numpy as np

from episode_store.rosbag2.bag_files import (
    BagFiles, differing_count, files_of_file, files_of_folder)
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.mcap_scan import CompressedError
from episode_store.rosbag2.reader import Bag, BagReader, MOST_IN_MEMORY, RawMessages
from episode_store.rosbag2.sqlite_recovery import folder_kept_if_well
from msgs_bridge.untrusted.files import open_regular


def open_bag(path: Path | str) -> Bag:
    """
    Open any bag for reading its raw messages.

    Parameters
    ----------
    path : Path
        A file, or a folder. Without ``metadata.yaml`` all files in the folder are read.

    Raises
    ------
    BagError
        If it cannot be read, or part of the drive is certainly missing.

    """
    path = Path(path)
    try:
        files = files_of_folder(path) if path.is_dir() else files_of_file(path)
        # A file that a person names may be a link; files in a folder must not lead out of it.
        within = path if path.is_dir() else None
        parts = [_open_part(file, files, within) for file in files.paths]
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
    notes = [*files.notes, *(note for part in parts for note in part.notes)]
    if files.is_all and not any(part.missing for part in parts):
        notes += filter(None, [differing_count(files, _count(parts))])
    bag = parts[0] if len(parts) == 1 and not notes else JoinedBag(path, parts, notes)
    if not bag.topics:
        _check_begun(parts)
    return bag


def notes_on(bag: Bag) -> tuple[str, ...]:
    """Return sentences on what was not read of a bag, or was read from another file."""
    return (*bag.notes, *filter(None, [bag.missing]))


class JoinedBag(Bag):
    """
    The files of a bag, read as one.

    Parameters
    ----------
    path : Path
        The folder.
    parts : sequence of Bag
        In the order in which they were recorded.
    notes : sequence of str
        Sentences on how they were found.

    """

    def __init__(self, path: Path, parts: Sequence[Bag], notes: Sequence[str] = ()) -> None:
        self.path = path
        self.parts = parts
        self.notes = tuple(notes)
        self.topics = {topic: kind for part in reversed(parts)
                       for topic, kind in part.topics.items()}
        self.counts = {topic: sum(part.counts.get(topic, 0) for part in parts)
                       for topic in self.topics}

    @property
    def recorded(self) -> tuple[int, int] | None:  # type: ignore[override]
        """Return when the first and the last message were received, [ns]."""
        times = [part.recorded for part in self.parts if part.recorded is not None]
        if not times:
            return None
        return min(first for first, _ in times), max(last for _, last in times)

    @property
    def missing(self) -> str:
        """Return a sentence if part of one of the files is missing."""
        return next(filter(None, (part.missing for part in self.parts)), '')

    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic; none if it is not in the bag.

        Raises
        ------
        BagError
            If one of the files cannot be read, or they are too large once unpacked.

        """
        if len(self.parts) == 1:
            return self.parts[0].messages(topic)
        tables = list(self._tables(topic))
        none = np.zeros(0, dtype=np.int64)
        times = np.concatenate([none, *(table.log_times for table in tables)])
        return RawMessages.of(
            topic, self.topics.get(topic, ''), [message for table in tables for message in table],
            times.tolist())

    def _tables(self, topic: str) -> Iterator[RawMessages]:
        """Yield the messages of each file; all together have the same bound as one file."""
        n_unpacked = 0
        for part in self.parts:
            if topic in part.topics:
                yield (found := part.messages(topic))
                n_unpacked += 0 if isinstance(part, BagReader) else int(found.sizes.sum())
                if n_unpacked > MOST_IN_MEMORY:
                    raise BagError(f'cannot read {self.path}: unpacked, {topic} has more than '
                                   f'{MOST_IN_MEMORY} bytes')


def _check_begun(parts: Sequence[Bag]) -> None:
    """Refuse files without a topic of which one is cut off before its first."""
    for part in parts:
        if not part.complete:
            where = 'it is cut off before its first topic: ' if part.path.stat().st_size else ''
            raise BagError(f'cannot read {part.path}: {where}{part.damage}')


def _count(parts: Sequence[Bag]) -> int:
    return sum(sum(part.counts.values()) for part in parts)


def _open_part(path: Path, files: BagFiles, within: Path | None) -> Bag:
    """Open one of a bag's files."""
    if not path.exists():
        raise BagError(f'cannot read {path}: there is no such bag')
    open_regular(path, within).close()
    part = _open_file(path)
    if files.description is None or files.description.compression != 'message':
        return part
    from episode_store.rosbag2.unpacking import UnpackedMessages

    return UnpackedMessages(part)


def _open_file(path: Path, where: Path | None = None) -> Bag:
    """Open a file, or a copy of it that is read in its place."""
    name = (where or path).name
    if name.endswith(('.bag', '.bag.active')):
        # Slow to import, like what follows, and most bags are ours.
        from episode_store.rosbag2.ros1_reader import Ros1Bag

        return Ros1Bag(path)
    if name.endswith('.zstd'):
        from episode_store.rosbag2.unpacking import unpack_file

        with folder_kept_if_well() as folder:
            bag = _open_file(path, unpack_file(path, folder))
        weakref.finalize(bag, shutil.rmtree, folder, ignore_errors=True)
        return bag
    if name.endswith('.mcap'):
        try:
            return BagReader(path, follow=True, where=where)
        except CompressedError:
            from episode_store.rosbag2.packed_mcap import PackedMcap

            return PackedMcap(path, where)
    from episode_store.rosbag2.sqlite_reader import SqliteBag

    return SqliteBag(path, where)
