"""Where prototypes come from: from which bag and second of it, and who drove there."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import numpy.typing as npt

from control_field.records import Kind
from control_field.words import counted
from episode_store.episode import Episode
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, EpisodeKind, TaskFolder


@dataclass(frozen=True, eq=False)
class _Drive:
    """When a bag's drive began, [s], and the stamps of what a person drove; None: all of it."""

    start: float
    taught: npt.NDArray[np.float64] | None

    @classmethod
    def from_bag(cls, folder: EpisodeFolder) -> '_Drive':
        """Read a bag; BagError if that cannot be done."""
        episode = Episode(folder)
        if folder.kind is EpisodeKind.DEMO:
            return cls(episode.start, None)
        rows = episode.decisions
        return cls(episode.start, rows['stamp'][rows['kind'] == Kind.TAUGHT])

    def shows(self, stamp: float) -> bool:
        """Return whether a person drove at a stamp [s]."""
        return self.taught is None or stamp in self.taught


class Sources:
    """
    Where prototypes come from, in words.

    Parameters
    ----------
    task : TaskFolder
        Whose bags are looked up.

    """

    def __init__(self, task: TaskFolder) -> None:
        self._task = task
        self._drives: dict[int, _Drive | None] = {}

    @cached_property
    def _episodes(self) -> Mapping[int, EpisodeFolder]:
        return {episode.number: episode
                for episode in [*self._task.forgotten(), *self._task.episodes()]}

    def _drive(self, number: int) -> _Drive | None:
        if number not in self._drives:
            episode = self._episodes.get(number)
            try:
                self._drives[number] = _Drive.from_bag(episode) if episode else None
            except BagError:
                self._drives[number] = None
        return self._drives[number]

    def second(self, number: int, stamp: float) -> float | None:
        """Return when in its bag a prototype was shown or tried, [s]; None if that is gone."""
        drive = self._drive(number)
        # The first step is decided on an odometry that may just not have been recorded yet.
        return None if drive is None or math.isnan(stamp) else max(stamp - drive.start, 0.0)

    def text(self, number: int, stamp: float, demonstrated: bool) -> str:
        """Return where a prototype comes from."""
        if number < 0:
            return f'the learner itself, once {counted(-number, "bag")} had been learnt from'
        second = self.second(number, stamp)
        when = f'stamp {stamp:.2f} s, its bag is gone' if second is None else f'{second:.2f} s'
        how = self._how(number, stamp) if demonstrated else 'tried'
        return f'{self._task.task}/{number:04d} at {when} ({how})'

    def _how(self, number: int, stamp: float) -> str:
        """Say whether a heading was shown there, or driven anew by a trial as it was shown."""
        drive = self._drive(number)
        if drive is None:
            return 'as shown'
        return 'shown' if drive.shows(stamp) else 'driven again as shown'
