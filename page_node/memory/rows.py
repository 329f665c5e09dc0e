"""The list of what the robot remembers: every drive and trial in a row."""

from collections import OrderedDict
from contextlib import suppress
from datetime import datetime, UTC
import os
from pathlib import Path
import time
from typing import Any, Final
from zlib import crc32

from episode_store.episode import Episode
from episode_store.rosbag2.bag_files import is_storage_file, storage_files
from episode_store.rosbag2.errors import BagError
from episode_store.summary import Summary, summary_of
from episode_store.task_folder import EpisodeFolder, is_named_like_own, TaskFolder, tasks
from page_node.memory.opened import BagState, counts_of, folders_of, MOST_OPEN, opened, task_of

#: How long bags are read for one answer, [s]: the rest comes with the next, others wait meanwhile.
_READS_FOR: Final = 0.25
#: Rows that are kept in mind.
_MOST_KEPT: Final = 4000
#: Recordings of other programs that are named.
_MOST_NAMED: Final = 20

_Key = tuple[EpisodeFolder, BagState]
_kept: 'OrderedDict[_Key, dict[str, Any]]' = OrderedDict()


def list_of(bags: str, task: str) -> dict[str, Any]:
    """
    Return all bags of a task, the newest first.

    Parameters
    ----------
    bags : str
        Folder of the tasks.
    task : str
        Name of one; empty: the first there is.

    Returns
    -------
    dict
        ``episodes``: rows, as `_row` has them, each with ``count``, see `counts_of`; of those that
        were not read yet, with ``state`` ``unread``, only the names. ``complete``: whether there
        is none of these, else the same is to be asked again. ``others``: names of what other
        programs recorded there. ``task``: whose they are. ``tasks``: those that have bags.

    Raises
    ------
    RefusedError
        ``no_task`` if there cannot be such a task, ``folder`` if its folder cannot be read.

    """
    deadline, there, rows = time.monotonic() + _READS_FOR, _tasks(bags), list[dict[str, Any]]()
    if not task and not there:
        return {'task': '', 'tasks': [], 'episodes': [], 'complete': True, 'others': []}
    found = task_of(bags, task or there[0])
    counts = counts_of(folders_of(found))
    for place, folder in enumerate(reversed(counts)):
        key = folder, BagState.of(folder)
        if key not in _kept and time.monotonic() < deadline:
            # A long list must not push the newest out of what stays open.
            _keep(key, opened(*key) if place < MOST_OPEN // 2 else Episode(folder))
        row = _kept.get(key) or _names(folder) | {'state': 'unread'}
        rows.append(row | {'count': counts[folder]})
    return {'task': found.task, 'tasks': there, 'episodes': rows,
            'complete': all(row['state'] != 'unread' for row in rows),
            'others': _others(found)}


def _tasks(bags: str) -> list[str]:
    with suppress(BagError):
        return tasks(bags)
    return []


def _keep(key: _Key, episode: Episode) -> None:
    _kept[key] = _row(episode, key[1])
    while len(_kept) > _MOST_KEPT:
        _kept.popitem(last=False)


def _names(folder: EpisodeFolder) -> dict[str, Any]:
    return {'name': folder.name, 'number': folder.number, 'kind': str(folder.kind),
            'forgotten': folder.is_forgotten}


def _row(episode: Episode, state: BagState) -> dict[str, Any]:
    """
    Read a bag for its row.

    Returns
    -------
    dict
        ``name`` (such as ``task1/0003``), ``number``, ``kind``, ``forgotten``; ``state``, see
        `Summary`; ``began`` (ISO 8601; of simulated time, when it was written), ``seconds``,
        ``outcome``, ``label``, ``learnt``, ``steps``, ``reinforcements``, ``stop_reason`` (a
        `StopReason`), ``damage`` (a word of `Damage.state`); ``note`` in the memory's own words;
        ``version``, which changes with the bag.

    """
    summary = summary_of(episode)
    return {
        **_names(episode.folder), 'state': summary.state, 'began': _began(summary, state),
        'seconds': summary.duration, 'outcome': summary.outcome, 'label': summary.label,
        'learnt': summary.state in ('kept', 'incomplete'), 'steps': _steps(summary),
        **_ending(episode, summary), 'damage': episode.damage.state, 'note': summary.note,
        'version': f'{crc32(repr(state).encode()):08x}'}


def _steps(summary: Summary) -> int | None:
    return summary.steps if summary.cells is None else summary.cells - 1


def _began(summary: Summary, state: BagState) -> str | None:
    """Return when it began; of a bag in simulated time, when its last byte was written."""
    begun = summary.begun
    if begun is None and state.recording is not None:
        begun = state.recording[2] * 1e-9
    return None if begun is None else datetime.fromtimestamp(begun, UTC).isoformat(
        timespec='seconds')


def _ending(episode: Episode, summary: Summary) -> dict[str, Any]:
    """Return what is recorded of how it ended."""
    status = None
    if summary.state != 'unreadable':
        with suppress(BagError):
            status = episode.status
    return {'reinforcements': None if status is None else status.reinforcements,
            'stop_reason': '' if status is None else str(status.stop_reason or '')}


def _others(task: TaskFolder) -> list[str]:
    """Name the recordings in a task's folder, and beside the tasks, that are not the robot's."""
    return sorted(name for folder in (task.root, task.path) for name in _odd_in(folder))[
        :_MOST_NAMED]


def _odd_in(folder: os.PathLike[str]) -> list[str]:
    with suppress(OSError), os.scandir(folder) as entries:
        return [entry.name for entry in entries
                if not entry.name.startswith('.') and _is_odd(entry)]
    return []


def _is_odd(entry: 'os.DirEntry[str]') -> bool:
    """Return whether something is a recording, and none that is named like the robot's own."""
    path = Path(entry.path)
    if not entry.is_dir(follow_symlinks=False):
        return is_storage_file(path)
    return not is_named_like_own(path) and bool(storage_files(path))
