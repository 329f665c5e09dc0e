"""
The field as a fold over bags: each teaches in its turn, and nothing else does (ADR 1).

`Relearner` is the fold; it makes no difference whether its bags are learnt from as they are
recorded or all at once later. Below it stands what has to hold of the bags of one task.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
import math
import shlex
from typing import Final

import numpy as np

from control_field.drives.breaks import place_text
from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.learning.compose import Composition
from control_field.learning.learner import Learner, Refresh
from control_field.parameters import Parameters
from control_field.poses import StartPose
from control_field.records import ControlField, Demonstration, Outcome, Trial
from control_field.words import how_it_ended
from episode_store.episode import Content, Episode
from episode_store.errors import NothingToLearnError, WorkspaceError
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, TaskFolder
from msgs_bridge.messages.frame_hints import remedy_for_frame

#: Places to teach from are at least this many cells apart.
_APART: Final = 4


@dataclass(frozen=True, eq=False)
class LearntBag:
    """
    What one bag taught.

    Parameters
    ----------
    folder : EpisodeFolder
        The bag.
    content : Content or None
        What it holds; None where that is no use.
    refresh : Refresh or None
        What was made of it; None if nothing was learnt from it.
    said : str
        What it was; empty if nothing was learnt.
    why_not : str
        Why nothing was learnt; empty if something was.
    moved : str
        A sentence on where the goal is now and was before; empty if it is where it was.
    missing : str
        What the recording lacks; empty if nothing.

    """

    folder: EpisodeFolder
    content: Content | None
    refresh: Refresh | None
    said: str = ''
    why_not: str = ''
    moved: str = ''
    missing: str = ''

    @property
    def note(self) -> str:
        """Return what it was, or that nothing was learnt and why, and what is missing."""
        what = f'nothing was learnt: {self.why_not}' if self.why_not else self.said
        return '; '.join(filter(None, [what, self.missing]))


class Relearner:
    """
    The fold over bags: they are learnt from in the order they are given, once each.

    Parameters
    ----------
    grid : Grid
        The workspace they must have been recorded in.
    parameters : Parameters

    """

    def __init__(self, grid: Grid, parameters: Parameters) -> None:
        self.grid = grid
        self.parameters = parameters
        self.n_trials = 0
        self.demonstrated_starts: list[StartPose] = []
        self._learner = Learner(grid, parameters)

    @classmethod
    def for_bags(cls, folders: Sequence[EpisodeFolder]) -> 'Relearner | None':
        """
        Return one with workspace and parameters of the last of some bags that holds anything.

        Raises
        ------
        BagError
            If that cannot be read, or is none of ours.

        """
        for folder in reversed(folders):
            with suppress(NothingToLearnError):
                header = Episode(folder).header
                return cls(header.grid, header.parameters)
        return None

    @property
    def refresh(self) -> Refresh | None:
        """Return what is in force; None before the first demonstration."""
        return self._learner.refresh

    @property
    def shown(self) -> Composition | None:
        """Return what looks whether the shown way is free again; None where it is."""
        return self._learner.shown

    def explores(self, spread: bool) -> bool:
        """Return whether the trials of a series explore, see `Learner.explores`."""
        return self._learner.explores(spread)

    def field(self, exploring: bool = False) -> ControlField:
        """Return the field for the next trial, see `Learner.trial_field`."""
        return self._learner.trial_field(exploring)

    def learn(self, episode: Episode) -> LearntBag:
        """
        Learn from one bag.

        Raises
        ------
        BagError
            If it cannot be read, is of another grid, frame or version, or the learner refuses it.

        """
        try:
            episode.header.check_grid(self.grid, episode.path)
            record = episode.content.record
            if isinstance(record, Trial):
                return self._learn_trial(episode, record)
            return self._learn_demonstration(episode, record)
        except NothingToLearnError as error:
            return LearntBag(episode.folder, None, None,
                             why_not=f'{error.why}{remedy_for_frame(error.frame)}')
        except BagError:
            raise
        except ValueError as error:
            raise BagError(f'{episode.path} cannot be learnt from: {error}') from error

    def _learn_demonstration(self, episode: Episode, record: Demonstration) -> LearntBag:
        before, content = self.refresh, episode.content
        refresh = self._learner.add_demonstration(record)
        # A trial from there begins at the centre of the first cell, looking along the drive.
        (row, col), (next_row, next_col) = record.cells[:2].tolist()
        yaw = heading_from_step(next_row - row, next_col - col) * math.pi / 4
        self.demonstrated_starts.append(StartPose(
            *self.grid.world_from_cell(row, col), math.remainder(yaw, math.tau)))
        return LearntBag(episode.folder, content, refresh,
                         '; '.join([str(content.report), *content.notes]),
                         moved=goal_moved(before, refresh))

    def _learn_trial(self, episode: Episode, trial: Trial) -> LearntBag:
        content = episode.content
        if content.doubt:
            return LearntBag(episode.folder, content, None, why_not=content.doubt)
        said = ', '.join(filter(None, [how_it_ended(trial.outcome, trial.n_steps),
                                       '; '.join(content.notes)]))
        if trial.outcome is Outcome.ABORTED:
            return LearntBag(episode.folder, content, None, why_not=f'it {said}')
        self.n_trials += 1
        if self.refresh is None:
            return LearntBag(episode.folder, content, None,
                             why_not=f'no demonstration came before it; it {said}')
        return LearntBag(episode.folder, content, self._learner.add_trial(trial), said)

    def teach_here(self, n: int) -> list[tuple[float, float]]:
        """Return where one more demonstration would help most, (x, y) [m]; a few cells apart."""
        chosen: list[tuple[int, int]] = []
        for cell in self._learner.teach_here(self.grid.n_rows * self.grid.n_cols):
            if len(chosen) == n:
                break
            if all(max(abs(cell[0] - row), abs(cell[1] - col)) >= _APART for row, col in chosen):
                chosen.append(cell)
        return [self.grid.world_from_cell(*cell) for cell in chosen]

    def promising_start(self, rank: int) -> StartPose | None:
        """Return where a trial teaches most, or next most and so on; None if nowhere."""
        if self.refresh is None:
            return None
        rng = np.random.default_rng([self.parameters.seed, self.refresh.field.revision])
        cells = self._learner.next_starts(rank + 1, rng, self.field(exploring=True))
        if not cells:
            return None
        return StartPose(*self.grid.world_from_cell(*cells[min(rank, len(cells) - 1)]))


def relearn(folders: Sequence[EpisodeFolder]) -> tuple[Relearner | None, list[LearntBag]]:
    """
    Learn from bags in their order, with the parameters of the last one.

    Returns
    -------
    relearner : Relearner or None
        None if no bag can be learnt from at all.
    each : list of LearntBag

    Raises
    ------
    BagError
        If one cannot be read, or is of another grid, frame or version.

    """
    relearner = Relearner.for_bags(folders)
    if relearner is None:
        return None, []
    with odd_one_named(folders):
        return relearner, [relearner.learn(Episode(folder)) for folder in folders]


def relearnt(task: TaskFolder) -> Refresh | None:
    """Return what the bags of a task teach now; None if there is no demonstration in them."""
    relearner, _ = relearn(task.episodes())
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


def goal_moved(before: Refresh | None, after: Refresh | None) -> str:
    """Say where the goal is now and where it was; empty if it is still there, or was nowhere."""
    if before is None or after is None or before.field.goal == after.field.goal:
        return ''
    now, was = (each.field.grid.world_from_cell(*each.field.goal) for each in (after, before))
    return f'The goal is now at {place_text(now)} m, it was at {place_text(was)} m'


@contextmanager
def odd_one_named(folders: Sequence[EpisodeFolder]) -> Iterator[None]:
    """
    Let a refusal name the bag that is of another workspace than most, whichever was met first.

    The headers of all bags are read only then.

    Parameters
    ----------
    folders : sequence of EpisodeFolder
        All that are learnt from.

    Raises
    ------
    BagError
        If they are not all of one workspace.

    """
    try:
        yield
    except WorkspaceError:
        check_workspaces(folders)
        raise


def check_workspaces(folders: Sequence[EpisodeFolder]) -> list[EpisodeHeader]:
    """
    Refuse bags of several workspaces; that of most of them counts, of equally many the first.

    Returns
    -------
    list of EpisodeHeader
        Of the bags that hold anything.

    Raises
    ------
    BagError
        If one is of another grid or frame, naming both; or cannot be read, or is of another
        version.

    """
    headers = {}
    for folder in folders:
        with suppress(NothingToLearnError):
            headers[folder] = Episode(folder).header
    grids = Counter(header.grid for header in headers.values())
    if len(grids) > 1:
        common = grids.most_common(1)[0][0]
        usual = [folder for folder, header in headers.items() if header.grid == common]
        odd, header = next(each for each in headers.items() if each[1].grid != common)
        more = f' and {len(usual) - 1} more' if len(usual) > 1 else ''
        raise BagError(
            f'{odd.path} was recorded on {header.grid}, {usual[0].path}{more} on {common}: what '
            f'one task has learnt is of one workspace; `experience forget '
            f'{shlex.quote(str(odd.path))}` takes the odd one out')
    return list(headers.values())


def changes_before(folders: Sequence[EpisodeFolder], number: int) -> list[str]:
    """
    Say which bags before one are not as they were when they were recorded.

    Parameters
    ----------
    folders : sequence of EpisodeFolder
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
    there, task = {folder.number: folder for folder in folders}, folders[0].task
    forgotten = {folder.number for folder in task.forgotten()}
    found = []
    for before in range(1, number):
        if before in there:
            found += [f'{there[before].name} {what}' for what in Episode(there[before]).changes()]
        else:
            what = 'was forgotten' if before in forgotten else 'is not among the bags'
            found.append(f'{task.task}/{before:04d} {what}')
    return found
