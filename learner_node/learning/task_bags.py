"""The bags of a task as files: which there are, one by its name, all set aside."""

from contextlib import suppress
from pathlib import Path
import time
from typing import Final

from episode_store.errors import NothingThereError
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.task_folder import EpisodeFolder, FORGOTTEN, TaskFolder
from episode_store.undo import names_of, take_away, UNDO
from msgs_bridge.untrusted.files import draft_beside
from msgs_bridge.untrusted.text import printable

#: A folder that has not changed for so long is read no more, [s].
_SETTLED: Final = 2.0


def bag_named(task: TaskFolder, name: str) -> EpisodeFolder:
    """
    Return the bag of a name such as ``0001_demo``, or the newest where that is empty.

    Raises
    ------
    NothingThereError
        If there is none.

    """
    episodes = task.episodes()
    if not name and episodes:
        return episodes[-1]
    found = [episode for episode in episodes if episode.path.name == name]
    if not found:
        which = f'no bag {printable(name, 40)}' if name else 'no bag'
        raise NothingThereError(f'there is {which} in {task.path}')
    return found[0]


class BagCounts:
    """How many bags a task has; the folder is read again only where it has changed."""

    def __init__(self) -> None:
        """Start with nothing counted."""
        self._counts: dict[str, str] = {}
        self._counted: tuple[Path, list[float]] | None = None

    def of(self, task: TaskFolder) -> dict[str, str]:
        """Return how many bags there are, and whether any was taken away, for diagnostics."""
        stamps = [_changed_at(folder) for folder in (task.path, task.path / FORGOTTEN)]
        # What changed just now may change again within the same stamp.
        if (task.path, stamps) != self._counted or max(stamps) > time.time() - _SETTLED:
            with suppress(BagError):  # who changes bags is told so
                self._counts = {'episodes': str(len(task.episodes())),
                                'can_undo': str(bool(task.forgotten())).lower()}
                self._counted = task.path, stamps
        return self._counts


def _changed_at(folder: Path) -> float:
    """Return when entries of a folder have changed, [s]; 0 where there is none."""
    try:
        return folder.stat().st_mtime
    except OSError:
        return 0.0


def set_aside(task: TaskFolder) -> str:
    """
    Take all bags of a task away, so that it begins anew; return what to tell people.

    Raises
    ------
    BagError
        If they cannot be moved.

    """
    aside = take_away(task, [episode.number for episode in task.episodes()])
    if not aside:
        return ''
    return (f'fresh: {names_of(aside)} {"is" if len(aside) == 1 else "are"} set aside in '
            f'{aside[0].path.parent} ({UNDO})')


def check_writable(task: TaskFolder) -> None:
    """Raise BagError if nothing can be written into the folder of a task."""
    probe = task.path / '.writable'
    try:
        task.path.mkdir(parents=True, exist_ok=True)
        with draft_beside(probe) as draft:
            draft.touch()
    except OSError as error:
        raise BagError(error_line('record into', task.path, error)
                       + '; set the parameter bags to a folder that can be written') from None
