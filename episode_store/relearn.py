"""What bags have taught, one after the other."""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from control_field.drives.breaks import place_text
from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.learning.learner import Learner, Refresh
from control_field.parameters import Parameters
from control_field.poses import StartPose
from control_field.records import ControlField, Demonstration, Outcome, Trial
from control_field.words import how_it_ended
from episode_store.episode import Episode, read_episode
from episode_store.rosbag2.errors import BagError, NothingToLearnError
from episode_store.task_folder import EpisodeFolder
from msgs_bridge.messages.frame_hints import with_remedy

#: What a note begins with where a bag taught nothing.
NOTHING: Final = 'nothing was learnt: '
#: Places to teach from are at least this many cells apart.
_APART = 4


@dataclass(frozen=True, eq=False)
class LearntBag:
    """
    What one bag taught.

    Parameters
    ----------
    episode : EpisodeFolder
        The bag.
    read : Episode or None
        What it holds; None where that is no use.
    refresh : Refresh or None
        What was made of it; None if nothing was learnt from it.
    note : str
        What it was, or why nothing was learnt.
    moved : str
        A sentence on where the goal is now and was before; empty if it is where it was.
    missing : str
        What the recording lacks; empty if nothing.

    """

    episode: EpisodeFolder
    read: Episode | None
    refresh: Refresh | None
    note: str
    moved: str = ''
    missing: str = ''


class Relearner:
    """
    The fold over bags: they are learnt from in the order they are given, once each.

    It makes no difference whether that happens as they are recorded or all at once later.

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
        self.shown_starts: list[StartPose] = []
        self._learner = Learner(grid, parameters)

    @property
    def refresh(self) -> Refresh | None:
        """Return what is in force; None before the first demonstration."""
        return self._learner.refresh

    def field(self, curious: bool = False) -> ControlField:
        """Return the field for the next trial, see `Learner.trial_field`."""
        return self._learner.trial_field(curious)

    def learn(self, episode: EpisodeFolder) -> LearntBag:
        """
        Learn from one bag.

        Raises
        ------
        BagError
            If it cannot be read, is of another grid, frame or version, or the learner refuses it.

        """
        try:
            return self._learn(read_episode(episode.path, self.grid))
        except NothingToLearnError as error:
            # The bag is named where this is said.
            why = str(error).removeprefix(f'{episode.path}: ')
            return LearntBag(episode, None, None, with_remedy(f'{NOTHING}{why}'))
        except BagError:
            raise
        except ValueError as error:
            raise BagError(f'{episode.path} cannot be learnt from: {error}') from error

    def _learn(self, read: Episode) -> LearntBag:
        note = '; '.join([*([str(read.report)] if read.report else []), *read.notes])
        if isinstance(read.record, Trial):
            return self._learn_trial(read, read.record, note)
        before = self.refresh
        refresh = self._learner.add_demonstration(read.record)
        self.shown_starts.append(start_of(read.record, self.grid))
        return LearntBag(read.folder, read, refresh, note, goal_moved(before, refresh))

    def _learn_trial(self, read: Episode, trial: Trial, note: str) -> LearntBag:
        if read.doubt:
            return LearntBag(read.folder, read, None, f'{NOTHING}{read.doubt}')
        said = f'{how_it_ended(trial.outcome, trial.n_steps)}' + (f', {note}' if note else '')
        if trial.outcome is Outcome.ABORTED:
            return LearntBag(read.folder, read, None, f'{NOTHING}it {said}')
        self.n_trials += 1
        if self.refresh is None:
            return LearntBag(read.folder, read, None,
                          f'{NOTHING}no demonstration came before it; it {said}')
        return LearntBag(read.folder, read, self._learner.add_trial(trial), said)

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
        cells = self._learner.next_starts(rank + 1, rng, self.field(curious=True))
        if not cells:
            return None
        return StartPose(*self.grid.world_from_cell(*cells[min(rank, len(cells) - 1)]))


def goal_moved(before: Refresh | None, after: Refresh | None) -> str:
    """Say where the goal is now and where it was; empty if it is still there, or was nowhere."""
    if before is None or after is None or before.field.goal == after.field.goal:
        return ''
    now, was = (each.field.grid.world_from_cell(*each.field.goal) for each in (after, before))
    return f'The goal is now at {place_text(now)} m, it was at {place_text(was)} m'


def start_of(demonstration: Demonstration, grid: Grid) -> StartPose:
    """Return where a demonstration started: the centre of its first cell, looking along it."""
    (row, col), (next_row, next_col) = demonstration.cells[:2].tolist()
    yaw = heading_from_step(next_row - row, next_col - col) * math.pi / 4
    return StartPose(*grid.world_from_cell(row, col), math.remainder(yaw, math.tau))
