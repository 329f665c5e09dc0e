"""
Taking bags away, and bringing them back.

Whatever takes a bag away (dropping, throwing away, forgetting, beginning anew) moves it into
``.forgotten`` of its task's folder, where it keeps its number. What was taken away at one stroke
carries the same time, later than all before it however the clock is set: the last comes back
first.
"""

from collections.abc import Sequence
from contextlib import suppress
import os
import time
from typing import Final

from episode_store.episode import Episode
from episode_store.errors import NothingThereError
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.task_folder import EpisodeFolder, EpisodeKind, TaskFolder
from msgs_bridge.messages.trial_status import Label

#: Why a demonstration was not kept that a person has thrown away while it was recorded.
THROWN_AWAY: Final = 'it was thrown away'
#: How it is undone, where a learner runs.
UNDO: Final = 'press b in teleop_node to bring it back'


def take_away(task: TaskFolder, numbers: Sequence[int]) -> list[EpisodeFolder]:
    """
    Take bags away at one stroke; return where they are now.

    Raises
    ------
    BagError
        If there is none of a number, or it cannot be moved.

    """
    when = max([time.time_ns(), *(_taken_at(episode) + 1 for episode in task.forgotten())])
    taken = []
    for number in numbers:
        episode = task.forget(number)
        os.utime(episode.path, ns=(when, when))
        taken.append(episode)
    return taken


def bring_back(task: TaskFolder, number: int | None = None) -> list[EpisodeFolder]:
    """
    Bring a bag back, or what was taken away last at one stroke; return what is there again.

    A demonstration that was thrown away while it was recorded counts as kept from now on.

    Raises
    ------
    BagError
        If nothing was taken away, no such bag was, or it cannot be moved.

    """
    gone = task.forgotten()
    if number is None:
        last = max(map(_taken_at, gone), default=0)
        numbers = [episode.number for episode in gone if _taken_at(episode) == last]
        if not numbers:
            raise NothingThereError(f'nothing was taken away from {task.path}')
    else:
        numbers = [number]
    return [_kept(task.recall(each)) for each in numbers]


def _kept(episode: EpisodeFolder) -> EpisodeFolder:
    with suppress(BagError):  # what cannot be read is said where it is learnt from
        bag = Episode(episode)
        if episode.kind is EpisodeKind.DEMO and bag.status and bag.status.reason == THROWN_AWAY:
            bag.judge(Label.SUCCESS)
    return episode


def _taken_at(episode: EpisodeFolder) -> int:
    """Return when a bag was taken away, [ns]."""
    try:
        return episode.path.stat().st_mtime_ns
    except OSError as error:
        raise BagError(error_line('read', episode.path, error)) from None


def names_of(episodes: Sequence[EpisodeFolder]) -> str:
    """Name bags as people type them: all of a few, of many how many and from where to where."""
    if len(episodes) <= 3:
        return ' and '.join(episode.name for episode in episodes)
    return f'{len(episodes)} bags ({episodes[0].name} to {episodes[-1].name})'
