"""What the bags of a task teach once something about them has changed."""

from collections.abc import Sequence

from control_field.learning.learner import Refresh
from episode_store.episode import read_header
from episode_store.header import EpisodeHeader
from episode_store.relearn import LearntBag, Relearner
from episode_store.rosbag2.errors import BagError, NothingToLearnError
from episode_store.task_folder import EpisodeFolder, TaskFolder
from episode_store.workspace import odd_one_named


def fold(episodes: Sequence[EpisodeFolder]) -> tuple[Relearner | None, list[LearntBag]]:
    """
    Learn from bags in their order, with the parameters of the last one.

    Returns
    -------
    relearner : Relearner or None
        None if no bag can be learnt from at all.
    learnt : list of LearntBag

    Raises
    ------
    BagError
        If one cannot be read, or is of another grid, frame or version.

    """
    header = last_header(episodes)
    if header is None:
        return None, []
    relearner = Relearner(header.grid, header.parameters)
    with odd_one_named(episodes):
        return relearner, [relearner.learn(episode) for episode in episodes]


def last_header(episodes: Sequence[EpisodeFolder]) -> EpisodeHeader | None:
    """
    Return what the last of some bags says of itself, leaving out those that hold nothing.

    Raises
    ------
    BagError
        If it cannot be read, or is none of ours.

    """
    for episode in reversed(episodes):
        try:
            return read_header(episode.path)
        except NothingToLearnError:
            continue
    return None


def relearnt(task: TaskFolder) -> Refresh | None:
    """Return what the bags of a task teach now; None if there is no demonstration in them."""
    relearner, _ = fold(task.episodes())
    return None if relearner is None else relearner.refresh


def relearnt_sentence(task: TaskFolder) -> str:
    """Say what the bags of a task teach now, or which of them keeps it from being learnt."""
    try:
        refresh = relearnt(task)
    except BagError as error:
        return f'{task.path}: not learnt anew, {error}'
    if refresh is None:
        return f'{task.path}: no demonstration is left, there is no field now'
    return f'{task.path}: learnt anew. {refresh.certificate.sentence()}'
