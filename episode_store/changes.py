"""What people have changed about bags since they were recorded."""

from collections.abc import Iterator, Sequence

from episode_store.label import read_label
from episode_store.task_folder import EpisodeFolder, TaskFolder
from episode_store.trim import whole_path


def changes_before(episodes: Sequence[EpisodeFolder], number: int) -> list[str]:
    """
    Say which bags before one are not as they were when they were recorded.

    Parameters
    ----------
    episodes : sequence of EpisodeFolder
        The bags that are learnt from, by number.
    number : int
        Of the bag.

    Returns
    -------
    list of str
        Such as ``task1/0001 was cut``, by number.

    Raises
    ------
    BagError
        If a folder cannot be read.

    """
    there = {episode.number: episode for episode in episodes}
    path = episodes[0].path.parent
    task = TaskFolder(path.parent, path.name)
    forgotten = {episode.number for episode in task.forgotten()}
    found = []
    for before in range(1, number):
        if before in there:
            found += [f'{there[before].name} {what}' for what in _changes(there[before])]
        else:
            what = 'was forgotten' if before in forgotten else 'is not among the bags'
            found.append(f'{task.task}/{before:04d} {what}')
    return found


def _changes(episode: EpisodeFolder) -> Iterator[str]:
    if whole_path(episode).exists():
        yield 'was cut'
    label = read_label(episode.path)
    if label is not None:
        yield f'was labelled {label or "none"}'
