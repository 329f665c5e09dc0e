"""What every episode came to, in the order they were learnt from."""

from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
import math
import time
from typing import Any, Final
from zlib import crc32

from control_field.records import Demonstration, Outcome
from episode_store.episode import Content, Episode
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder
from page_node.memory.opened import BagState, counts_of, folders_of, task_of

#: How long bags are read for one answer, [s]: the rest comes with the next, others wait meanwhile.
_READS_FOR: Final = 0.25
#: Episodes that are kept in mind.
_MOST_KEPT: Final = 4000

#: What is known of each bag and not told: of those that are told it is always the same.
_OURS: Final = ('learnt', 'begins_with')

Row = dict[str, Any]
_Key = tuple[EpisodeFolder, BagState]
_kept: 'OrderedDict[_Key, Row]' = OrderedDict()


def story_of(bags: str, task: str) -> dict[str, Any]:
    """
    Return what has taught the robot something, oldest first.

    Returns
    -------
    dict
        ``episodes``: rows, as `_learnt` has them, each with ``count`` (see `counts_of`),
        ``prototypes`` (the paper's hidden neurons) after it, and ``field``, the version of the
        field that was made of it. Both are None until the next episode begins: a bag begins with
        the field that was in force.
        ``complete``: whether all bags were read, else the same is to be asked again.

    Raises
    ------
    RefusedError
        If there cannot be a task of that name, or its folder cannot be read.

    """
    deadline = time.monotonic() + _READS_FOR
    folders = folders_of(task_of(bags, task))
    counts = counts_of(folders)
    rows, complete = [], True
    for folder in folders:
        if folder.is_forgotten:
            continue
        row = _row(folder, deadline)
        complete = complete and row is not None
        if row is not None and row['learnt']:
            told = {name: value for name, value in row.items() if name not in _OURS}
            told['count'] = counts[folder]
            rows.append(told | _made_of_it(folders, folder.number, deadline))
    return {'task': task, 'episodes': rows, 'complete': complete}


def bag_after(
    folders: Sequence[EpisodeFolder], number: int, deadline: float = math.inf,
) -> tuple[EpisodeFolder | None, int | None]:
    """
    Return the bag that holds the field made of an episode, and how many prototypes that has.

    It is the next one, where that can be read: else another one, if nothing was learnt between.

    Parameters
    ----------
    folders : sequence of EpisodeFolder
        By number; also what was forgotten since says what was in force when it began.
    number : int
        Of the episode.
    deadline : float, [s]
        No bag is read after it.

    """
    for folder in folders:
        row = _row(folder, deadline) if folder.number > number else None
        if row is not None and row['begins_with'] is not None:
            return folder, row['begins_with']
        if folder.number > number and (row is None or row['learnt']):
            break
    return None, None


def _row(folder: EpisodeFolder, deadline: float) -> Row | None:
    """Return the row of a bag, read at most once; None if there is no time to read it."""
    key = folder, BagState.of(folder)
    if key not in _kept:
        if time.monotonic() > deadline:
            return None
        _kept[key] = _read(folder)
        while len(_kept) > _MOST_KEPT:
            _kept.popitem(last=False)
    return _kept[key]


def _made_of_it(folders: Sequence[EpisodeFolder], number: int, deadline: float) -> Row:
    """Return what is known of the field that an episode has led to."""
    after, n_prototypes = bag_after(folders, number, deadline)
    return {'prototypes': n_prototypes, 'field': None if after is None else _version(after)}


def _version(folder: EpisodeFolder) -> str:
    """Return what changes with a bag."""
    return f'{crc32(repr(BagState.of(folder)).encode()):08x}'


def _read(folder: EpisodeFolder) -> Row:
    """
    Read a bag.

    Returns
    -------
    dict
        ``learnt`` and ``begins_with``, the number of prototypes of the field that it begins with;
        None where it holds no field. What was learnt from has the rest, too.

    """
    episode = Episode(folder)
    row: Row = {'name': folder.name, 'number': folder.number, 'kind': str(folder.kind),
                'learnt': False, 'begins_with': None}
    with suppress(BagError, OSError):
        prototypes = episode.prototypes()
        row['begins_with'] = None if prototypes is None else len(prototypes)
    with suppress(BagError, OSError):
        row |= _learnt(episode, episode.content)
    return row


def _learnt(episode: Episode, content: Content) -> Row:
    """
    Return what an episode came to; nothing where nothing is learnt from it.

    ``steps``, ``reinforcements`` (what a trial was learnt from), ``collisions`` (contacts),
    ``outcome``, ``stop_reason``, ``label`` and ``seconds``.
    """
    record, status = content.record, content.status
    if isinstance(record, Demonstration):
        steps, reinforcements, outcome = len(record.cells) - 1, 0, ''
    else:
        steps, reinforcements = record.n_steps, record.n_reinforcements
        outcome = str(record.outcome)
    if outcome == Outcome.ABORTED:
        return {}
    return {
        'learnt': True, 'steps': steps, 'reinforcements': reinforcements,
        'collisions': sum(message[4] for message in episode.messages('contact')),
        'outcome': outcome, 'label': str(episode.label),
        'stop_reason': '' if status is None else str(status.stop_reason or ''),
        'seconds': round(episode.duration, 3)}
