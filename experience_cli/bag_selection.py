"""Which bags a command is about."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from episode_store.rosbag2.bag_files import is_storage_file, storage_files
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import HEADER_NAME
from episode_store.task_folder import episode_from_path, EpisodeFolder, TaskFolder
from experience_cli.errors import UserError


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
    Tell whether a path is a bag of another recorder.

    That is a file that holds messages or a folder of such, unless the folder is named or the file
    begins like a bag of ours. What only describes such files is one
    too: opening it says what is wrong with it.

    Raises
    ------
    BagError
        If a folder cannot be read.

    """
    files = storage_files(path) if path.is_dir() else [path]
    if _was_one(path, files):
        return True
    if not files or not files[0].exists() or not is_storage_file(files[0]):
        return False
    if files[0].suffix != '.mcap':
        return not path.is_dir() or not is_named_like_ours(path)
    return not is_named_like_ours(files[0].parent) and not _has_our_header(files[0])


def _was_one(path: Path, files: list[Path]) -> bool:
    """Tell whether a path is what is left of a bag of others whose files are missing."""
    return path.is_dir() and not files and not is_named_like_ours(path) and (
        path / 'metadata.yaml').exists()


def is_named_like_ours(folder: Path) -> bool:
    """Tell whether a folder is named like that of a bag of ours."""
    try:
        episode_from_path(folder.absolute())
    except BagError:
        return False
    return True


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
        theirs = sorted(child for child in path.iterdir() if child.is_dir() and is_external(child))
        hint = f'; name those of other recorders one by one, such as {theirs[0]}' if theirs else ''
        raise UserError(f'{path} holds no bags, must be a folder of bags like 0001_demo{hint}')
    return episodes


def episodes_up_to(last: EpisodeFolder) -> list[EpisodeFolder]:
    """Return the bags beside one, up to and with that one, by number."""
    task = TaskFolder(last.path.parent.parent, last.path.parent.name)
    return [episode for episode in task.episodes() if episode.number <= last.number]
