"""Making bags beside their places, which they take together once all of them are whole."""

from collections.abc import Mapping
from contextlib import suppress
import os
from pathlib import Path
import shutil

from episode_store.lock import MAKING
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import episode_from_path, EpisodeFolder, EpisodeKind, TaskFolder
from msgs_bridge.untrusted.files import sync_folder


class NewBags:
    """
    Bags of a task in the making; a context, at whose end goes what was not kept.

    They are made in a hidden folder, which no reader takes for bags. However the process ends,
    there are whole bags in the task's folder or none; whoever holds the folder next clears up.

    Parameters
    ----------
    task : TaskFolder
        Its folder is held by this process, see `task_folder.changing`.

    """

    def __init__(self, task: TaskFolder) -> None:
        self._task = task
        self._folder = task.path / f'{MAKING}{os.urandom(4).hex()}'
        self._writers: list[BagWriter] = []

    def __enter__(self) -> 'NewBags':
        """Return it."""
        return self

    def __exit__(self, *error: object) -> None:
        """Remove what was not kept."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def begin(self, kind: EpisodeKind, header: Mapping[str, str]) -> BagWriter:
        """
        Begin the next bag.

        Raises
        ------
        BagError
            If it cannot be made.

        """
        number = self._next_number() + len(self._writers)
        path = self._folder / f'{number:04d}_{kind}'
        try:
            path.mkdir(parents=True)
        except OSError as error:
            raise BagError(error_line('make a bag in', self._task.path, error)) from None
        writer = BagWriter(path, header)
        self._writers.append(writer)
        return writer

    def keep(self) -> list[EpisodeFolder]:
        """
        Finish the bags, and let them take their places.

        Raises
        ------
        BagError
            If one cannot be finished; then none of them is there. Or if a place was taken
            meanwhile, or a bag cannot be moved.

        """
        for writer in self._writers:
            writer.close()
        return [self._place(writer.folder) for writer in self._writers]

    def _next_number(self) -> int:
        numbers = [episode.number for episode in self._all()]
        return max(numbers, default=0) + 1

    def _all(self) -> list[EpisodeFolder]:
        return [*self._task.episodes(), *self._task.forgotten()]

    def _place(self, folder: Path) -> EpisodeFolder:
        path = self._task.path / folder.name
        episode = episode_from_path(path)
        if any(other.number == episode.number for other in self._all()):
            raise BagError(f'there is a bag {episode.number:04d} in {self._task.path} already')
        try:
            folder.rename(path)
            sync_folder(self._task.path)
        except OSError as error:
            raise BagError(error_line('make', path, error)) from None
        return episode


def start_bag(task: TaskFolder, kind: EpisodeKind | str, header: Mapping[str, str]) -> BagWriter:
    """
    Begin the next bag of a task; if that fails, no folder is left behind.

    Raises
    ------
    BagError
        If it cannot be made.

    """
    episode = task.new_episode(kind)
    try:
        return BagWriter(episode.path, header)
    except BagError:
        with suppress(OSError):
            episode.bag.unlink(missing_ok=True)
            episode.path.rmdir()
        raise
