"""Which bags a person means: ``task1/0003``, the path of a bag's folder, or that of a task."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
import re
import shlex
from typing import Final

from episode_store.episode import Episode
from episode_store.label import read_label
from episode_store.rosbag2.bag_files import is_storage_file, storage_files
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import HEADER_NAME
from episode_store.task_folder import (
    check_task_name, episode_from_path, EpisodeFolder, is_named_like_own, TaskFolder, tasks)
from experience_cli.arguments import BAGS
from experience_cli.errors import UserError

#: So many tasks are named where one is not there.
_MOST: Final = 8
_NUMBER: Final = re.compile(r'(\d{1,8})(?:_(demo|trial))?')


def named(text: str, bags: Path | None) -> str:
    """Return how a bag is named in a command that is to be copied, as the user named it."""
    return shlex.quote(text) + (f' --bags {shlex.quote(str(bags))}' if bags is not None else '')


def task_of(text: str, bags: Path | None) -> tuple[TaskFolder, int, str]:
    """
    Return task, number and kind (empty if not said) of a bag as people write it.

    Raises
    ------
    UserError
        If it is written in no way that is understood, or leads out of the bags folder.
    BagError
        If the task's name cannot be one.

    """
    path = Path(text)
    if path.suffix == '.mcap' or path.name == 'metadata.yaml':
        path = path.parent
    if '..' in path.parts:
        raise UserError(f'{text} leads out of the bags folder, must be like task1/0003 (--bags '
                        f'names the folder)')
    match = _NUMBER.fullmatch(path.name)
    if match is None and _is_there_and_external(Path(text)):
        raise UserError(f'{text} is a bag of another recorder, which stays as it is: keep it as a '
                        f'demonstration first, `experience learn {shlex.quote(text)} --into '
                        f'{BAGS}/TASK`')
    if match is None or not path.parent.name:
        raise UserError(f'{text!r} names no bag, must be like task1/0003{_what_it_is(Path(text))}')
    task, folder = path.parent.name, path.parent.parent
    if folder == Path():
        folder = bags or BAGS
    elif bags is not None and folder.resolve() != bags.resolve():
        raise UserError(f'{text} lies outside {bags}')
    return TaskFolder(folder, check_task_name(task)), int(match[1]), match[2] or ''


def _what_it_is(path: Path) -> str:
    """Say what there is in place of a bag, as the end of a sentence."""
    with suppress(BagError, OSError):
        if path.is_dir():
            task = task_folder(path)
            first = next(iter(task.episodes()), None) if task is not None else None
            return (f'; it is a task, such as {path}/{first.number:04d} is one of its bags'
                    if first is not None else '; no .mcap, .db3 or .bag file is in that folder')
        if path.exists():
            return '; that file is no .mcap, .db3 or .bag'
    return '' if path.parent == Path() else '; there is no such file or folder'


def _is_there_and_external(path: Path) -> bool:
    try:
        return path.exists() and is_external(path)
    except BagError:
        return False


def named_path(path: Path, bags: Path | None = None) -> Path:
    """
    Return the path of a bag or task folder that a person may have named as ``task1/0003``.

    Parameters
    ----------
    path : Path
        What is there is taken as it is: a folder or file of whatever recorder.
    bags : Path, optional
        The folder of all tasks.

    Raises
    ------
    UserError
        If it names a bag that was forgotten.
    BagError
        If it names a bag that is not there, or a folder cannot be read.

    """
    if path.exists() or '..' in path.parts:
        return path
    beside = (bags or BAGS) / path
    if len(path.parts) == 1:
        return beside if beside.is_dir() and task_folder(beside) is not None else path
    if _NUMBER.fullmatch(path.name) is None:
        return path
    task, number, kind = task_of(str(path), bags)
    if not task.path.is_dir():
        return path
    _check_remembered(task, number, str(path), bags)
    episode = task.find(number)
    _check_kind(episode, kind)
    return episode.path


def find_bag(text: str, bags: Path | None = None) -> EpisodeFolder:
    """
    Return the bag that a person names.

    Raises
    ------
    UserError
        If there is none, it was forgotten, or it is no bag of ours.
    BagError
        If the folder cannot be read.

    """
    task, number, kind = task_of(text, bags)
    if not task.path.is_dir():
        raise UserError(f'there is no task folder {task.path}{tasks_in(task.root)}')
    _check_remembered(task, number, text, bags)
    episode = task.find(number)
    _check_kind(episode, kind)
    if not episode.bag.is_file():
        raise UserError(f'{episode.path} is no bag: it holds no {episode.bag.name}')
    if not episode.bag.resolve().is_relative_to(task.root.resolve()):
        raise UserError(f'{episode.bag} leads out of {task.root}')
    return episode


def tasks_in(folder: Path) -> str:
    """Name the tasks there are in a folder, as the end of a sentence; empty if there are none."""
    try:
        names = tasks(folder) if folder.is_dir() else []
    except (BagError, OSError):
        return ''
    more = f' and {len(names) - _MOST} more' if len(names) > _MOST else ''
    return f'; the tasks there are {", ".join(names[:_MOST])}{more}' if names else ''


def _check_remembered(task: TaskFolder, number: int, text: str, bags: Path | None) -> None:
    if any(episode.number == number for episode in task.forgotten()):
        raise UserError(f'{task.task}/{number:04d} was forgotten; `experience forget --undo '
                        f'{named(text, bags)}` brings it back')


def _check_kind(episode: EpisodeFolder, kind: str) -> None:
    if kind and kind != episode.kind:
        raise UserError(f'{episode.name} is a {episode.kind}, no {kind}')


def find_whole_bag(text: str, bags: Path | None = None) -> EpisodeFolder:
    """
    Return the bag that a person names, which must have been closed.

    Raises
    ------
    UserError
        See `find_bag`; also if it was not closed, or is still being recorded.
    BagError
        If it cannot be read.

    """
    episode = find_readable_bag(text, bags)
    if not Episode(episode).is_closed:
        find_bag(text, bags)  # which says so if another command has forgotten it meanwhile
        raise UserError(f'{episode.path} was not closed: it is still being recorded, or was cut '
                        f'off; mend it with `experience repair {shlex.quote(str(episode.path))}`')
    return episode


def find_readable_bag(text: str, bags: Path | None = None) -> EpisodeFolder:
    """
    Return the bag that a person names, whole or cut.

    Raises
    ------
    UserError
        See `find_bag`.
    BagError
        If it cannot be read.

    """
    episode = find_bag(text, bags)
    BagReader(episode.bag)
    read_label(episode.path)
    return episode


def task_folder(path: Path) -> TaskFolder | None:
    """
    Return the task whose folder a path is; None if it is not one.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    if not path.is_dir() or not re.fullmatch(r'[A-Za-z0-9_-]{1,64}', path.resolve().name):
        return None
    # Written as the user did, so that messages name it so.
    whole = path if path.name not in ('', '..') else path.resolve()
    task = TaskFolder(whole.parent, whole.name)
    return task if task.episodes() or task.forgotten() else None


