"""
The folders that bags live in: ``bags/<task>/<NNNN>_<demo|trial>/``.

Nothing here reads a bag; it names, numbers and lists them.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
import os
from pathlib import Path
import re
import shutil
from typing import Final

from episode_store.lock import hold, let_go, numbering, REMOVED
from episode_store.rosbag2.errors import BagError, error_line, mcap_path
from msgs_bridge.node.close_names import close_name
from msgs_bridge.untrusted.files import check_folder

_TASK: Final = re.compile(r'[A-Za-z0-9_-]{1,64}')
_EPISODE: Final = re.compile(r'(\d{4,8})_(demo|trial)')
#: Folder within a task's folder for the bags that were forgotten.
FORGOTTEN: Final = '.forgotten'
#: Ending of the whole recording beside one that was cut; no reader takes it for a bag.
_WHOLE: Final = '.whole'
#: What a person does about the name of a learner's task that may be a slip of the keys.
_REMEDY: Final = 'set task:={}, or new_task:=true if a new one is meant'


class EpisodeKind(StrEnum):
    """What a bag holds."""

    DEMO = 'demo'
    TRIAL = 'trial'


@dataclass(frozen=True, order=True)
class EpisodeFolder:
    """
    The folder of one bag.

    Parameters
    ----------
    number : int
        From 1, counting demonstrations and trials together.
    kind : EpisodeKind
        What the bag holds.
    path : Path
        Where it is.

    """

    number: int
    kind: EpisodeKind
    path: Path

    @property
    def bag(self) -> Path:
        """Return where its MCAP file is."""
        return mcap_path(self.path)

    @property
    def whole(self) -> Path:
        """Return where the whole recording is kept once the bag was cut."""
        return self.bag.with_name(self.bag.name + _WHOLE)

    @property
    def name(self) -> str:
        """Return task and number as people type them: ``task1/0003``."""
        return f'{self.task_path.name}/{self.number:04d}'

    @property
    def task_path(self) -> Path:
        """Return the folder of its task."""
        return self.path.parent.parent if self.is_forgotten else self.path.parent

    @property
    def task(self) -> 'TaskFolder':
        """Return its task."""
        return TaskFolder(self.task_path.parent, self.task_path.name)

    @property
    def is_forgotten(self) -> bool:
        """Return True if the bag was taken out of the memory."""
        return self.path.parent.name == FORGOTTEN


def check_task_name(task: str) -> str:
    """
    Return a task's name if it can be a folder's.

    Raises
    ------
    BagError
        If it holds anything but letters, digits, ``_`` and ``-``, or is empty or above 64 long.

    """
    if not isinstance(task, str) or _TASK.fullmatch(task) is None:
        raise BagError(f'task is {task!r}, must be 1 to 64 letters, digits, _ or -')
    return task


def episode_from_path(path: Path) -> EpisodeFolder:
    """
    Return number and kind of a bag's folder, from its name.

    Raises
    ------
    BagError
        If it is not named like ``0001_demo``.

    """
    path = Path(path)
    match = _EPISODE.fullmatch(path.name)
    if match is None:
        raise BagError(f'{path} is no bag of ours, must be named like 0001_demo or 0002_trial')
    return EpisodeFolder(int(match[1]), EpisodeKind(match[2]), path)


def is_named_like_own(folder: Path) -> bool:
    """Return whether a folder is named like that of a bag of ours."""
    try:
        episode_from_path(folder.absolute())
    except BagError:
        return False
    return True


class TaskFolder:
    """
    All bags of one task.

    Parameters
    ----------
    root : Path
        The bags folder; nothing outside it is touched.
    task : str
        Name of the task, see `check_task_name`.

    Raises
    ------
    BagError
        If the name is none, or leads out of ``root``.

    """

    def __init__(self, root: Path | str, task: str) -> None:
        self.root = Path(root)
        self.task = check_task_name(task)
        self.path = self.root / task
        self._held: int | None = None
        if _leads_out(self.root, task):
            raise BagError(f'{self.path} leads out of {self.root}')

    def hold(self) -> None:
        """
        Keep the folder to this process until that ends, however it ends.

        Once it was set aside it has to be held anew: the lock goes with the old folder.

        Raises
        ------
        BagError
            If another process holds it, or the folder cannot be written.

        """
        held = hold(self.path)
        if self._held is not None:
            os.close(self._held)
        self._held = held

    def release(self) -> None:
        """Give the folder up, if this process holds it."""
        held, self._held = self._held, None
        if held is not None:
            let_go(self.path, held)

    def episodes(self) -> list[EpisodeFolder]:
        """
        Return the bags there are, by number; other files and folders are passed over.

        Raises
        ------
        BagError
            If the folder cannot be read, or two bags have the same number.

        """
        return _episodes_in(self.path)

    def forgotten(self) -> list[EpisodeFolder]:
        """
        Return the bags that were forgotten, by number.

        Raises
        ------
        BagError
            If the folder cannot be read.

        """
        folder = self.path / FORGOTTEN
        try:
            check_folder(folder)
        except OSError as error:
            raise BagError(error_line('use', folder, error)) from None
        return _episodes_in(folder)

    def check_is_meant(self, remedy: str = _REMEDY) -> None:
        """
        Refuse a task without bags whose name is close to that of one with bags.

        Parameters
        ----------
        remedy : str
            What a person does; ``{}`` stands for the name that may have been meant.

        Raises
        ------
        ValueError
            With the name that may have been meant.

        """
        try:
            is_old = self.episodes() or self.forgotten()
            meant = None if is_old else close_name(self.task, tasks(self.root))
        except BagError:
            return  # whoever records into it says so
        if meant is not None:
            raise ValueError(f'there is no task {self.task} in {self.root} yet, but {meant}: '
                             + remedy.format(meant))

    def find(self, number: int) -> EpisodeFolder:
        """
        Return the bag of a number.

        Raises
        ------
        BagError
            If there is none.

        """
        for episode in self.episodes():
            if episode.number == number:
                return episode
        raise BagError(f'there is no bag {number:04d} in {self.path}')

    def new_episode(self, kind: EpisodeKind | str) -> EpisodeFolder:
        """
        Make the folder of the next bag; no other process gets the same number.

        Parameters
        ----------
        kind : EpisodeKind or str
            What it will hold.

        Raises
        ------
        BagError
            If it cannot be made: no permission, read-only, disk full.

        """
        kind = EpisodeKind(kind)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            with numbering(self.path):
                taken = [*self.episodes(), *self.forgotten()]
                number = max((episode.number for episode in taken), default=0) + 1
                path = self.path / f'{number:04d}_{kind}'
                path.mkdir()
        except OSError as error:
            raise BagError(error_line('make a bag in', self.path, error)) from None
        return EpisodeFolder(number, kind, path)

    def remove(self, number: int) -> None:
        """
        Remove a bag, at once or not at all.

        What cannot be deleted of it is no bag any more; whoever holds the folder next tries again.

        Raises
        ------
        BagError
            If there is none of that number, or it cannot be removed.

        """
        episode = self.find(number)
        bin_path = self.path / f'{REMOVED}{episode.path.name}-{os.urandom(4).hex()}'
        try:
            episode.path.rename(bin_path)
        except OSError as error:
            raise BagError(error_line('remove', episode.path, error)) from None
        shutil.rmtree(bin_path, ignore_errors=True)

    def forget(self, number: int) -> EpisodeFolder:
        """
        Take a bag out of the memory; its number stays its own, so that it can be recalled.

        Raises
        ------
        BagError
            If there is none of that number, or it cannot be moved.

        """
        return self._move(self.find(number), self.path / FORGOTTEN, 'forget')

    def recall(self, number: int) -> EpisodeFolder:
        """
        Put a bag that was forgotten back to where it was.

        Raises
        ------
        BagError
            If none of that number was forgotten, its place is taken, or it cannot be moved.

        """
        for episode in self.forgotten():
            if episode.number == number:
                return self._move(episode, self.path, 'recall')
        raise BagError(f'no bag {number:04d} of {self.path} was forgotten')

    def _move(self, episode: EpisodeFolder, folder: Path, action: str) -> EpisodeFolder:
        path = folder / episode.path.name
        try:
            with numbering(self.path):
                check_folder(folder)
                folder.mkdir(exist_ok=True)
                if any(other.number == episode.number for other in _episodes_in(folder)):
                    raise BagError(f'there is a bag {episode.number:04d} in {folder} already')
                episode.path.rename(path)
        except OSError as error:
            raise BagError(error_line(action, episode.path, error)) from None
        return EpisodeFolder(episode.number, episode.kind, path)


def _episodes_in(folder: Path) -> list[EpisodeFolder]:
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except FileNotFoundError:
        return []
    except OSError as error:
        raise BagError(error_line('read', folder, error)) from None
    found = sorted(
        episode_from_path(Path(entry.path)) for entry in entries
        if _EPISODE.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False))
    for first, second in pairwise(found):
        if first.number == second.number:
            raise BagError(f'{first.path} and {second.path} have the same number')
    return found


def tasks(root: Path | str) -> list[str]:
    """Return the names of the tasks in a bags folder that have a bag; no links that lead out."""
    return [task.task for task in task_folders(root) if task.episodes()]


def task_folders(root: Path | str) -> list[TaskFolder]:
    """Return the folders in a bags folder that may be a task's, by name, with bags or without."""
    try:
        entries = sorted(entry.name for entry in os.scandir(root) if entry.is_dir())
    except FileNotFoundError:
        return []
    except OSError as error:
        raise BagError(error_line('read', Path(root), error)) from None
    return [TaskFolder(root, name) for name in entries
            if _TASK.fullmatch(name) and not _leads_out(Path(root), name)]


def _leads_out(root: Path, name: str) -> bool:
    return (root / name).resolve().parent != root.resolve()
