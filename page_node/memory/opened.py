"""Bags that are open in the working process: found by their names, read again when they change."""

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
import re
from typing import Final, NamedTuple

from episode_store.episode import Episode
from episode_store.errors import NoSuchMomentError, NothingToLearnError
from episode_store.lock import is_in_use
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.metadata import NAME
from episode_store.task_folder import EpisodeFolder, TaskFolder
from page_node.refusal import RefusedError

#: So many stay open: whoever has seen the list finds the newest ones read.
MOST_OPEN: Final = 32
_NUMBER: Final = re.compile(r'[0-9]{1,8}')


class BagState(NamedTuple):
    """What tells whether a bag is still as it was."""

    recording: tuple[int, int, int] | None
    description: tuple[int, int, int] | None
    is_busy: bool

    @classmethod
    def of(cls, folder: EpisodeFolder) -> 'BagState':
        """Look at the files of a bag."""
        recording, description = _stat(folder.bag), _stat(folder.path / NAME)
        return cls(recording, description,
                   description is None and is_in_use(folder.task_path))


def _stat(path: Path) -> tuple[int, int, int] | None:
    try:
        about = path.stat()
    except OSError:
        return None
    return about.st_ino, about.st_size, about.st_mtime_ns


def task_of(bags: str, task: str) -> TaskFolder:
    """Return the folder of a task; `RefusedError` if there cannot be one of that name."""
    try:
        return TaskFolder(bags, task)
    except BagError as error:
        raise RefusedError('no_task', str(error)) from None


def folders_of(task: TaskFolder) -> list[EpisodeFolder]:
    """Return all bags of a task by number, forgotten ones among them."""
    try:
        return sorted([*task.episodes(), *task.forgotten()])
    except BagError as error:
        raise RefusedError('folder', str(error), 409) from None


def counts_of(folders: Iterable[EpisodeFolder]) -> dict[EpisodeFolder, int]:
    """
    Return which drive or which try each bag is, from 1: people count the two apart.

    Parameters
    ----------
    folders : iterable of EpisodeFolder
        All of a task, by number.

    """
    counted: Counter[str] = Counter()
    counts = {}
    for folder in folders:
        counted[folder.kind] += 1
        counts[folder] = counted[folder.kind]
    return counts


def folder_of(bags: str, task: str, number: str) -> EpisodeFolder:
    """
    Return the folder of a bag.

    Raises
    ------
    RefusedError
        If there is none (``gone``), or the names cannot be those of one.

    """
    found = task_of(bags, task)
    if _NUMBER.fullmatch(number) is not None:
        for folder in folders_of(found):
            if folder.number == int(number):
                return folder
    raise RefusedError('gone', f'there is no bag {number[:20]} in {found.path}')


@contextmanager
def reading(bags: str, task: str, number: str) -> Iterator[Episode]:
    """
    Open a bag; a mistake in it is refused in a way that a person can be told.

    Raises
    ------
    RefusedError
        ``gone``, ``nothing`` (it holds no drive), ``no_moment``, or ``unreadable``.

    """
    folder = folder_of(bags, task, number)
    try:
        yield opened(folder, BagState.of(folder))
    except NoSuchMomentError as error:
        raise RefusedError('no_moment', str(error)) from None
    except NothingToLearnError as error:
        raise RefusedError('nothing', str(error), 409) from None
    except (BagError, OSError) as error:
        code = 'unreadable' if folder.path.is_dir() else 'gone'
        raise RefusedError(code, str(error), 409) from None


@lru_cache(MOST_OPEN)
def opened(folder: EpisodeFolder, state: BagState) -> Episode:
    """Return a bag in a state; the same one while it is among the last that were asked for."""
    return Episode(folder)
