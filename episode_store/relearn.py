"""
The field as a fold over bags: each teaches in its turn, and nothing else does (ADR 1).

`Relearner` is the fold; whether its bags come one by one or all at once makes no difference.
"""

from collections.abc import Sequence
from contextlib import suppress
import copy
from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from control_field.drives.breaks import place_text
from control_field.drives.tight_end import first_free_cell
from control_field.grid import Grid, TooLargeError
from control_field.headings import heading_from_step
from control_field.learning.compose import Composition
from control_field.learning.growth import FittedWorkspace
from control_field.learning.learner import explores, Learner, Refresh
from control_field.parameters import Parameters
from control_field.poses import StartPose
from control_field.records import ControlField, Demonstration, Outcome, Trial
from control_field.words import how_it_ended
from episode_store.episode import Content, Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, TaskFolder
from episode_store.workspaces import odd_one_named
from msgs_bridge.messages.frame_hints import remedy_for_frame

#: Cells that a workspace may come to have for a place where nothing was learnt.
_MOST_FOR_A_PLACE: Final = 2**20
#: Places to teach from are at least this many cells apart.
_APART: Final = 4


@dataclass(frozen=True, eq=False)
class LearntBag:
    """
    What one bag taught.

    Parameters
    ----------
    folder : EpisodeFolder
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
    code : str
        Why nothing was learnt, for a page that has words of its own; empty for what is rare.

    """

    folder: EpisodeFolder
    content: Content | None
    refresh: Refresh | None
    said: str = ''
    why_not: str = ''
    moved: str = ''
    missing: str = ''
    code: str = ''

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
    grid : Grid or None
        The workspace they must have been recorded in. Where that fits itself, any grid of the
        lattice that they must be of; None: the lattice of the first that teaches anything.
    parameters : Parameters
    fitted : bool
        Whether the workspace fits itself: it is then what the bags need, one after the other.

    """

    def __init__(self, grid: Grid | None, parameters: Parameters, fitted: bool = False) -> None:
        if grid is None and not fitted:
            raise ValueError('a workspace that does not fit itself must be given')
        self.parameters = parameters
        self.fitted = fitted
        self.n_trials = 0
        self.demonstrated_starts: list[StartPose] = []
        self._given = grid
        self._workspace: FittedWorkspace | None = None
        self._learner = Learner(grid, parameters) if grid and not fitted else None

    @classmethod
    def for_header(cls, header: EpisodeHeader) -> 'Relearner':
        """Return one with workspace and parameters of a bag; it may be one that fits itself."""
        return cls(header.grid, header.parameters, header.fitted)

    @classmethod
    def for_bags(cls, folders: Sequence[EpisodeFolder]) -> 'Relearner | None':
        """
        Return one with workspace and parameters of the last of some bags that holds anything.

        If the workspace of that one fits itself, that of all of them does.

        Raises
        ------
        BagError
            If that cannot be read, or is none of ours.

        """
        for folder in reversed(folders):
            with suppress(NothingToLearnError):
                return cls.for_header(Episode(folder).header)
        return None

    @property
    def grid(self) -> Grid | None:
        """Return the workspace; None where it fits itself and nothing was learnt yet."""
        return None if self._learner is None else self._learner.grid

    @property
    def refresh(self) -> Refresh | None:
        """Return what is in force; None before the first demonstration."""
        return None if self._learner is None else self._learner.refresh

    @property
    def shown(self) -> Composition | None:
        """Return what looks whether the shown way is free again; None where it is."""
        return None if self._learner is None else self._learner.shown

    def explores(self, spread: bool) -> bool:
        """Return whether the trials of a series explore, see `learner.explores`."""
        return explores(self.parameters, spread)

    def field(self, exploring: bool = False) -> ControlField:
        """
        Return the field for the next trial, see `Learner.trial_field`.

        Raises
        ------
        ValueError
            If nothing was demonstrated yet.

        """
        return self._taught().trial_field(exploring)

    def _taught(self) -> Learner:
        if self._learner is None:
            raise ValueError('nothing was demonstrated yet')
        return self._learner

    def learn(self, episode: Episode) -> LearntBag:
        """
        Learn from one bag.

        Raises
        ------
        BagError
            If it cannot be read, is of another grid, frame or version (of a workspace that fits
            itself: of other cells), or the learner refuses it.

        """
        try:
            self._check_workspace(episode)
            record = episode.content.record
            if isinstance(record, Trial):
                return self._learn_trial(episode, record)
            return self._learn_demonstration(episode, record)
        except NothingToLearnError as error:
            return LearntBag(episode.folder, None, None,
                             why_not=error.why + remedy_for_frame(error.frame), code=error.code)
        except BagError:
            raise
        except ValueError as error:
            raise BagError(f'{episode.path} cannot be learnt from: {error}') from error

    def _check_workspace(self, episode: Episode) -> None:
        """Refuse a bag of another workspace, or of other cells than one that fits itself."""
        grid = self._workspace.lattice if self._workspace else self._given
        if grid is not None:
            check = episode.header.check_lattice if self.fitted else episode.header.check_grid
            check(grid, episode.path)

    def _learn_record(self, record: Demonstration | Trial, of: Grid) -> Refresh:
        """Learn an episode whose cells are those of a grid; a workspace that fits grows first."""
        learner, workspace = self._learner, self._workspace
        if self.fitted:
            workspace = (workspace or FittedWorkspace(of.lattice)).with_record(record, of)
            grid = workspace.grid
            assert grid is not None
            learner = learner or Learner(grid, self.parameters, fitted=True)
            offset = of.offset_to(grid)
            assert offset is not None
            record = record.shifted(*offset)
        assert learner is not None
        grid = workspace.grid if workspace else None
        refresh = (learner.add_trial(record, grid) if isinstance(record, Trial) else
                   learner.add_demonstration(record, grid))
        # Only now: what was refused has changed nothing.
        self._learner, self._workspace = learner, workspace
        return refresh

    def _learn_demonstration(self, episode: Episode, record: Demonstration) -> LearntBag:
        before, content, grid = self.refresh, episode.content, episode.header.grid
        refresh = self._learn_record(record, grid)
        # A trial from there begins at the centre of a cell, looking along the drive.
        first = first_free_cell(record)
        (row, col), (next_row, next_col) = record.cells[first:first + 2].tolist()
        yaw = heading_from_step(next_row - row, next_col - col) * math.pi / 4
        self.demonstrated_starts.append(StartPose(
            *grid.world_from_cell(row, col), math.remainder(yaw, math.tau)))
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
        refresh = self._learn_record(trial, episode.header.grid)
        return LearntBag(episode.folder, content, refresh, said)

    def grown_to(self, places: Sequence[tuple[float, float]]) -> 'Relearner':
        """
        Return one that knows the same in a workspace with room for a robot at places.

        Parameters
        ----------
        places : sequence of (x, y), [m]

        Returns
        -------
        Relearner
            Itself if there is room, if the workspace does not fit itself, or before it is there.

        Raises
        ------
        TooLargeError
            If no workspace has so many cells, or it would be much larger than what was learnt:
            a place may be wrong.

        """
        grid = self.grid
        if self._workspace is None or grid is None or not places:
            return self
        larger = self._workspace.with_places(np.array(places, dtype=np.float64)).grid
        if larger is None:
            return self
        _check_moderate(larger, grid)
        return self.in_workspace(larger)

    def in_workspace(self, grid: Grid) -> 'Relearner':
        """
        Return one that knows the same in a workspace that holds a grid of the lattice, too.

        Itself if that is so already, or the workspace does not fit itself.
        """
        learner, workspace = self._learner, self._workspace
        if learner is None or workspace is None:
            return self
        larger = workspace.with_grid(grid)
        if larger == workspace or larger.grid is None:
            return self
        grown = copy.copy(self)
        grown._workspace, grown._learner = larger, learner.grown_to(larger.grid)
        return grown

    def teach_here(self, n: int) -> list[tuple[float, float]]:
        """Return where one more demonstration would help most, (x, y) [m]; a few cells apart."""
        learner, chosen = self._taught(), list[tuple[int, int]]()
        for cell in learner.teach_here(learner.grid.n_rows * learner.grid.n_cols):
            if len(chosen) == n:
                break
            if all(max(abs(cell[0] - row), abs(cell[1] - col)) >= _APART for row, col in chosen):
                chosen.append(cell)
        return [learner.grid.world_from_cell(*cell) for cell in chosen]

    def promising_start(self, rank: int) -> StartPose | None:
        """Return where a trial teaches most, or next most and so on; None if nowhere."""
        if self._learner is None or self.refresh is None:
            return None
        rng = np.random.default_rng([self.parameters.seed, self.refresh.field.revision])
        cells = self._learner.next_starts(rank + 1, rng, self.field(exploring=True))
        if not cells:
            return None
        return StartPose(*self._learner.grid.world_from_cell(*cells[min(rank, len(cells) - 1)]))


def _check_moderate(larger: Grid, learnt: Grid) -> None:
    n_cells, n_learnt = (grid.n_rows * grid.n_cols for grid in (larger, learnt))
    most = max(_MOST_FOR_A_PLACE, 2 * n_learnt)
    if n_cells > most:
        raise TooLargeError(f'{larger.size} would hold it, which is more than {most} cells')


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
    if before is None or after is None:
        return ''
    now, was = (each.field.grid.world_from_cell(*each.field.goal) for each in (after, before))
    if math.dist(now, was) < 0.5 * after.field.grid.resolution:
        return ''  # the workspace may have grown meanwhile
    return f'The goal is now at {place_text(now)} m, it was at {place_text(was)} m'


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