def episodes_from_paths(paths: Sequence[Path]) -> list[EpisodeFolder]:
    """
    Return the bags of task folders and of single bags, each once, by number.

    Parameters
    ----------
    paths : sequence of Path
        Folders of tasks, of bags, or MCAP files in them.

    Raises
    ------
    UserError
        If one is none of these, or two bags have the same number.
    BagError
        If one cannot be read.

    """
    ordered = sorted(episodes_of_all(paths))
    for first, second in pairwise(ordered):
        if first.number == second.number:
            raise UserError(f'{first.path} and {second.path} have the same number: learn from the '
                            f'bags of one task at a time')
    return ordered


def episodes_of_all(paths: Sequence[Path]) -> list[EpisodeFolder]:
    """Return the bags of task folders and of single bags, each once, as they are named."""
    found: dict[Path, EpisodeFolder] = {}
    for path in paths:
        for episode in _episodes(path):
            found[episode.path.resolve()] = episode
    return list(found.values())


def is_external(path: Path) -> bool:
    """
    Return whether a path is a bag of another recorder.

    That is a file that holds messages or a folder of such, unless the folder is named or the file
    begins like a bag of ours. What only describes such files is one
    too: opening it says what is wrong with it.

    Raises
    ------
    BagError
        If a folder cannot be read.

    """
    files = storage_files(path) if path.is_dir() else [path]
    if _was_external(path, files):
        return True
    if not files or not files[0].exists() or not is_storage_file(files[0]):
        return False
    if files[0].suffix != '.mcap':
        return not path.is_dir() or not is_named_like_own(path)
    return not is_named_like_own(files[0].parent) and not _has_our_header(files[0])


def _was_external(path: Path, files: list[Path]) -> bool:
    """Return whether a path is what is left of an external bag whose files are missing."""
    return path.is_dir() and not files and not is_named_like_own(path) and (
        path / 'metadata.yaml').exists()


def _has_our_header(file: Path) -> bool:
    try:
        return any(name == HEADER_NAME for name, _ in BagReader(file).metadata)
    except BagError:
        return False


def _episodes(path: Path) -> list[EpisodeFolder]:
    if path.is_file() and path.suffix == '.mcap':
        path = path.parent
    if not path.is_dir():
        raise UserError(f'there is no bag or task folder {path}')
    if any(path.glob('*.mcap')) or path.name.endswith(('_demo', '_trial')):
        return [episode_from_path(path.absolute())]
    episodes = TaskFolder(path.absolute().parent, path.absolute().name).episodes()
    if not episodes:
        external = sorted(
            child for child in path.iterdir() if child.is_dir() and is_external(child))
        hint = f'; name those of other recorders one by one, such as {external[0]}' if (
            external) else ''
        raise UserError(f'{path} holds no bags, must be a folder of bags like 0001_demo{hint}')
    return episodes


def episodes_up_to(last: EpisodeFolder) -> list[EpisodeFolder]:
    """Return the bags beside one, up to and with that one, by number."""
    return [episode for episode in last.task.episodes() if episode.number <= last.number]
