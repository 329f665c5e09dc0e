"""What a task's bags have taught: relearnt from all of them, or one bag at a time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np

from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.learner import Learner, Refresh
from control_field.parameters import Parameters
from control_field.records import ControlField, Demonstration, Outcome, Trial
from learner_node.settings import StartPose
from msgs_bridge.bag_folder import BagError, EpisodeFolder, EpisodeKind, TaskFolder
from msgs_bridge.bag_repair import repair_task
from msgs_bridge.episode_header import EpisodeHeader
from msgs_bridge.episodes import NothingToLearnError, read_episode


@dataclass(frozen=True, eq=False)
class Lesson:
    """
    What one bag taught.

    Parameters
    ----------
    episode : EpisodeFolder
        The bag.
    content : Demonstration, Trial or None
        What it holds; None where that is no use.
    refresh : Refresh or None
        What was made of it; None if nothing was learnt from it.
    note : str
        What it was, or why nothing was learnt.

    """

    episode: EpisodeFolder
    content: Demonstration | Trial | None
    refresh: Refresh | None
    note: str


class Library:
    """
    The bags of a task and what they have taught so far.

    The field is a pure function of the bags in their order: it makes no difference whether they
    were learnt from one by one, as they were recorded, or all at once later.

    Parameters
    ----------
    task : TaskFolder
    grid : Grid
    parameters : Parameters
    starts : sequence of StartPose
        Where trials start, in turn; empty: where the demonstrations started.
    fresh : bool
        Whether to set the bags that are there aside.

    Raises
    ------
    BagError
        If the folder cannot be written.

    """

    def __init__(
        self, task: TaskFolder, grid: Grid, parameters: Parameters,
        starts: tuple[StartPose, ...] = (), fresh: bool = False,
    ) -> None:
        self.task = task
        self.grid = grid
        self.parameters = parameters
        self.topics: Mapping[str, str] = {}
        self._starts = starts
        self._shown_starts: list[StartPose] = []
        self._learner = Learner(grid, parameters)
        self.n_trials = 0
        self._n_asked = 0
        if fresh:
            set_aside(task)
        _check_writable(task)

    @property
    def refresh(self) -> Refresh | None:
        """Return what is in force; None before the first demonstration."""
        return self._learner.refresh

    def header(self, kind: EpisodeKind) -> Mapping[str, str]:
        """Return the header of a bag that is recorded now."""
        return EpisodeHeader(
            kind, self.task.task, self.grid, self.parameters, self.topics).to_mapping()

    def field(self, curious: bool = False) -> ControlField:
        """Return the field for the next trial, see `Learner.trial_field`."""
        return self._learner.trial_field(curious)

    def relearn(self) -> list[str]:
        """
        Mend bags that were not closed, and learn from all of them.

        Returns
        -------
        list of str
            Lines for people: what was found.

        Raises
        ------
        BagError
            If a bag cannot be read, or is of another grid, frame or version.

        """
        lines = [f'found {report}' for report in repair_task(self.task)]
        lessons = list(self.lessons())
        lines += [f'{lesson.episode.name}: {lesson.note}'
                  for lesson in lessons if lesson.refresh is None]
        if lessons:
            n_demos = sum(lesson.episode.kind is EpisodeKind.DEMO for lesson in lessons)
            lines.append(f'{self.task.path}: relearnt from {n_demos} demonstrations and '
                         f'{len(lessons) - n_demos} trials')
        return lines

    def lessons(self) -> Iterator[Lesson]:
        """Learn from the bags there are, one after the other."""
        for episode in self.task.episodes():
            yield self.learn(episode)

    def learn(self, episode: EpisodeFolder) -> Lesson:
        """
        Learn from one bag.

        Raises
        ------
        BagError
            If it cannot be read, or is of another grid, frame or version.

        """
        self._n_asked = 0
        try:
            read = read_episode(episode.path, self.grid)
        except NothingToLearnError as error:
            return Lesson(episode, None, None, f'nothing was learnt: {error}')
        note = '; '.join([*([str(read.report)] if read.report else []), *read.notes])
        if isinstance(read.record, Trial):
            return self._learn_trial(episode, read.record, note)
        refresh = self._learner.add_demonstration(read.record)
        self._shown_starts.append(start_of(read.record, self.grid))
        return Lesson(episode, read.record, refresh, note)

    def _learn_trial(self, episode: EpisodeFolder, trial: Trial, note: str) -> Lesson:
        said = f'{trial.outcome} after {trial.n_steps} steps' + (f', {note}' if note else '')
        if trial.outcome is Outcome.ABORTED:
            return Lesson(episode, trial, None, f'nothing was learnt: {said}')
        self.n_trials += 1
        if self.refresh is None:
            return Lesson(episode, trial, None,
                          f'nothing was learnt: no demonstration came before it ({said})')
        return Lesson(episode, trial, self._learner.add_trial(trial), said)

    def next_start(self, spread: bool) -> StartPose:
        """
        Return where the next trial starts.

        Parameters
        ----------
        spread : bool
            Whether to start where a trial teaches most; asked again, the next best is given.

        """
        asked, self._n_asked = self._n_asked, self._n_asked + 1
        if spread and self.refresh is not None:
            rng = np.random.default_rng([self.parameters.seed, self.refresh.field.revision])
            cells = self._learner.next_starts(asked + 1, rng, self.field(curious=True))
            if cells:
                return StartPose(*self.grid.world_from_cell(*cells[min(asked, len(cells) - 1)]))
        poses = self._starts or tuple(self._shown_starts)
        return poses[(self.n_trials + asked) % len(poses)]


def start_of(demonstration: Demonstration, grid: Grid) -> StartPose:
    """Return where a demonstration started: the centre of its first cell, looking along it."""
    (row, col), (next_row, next_col) = demonstration.cells[:2].tolist()
    yaw = heading_from_step(next_row - row, next_col - col) * math.pi / 4
    return StartPose(*grid.world_from_cell(row, col), math.remainder(yaw, math.tau))


def set_aside(task: TaskFolder) -> Path | None:
    """
    Rename a task's folder so that it begins anew; return where its bags are now.

    Raises
    ------
    BagError
        If it cannot be renamed.

    """
    if not task.episodes():
        return None
    number = 1
    while (aside := task.path.with_name(f'{task.task}_before_{number}')).exists():
        number += 1
    try:
        task.path.rename(aside)
    except OSError as error:
        raise BagError(f'cannot set {task.path} aside: {error.strerror}') from None
    return aside


def _check_writable(task: TaskFolder) -> None:
    probe = task.path / '.writable'
    try:
        task.path.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise BagError(f'cannot record into {task.path}: {(error.strerror or "").lower()}; set '
                       f'the parameter bags to a folder that can be written') from None
