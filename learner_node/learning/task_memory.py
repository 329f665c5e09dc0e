"""The bags of a task, and what they have taught so far."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
import math
from typing import Final

import numpy as np

from control_field.drives.plausibility import SPEED_MAX
from control_field.grid import default_lattice, fitted_workspace, Grid, TooLargeError
from control_field.learning.learner import Refresh
from control_field.parameters import Parameters
from control_field.poses import StartPose
from control_field.records import ControlField
from control_field.words import counted, sentences
from episode_store.episode import Episode
from episode_store.errors import UnwritableError
from episode_store.gaps import note_gaps
from episode_store.header import EpisodeHeader
from episode_store.relearn import goal_moved, LearntBag, Relearner
from episode_store.repair import repair_task
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, EpisodeKind, TaskFolder
from episode_store.undo import bring_back, names_of, take_away, UNDO
from learner_node.learning.task_bags import bag_named, BagCounts, check_writable, set_aside
from msgs_bridge.messages.memory_identity import memory_of, NOTHING
from msgs_bridge.messages.poses import FRAME_OWNERS, problem_with_frame
from msgs_bridge.messages.trial_status import Label

#: Places to teach from that are told of.
_N_PLACES: Final = 5
#: Side of a cell where nobody says, [m].
_SIDE: Final = 0.25
#: By how much sides of cells may differ that are the same, as a share.
_SAME_SIDE: Final = 1e-4


class TaskMemory:
    """
    The bags of a task and what they have taught so far.

    Parameters
    ----------
    task : TaskFolder
    grid : Grid or None
        The workspace; None: it fits itself.
    parameters : Parameters
    starts : sequence of StartPose
        Where trials start, in turn; empty: where the demonstrations started.
    fresh : bool
        Whether to set the bags that are there aside.

    Attributes
    ----------
    lattice : callable
        Returns a cell of those that a first demonstration is recorded on, if the workspace fits
        itself.
    robot : callable
        Returns where the robot stands, ``(x, y)`` [m]; None if it was not heard of.
    resolution : float, [m]
        Side of the cells that are wanted; 0: that of the bags.
    too_far : str
        Why the field has no room for where trials start, or the robot stands; empty if it has.

    Raises
    ------
    BagError
        If the folder cannot be written.

    """

    def __init__(
        self, task: TaskFolder, grid: Grid | None, parameters: Parameters,
        starts: tuple[StartPose, ...] = (), fresh: bool = False,
    ) -> None:
        self.task = task
        self.topics: Mapping[str, str] = {}
        #: What is written into new bags: no drive that is faster is learnt, [m/s].
        self.speed_max = SPEED_MAX
        #: Lines for people to heed, of the last time that all bags were learnt from.
        self.doubts: list[str] = []
        #: Where trials start, ``x y yaw``, and where to teach next, ``x y; x y``, [m, rad].
        self.places: Mapping[str, str] = {}
        self._has_compared = False
        self._given = grid
        self.lattice: Callable[[], Grid] = partial(default_lattice, _SIDE)
        self.robot: Callable[[], tuple[float, float] | None] = lambda: None
        self.resolution = 0.0
        self.too_far = ''
        self.relearner = self._driven = self._new_fold(parameters)
        #: Whose field is in force, see `memory_identity`.
        self.memory = NOTHING
        self._starts = starts
        self._n_asked = 0
        self._counts = BagCounts()
        check_writable(task)
        self.aside = set_aside(task) if fresh else ''

    def _new_fold(self, parameters: Parameters) -> Relearner:
        return Relearner(self._given, parameters, fitted=self._given is None)

    @property
    def grid(self) -> Grid:
        """Return the workspace that is driven in, or that a first demonstration begins in."""
        found = self._driven.grid or self._given
        return found or fitted_workspace(
            self.lattice(), np.array([self.robot() or (0.0, 0.0)], dtype=np.float64))

    @property
    def learnt_grid(self) -> Grid | None:
        """Return the workspace of what was learnt; None where nothing was, in one that fits."""
        return self.relearner.grid

    @property
    def driven(self) -> Refresh | None:
        """Return the newest refresh with room for where trials start and the robot stands."""
        return self._driven.refresh

    def has_room(self, place: tuple[float, float]) -> bool:
        """Return whether the field that is driven on holds a robot at a place, [m]."""
        grid = self._driven.grid
        if grid is None or self._given is not None:
            return True
        row, col = grid.cell_from_world(*place)
        return grid.contains(row - 1, col - 1) and grid.contains(row + 1, col + 1)

    def make_room(self) -> None:
        """
        Let the field that is driven on hold where trials start, and where the robot stands.

        What was learnt stays the same: the next bag begins in this workspace, and is folded into
        that of the bags.

        Raises
        ------
        TooLargeError
            If no workspace has so many cells.

        """
        robot, places = self.robot(), [(start.x, start.y) for start in self._starts]
        self._driven = self.relearner.grown_to(places if robot is None else [*places, robot])

    @property
    def refresh(self) -> Refresh | None:
        """Return the newest refresh; None before the first demonstration."""
        return self.relearner.refresh

    @property
    def n_trials(self) -> int:
        """Return the number of trials that were not aborted."""
        return self.relearner.n_trials

    def field(self, exploring: bool = False) -> ControlField:
        """Return the field for the next trial, see `Learner.trial_field`."""
        return self._driven.field(exploring)

    def header(self, kind: EpisodeKind) -> Mapping[str, str]:
        """Return the header of a bag that begins now."""
        return EpisodeHeader(kind, self.task.task, self.grid, self.relearner.parameters,
                             self.topics, self.speed_max,
                             self.memory if kind is EpisodeKind.TRIAL else '',
                             fitted=self._given is None).to_mapping()

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
            If a bag cannot be read, or is of another grid, frame or version. What is in force
            stays so.

        """
        lines, self.aside = [self.aside] if self.aside else [], ''
        lines += self._mend()
        self._compare()
        fold = self._new_fold(self.relearner.parameters)
        learnt_bags = [fold.learn(Episode(folder)) for folder in self.task.episodes()]
        self._check_cells(fold)
        # Only now: until all of them are learnt from, and if that fails, the field stays.
        self.relearner, self._n_asked = fold, 0
        self._settle()
        lines += [f'{learnt_bag.folder.name}: {learnt_bag.note}'
                  for learnt_bag in learnt_bags if learnt_bag.refresh is None]
        if learnt_bags:
            kinds = [learnt_bag.folder.kind
                     for learnt_bag in learnt_bags if learnt_bag.refresh is not None]
            n_demos = kinds.count(EpisodeKind.DEMO)
            lines.append(f'{self.task.path}: relearnt from {counted(n_demos, "demonstration")} '
                         f'and {counted(len(kinds) - n_demos, "trial")}')
        return lines

    def _check_cells(self, fold: Relearner) -> None:
        """Refuse to go on with other cells, or in another frame, than were asked for."""
        grid, wanted = fold.grid, self.resolution
        if grid is None or self._given is not None:
            return
        if problem := problem_with_frame(
                grid.frame_id, self.lattice().frame_id, f'{self.task.path}', FRAME_OWNERS):
            raise BagError(f'{problem}, or begin another task (-p task:=...)')
        if wanted and not math.isclose(grid.resolution, wanted, rel_tol=_SAME_SIDE):
            raise BagError(
                f'{self.task.path} has bags of cells of {grid.resolution:g} m, and resolution is '
                f'{wanted:g} m: leave resolution out, or begin another task (-p task:=...)')

    def _mend(self) -> list[str]:
        """Repair bags that were cut; where the disk refuses, they are read as they are."""
        self.doubts = []
        try:
            return [f'found {report}' for report in repair_task(self.task)]
        except UnwritableError as error:
            self.doubts = [f'{error}; what is readable of it is learnt from as it is']
            return []

    def _compare(self) -> None:
        """Note at the start which parameters differ from those of the newest bag."""
        if self._has_compared:
            return
        self._has_compared = True
        for episode in reversed(self.task.episodes()):
            try:
                theirs = asdict(Episode(episode).header.parameters)
            except BagError:  # said where it is learnt from
                continue
            ours = asdict(self.relearner.parameters)
            changes = [f'{name}: {theirs[name]} -> {value}' for name, value in ours.items()
                       if theirs[name] != value]
            if changes:
                self.doubts.append(f'{episode.name} was recorded with other parameters, the bags '
                                   f'are learnt anew with those set now: {", ".join(changes)}')
            return

    def learn(self, folder: EpisodeFolder) -> LearntBag:
        """Learn from a bag that was just recorded (`Relearner.learn`); note what is missing."""
        self._n_asked = 0
        episode = Episode(folder)
        gaps = note_gaps(episode)
        learnt_bag = self.relearner.learn(episode)
        self._settle()
        return replace(learnt_bag, missing=str(gaps))

    def _settle(self) -> None:
        """Name what was learnt, and make room for it to be driven on."""
        refresh = self.refresh
        self._driven, self.too_far = self.relearner, ''
        try:
            self.make_room()
        except TooLargeError as error:
            self.too_far = str(error)
        self.memory = NOTHING if refresh is None else memory_of(
            self.task.task, refresh.field, refresh.prototypes)

    def drop(self, name: str = '') -> str:
        """
        Take a bag away and relearn from the others; return what to tell people.

        Parameters
        ----------
        name : str
            Such as ``0001_demo``; empty: the newest.

        Raises
        ------
        BagError
            If there is none, it cannot be moved, or the others cannot be relearnt from.

        """
        bag = bag_named(self.task, name)
        take_away(self.task, [bag.number])
        return self._relearn_after(f'{bag.name} is dropped ({UNDO})')

    def counts(self) -> dict[str, str]:
        """Return how many bags there are, and whether any was taken away, for diagnostics."""
        return self._counts.of(self.task)

    def find_places(self) -> None:
        """Note where trials start and where one more demonstration would help most."""
        starts = [*self._starts, *self.relearner.demonstrated_starts][:1]
        spots = self.relearner.teach_here(_N_PLACES) if self.refresh is not None else []
        self.places = {
            'start': ' '.join(f'{value:.3f}' for pose in starts
                              for value in (pose.x, pose.y, pose.yaw)),
            'teach_here': '; '.join(f'{x:.3f} {y:.3f}' for x, y in spots)}

    def undo(self) -> str:
        """
        Bring back what was taken away last, and relearn; return what to tell people.

        Raises
        ------
        BagError
            If nothing was taken away, it cannot be moved, or the bags cannot be relearnt from.

        """
        back = bring_back(self.task)
        return self._relearn_after(
            f'{names_of(back)} {"is" if len(back) == 1 else "are"} back')

    def label(self, label: Label, name: str = '') -> str:
        """
        Note what a person says of a bag, and relearn; return what to tell people.

        Parameters
        ----------
        label : Label
        name : str
            Such as ``0001_demo``; empty: the newest.

        Raises
        ------
        BagError
            If there is none, it cannot be noted, or the bags cannot be relearnt from.

        """
        bag = bag_named(self.task, name)
        Episode(bag).judge(label)
        return self._relearn_after(f'{bag.name} is labelled {label}')

    def _relearn_after(self, change: str) -> str:
        before = self.refresh
        try:
            self.relearn()
        except BagError as error:
            raise BagError(f'{change}, but the control field stays as it was: {error}') from None
        moved = goal_moved(before, self.refresh)
        return sentences([change, self._standing(), moved])

    def _standing(self) -> str:
        if self.refresh is None:
            return 'Nothing is left that was demonstrated: show the way again'
        return self.refresh.certificate.sentence()

    def next_start(self, spread: bool) -> StartPose:
        """
        Return where the next trial starts; asked again before it was learnt from, another place.

        Parameters
        ----------
        spread : bool
            Whether to start where a trial teaches most.

        Raises
        ------
        ValueError
            If nothing was demonstrated yet and no start is set.

        """
        asked, self._n_asked = self._n_asked, self._n_asked + 1
        promising = self.relearner.promising_start(asked) if spread else None
        if promising is not None:
            return promising
        poses = self._starts or tuple(self.relearner.demonstrated_starts)
        if not poses:
            raise ValueError('nothing was demonstrated yet')
        return poses[(self.n_trials + asked) % len(poses)]
