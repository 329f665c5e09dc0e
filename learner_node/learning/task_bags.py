"""The bags of a task as files: which there are, one by its name, all set aside."""

from episode_store.errors import NothingThereError
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.task_folder import EpisodeFolder, TaskFolder
from episode_store.undo import names_of, take_away, UNDO
from msgs_bridge.untrusted.files import draft_beside
from msgs_bridge.untrusted.text import printable


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


def counts_of(task: TaskFolder) -> dict[str, str]:
    """Return how many bags there are, and whether any was taken away, for diagnostics."""
    return {'episodes': str(len(task.episodes())),
            'can_undo': str(bool(task.forgotten())).lower()}


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
