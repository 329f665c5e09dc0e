"""A bag of ours, opened: what it says of itself, what it teaches, and what is wrong with it."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
import math
import os
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import ImplausibleDriveError
from control_field.drives.demonstration import DemonstrationReport, TooShortError
from control_field.drives.workspace import OutsideWorkspaceError
from control_field.records import (
    ControlField, DECISION_DTYPE, Demonstration, Outcome, Prototypes, Trial)
from control_field.words import counted
from episode_store.damage import Damage, find_damage
from episode_store.drives import LeadsNowhereError, NoPoseError, read_drive, remedy_for_own
from episode_store.errors import NothingToLearnError
from episode_store.gaps import BagGaps, find_gaps
from episode_store.header import EpisodeHeader, find_topic
from episode_store.label import read_label, write_label
from episode_store.rosbag2.bag_files import storage_files
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.metadata import NAME
from episode_store.rosbag2.reader import BagReader, RawMessages
from episode_store.rosbag2.topic_tables import decision_table, statuses
from episode_store.rosbag2.writer import HEADER_NAME
from episode_store.task_folder import episode_from_path, EpisodeFolder, EpisodeKind
from episode_store.trials import doubt_about, judged, own_trial
from episode_store.wide_local_grids import trial_local_grids
from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.raw_cloud import cloud_from_cdr
from msgs_bridge.messages.tables import field_from_cloud, prototypes_from_cloud
from msgs_bridge.messages.trial_status import Label, State, TrialStatus

#: What is wrong with a drive, for a page that has words of its own.
DRIVE_CODES: Final[Mapping[type[ValueError], str]] = {
    TooShortError: 'too_short', LeadsNowhereError: 'leads_nowhere',
    ImplausibleDriveError: 'implausible', OutsideWorkspaceError: 'outside'}
_Table = TypeVar('_Table', ControlField, Prototypes)


@dataclass(frozen=True, eq=False)
class Content:
    """
    What a bag teaches.

    Its cells are those of the header's workspace; where that fits itself, they may lie outside.

    Parameters
    ----------
    record : Demonstration or Trial
        What the learner is given; it heeds what a person said.
    report : DemonstrationReport or None
        What of a demonstration was dropped.
    status : TrialStatus or None
        How it ended; None for a trial that was broken off.
    notes : tuple of str
        Sentences on what was passed over.
    doubt : str
        Why a trial and its odometry do not belong together; it is as good as aborted then.

    """

    record: Demonstration | Trial
    report: DemonstrationReport | None
    status: TrialStatus | None
    notes: tuple[str, ...]
    doubt: str = ''


@dataclass(frozen=True, eq=False)
class Poses:
    """
    The odometry of a drive, message by message.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    log_times : ndarray of int64, shape (n,), [ns]
    xyyaw : ndarray, shape (n, 3), [m] and [rad]

    """

    stamps: npt.NDArray[np.float64]
    log_times: npt.NDArray[np.int64]
    xyyaw: npt.NDArray[np.float64]


class Episode:
    """
    A bag of ours, opened; each part is read when it is asked for, and once.

    Whatever is asked for raises a `BagError` if the bag cannot be read or is none of ours, and a
    `NothingToLearnError` if its recorder was stopped before it wrote anything.

    Parameters
    ----------
    folder : EpisodeFolder
        Where it is; it may be damaged: what is readable of it counts.

    """

    def __init__(self, folder: EpisodeFolder) -> None:
        self.folder = folder

    @classmethod
    def at(cls, path: Path | str) -> 'Episode':
        """Return the bag in a folder; BagError if that is not named like one of ours."""
        return cls(episode_from_path(Path(path)))

    @property
    def path(self) -> Path:
        """Return its folder."""
        return self.folder.path

    @cached_property
    def bag(self) -> BagReader:
        """Return the recording."""
        path = self.folder.bag
        if not self.path.is_dir() or os.path.lexists(path):
            return BagReader(path)
        others = [file.name for file in storage_files(self.path) if file.suffix == '.mcap']
        if others:
            raise BagError(f'{self.path} holds {others[0]} and no {path.name}: give the folder or '
                           f'the file its name back')
        raise NothingToLearnError(
            self.path, f'there is no {path.name}: its recorder was stopped at once')

    @cached_property
    def header(self) -> EpisodeHeader:
        """Return what it says of itself."""
        for name, values in self.bag.metadata:
            if name == HEADER_NAME:
                try:
                    return EpisodeHeader.from_mapping(values)
                except BagError as error:
                    raise BagError(f'{self.bag.path}: {error}') from None
        if self.bag.channels:
            raise BagError(f'{self.bag.path} is no bag of ours: it does not say on which grid it '
                           f'was recorded')
        if self.bag.n_lost_bytes or self.bag.path.with_suffix('.mcap.cut').exists():
            raise NothingToLearnError(
                self.path, 'it was cut off so early that no message is left in it')
        raise NothingToLearnError(self.path, 'it is empty: its recorder was stopped at once')

    def messages(self, role: str) -> RawMessages:
        """Return the messages of a topic by its role, such as `odom`."""
        return self.bag.messages(find_topic(self.bag.topics, role, self.header.topics))

    @cached_property
    def status(self) -> TrialStatus | None:
        """Return how it ended, as it was recorded; None if nobody says."""
        if self.header.kind is EpisodeKind.TRIAL:
            return self._own_trial[1]
        # The learner's own: those of trial 0 are none of the controller's.
        return next((status for _, status in statuses(self.messages('trial'), newest_first=True)
                     if status.trial == 0 and status.state in (State.RUNNING, State.ENDED)), None)

    @cached_property
    def label(self) -> Label:
        """Return what a person said of it last: since it was recorded, else while it was."""
        since = read_label(self.path)
        if since is not None:
            return since
        return Label.NONE if self.status is None else self.status.label

    def judge(self, label: Label) -> None:
        """
        Keep what a person says of it; nothing that was recorded is changed.

        Parameters
        ----------
        label : Label
            `Label.NONE` takes back what was said. Unless that was said while it was recorded, the
            folder is then, byte by byte, as it was before anything was said.

        Raises
        ------
        BagError
            If the label cannot be written, or the bag was not closed.

        """
        recorded = Label.NONE
        with suppress(NothingToLearnError):
            recorded = recorded if self.status is None else self.status.label
        write_label(self.path, None if label is recorded is Label.NONE else label)
        self.__dict__.pop('label', None)

    def changes(self) -> list[str]:
        """Say what people have changed about it since it was recorded."""
        label = read_label(self.path)
        return [*(['was cut'] if self.folder.whole.exists() else []),
                *([f'was labelled {label or "none"}'] if label is not None else [])]

    @property
    def is_closed(self) -> bool:
        """Return True unless the bag was not closed, and is to be mended."""
        path = self.folder.bag
        try:
            if not path.exists() or not (self.path / NAME).exists() or not path.stat().st_size:
                return False
        except OSError as error:
            raise BagError(error_line('read', self.path, error)) from None
        return not self.bag.damage

    @cached_property
    def gaps(self) -> BagGaps:
        """Return what is missing in its middle; what was cut off its end is no gap."""
        try:
            return find_gaps(self)
        except BagError:
            raise
        except ValueError as error:
            raise BagError(f'{self.path}: {error}') from None

    @cached_property
    def damage(self) -> Damage:
        """Return all that is wrong with it; this raises nothing."""
        return find_damage(self)

    @cached_property
    def content(self) -> Content:
        """
        Return what it teaches.

        Raises
        ------
        NothingToLearnError
            If there is nothing in it to learn from.
        BagError
            If it cannot be read, or is of another version.

        """
        kind = self.header.kind
        if kind is not self.folder.kind:
            raise BagError(f'{self.path} holds a {kind}, its name says {self.folder.kind}')
        try:
            return self._demonstration() if kind is EpisodeKind.DEMO else self._trial()
        except BagError:
            raise
        except ValueError as error:
            raise BagError(f'{self.path}: {error}') from None

    def _demonstration(self) -> Content:
        self._check_kept()
        header = self.header
        try:
            record, report, notes = read_drive(
                self.bag, header.topics, header.grid, self.folder.number, header.speed_max,
                header.fitted)
        except BagError:
            raise
        except ValueError as error:
            frame = error.frame if isinstance(error, NoPoseError) else ''
            raise NothingToLearnError(
                self.path, f'{error}{remedy_for_own(error, self.folder.name)}', frame,
                DRIVE_CODES.get(type(error), '')) from None
        return Content(record, report, self.status, (*notes, *self._beside()))

    def _check_kept(self) -> None:
        """
        Refuse a demonstration that was begun and not kept, unless a person has judged it since.

        The learner brackets a demonstration by statuses; a bag without any of them counts as kept.
        """
        if self.label is Label.FAILURE:
            raise NothingToLearnError(self.path, 'a person labelled the demonstration a failure')
        last = self.status
        if last is not None and last.outcome is not Outcome.GOAL and (
                self.label is not Label.SUCCESS):
            why = last.reason or 'its recorder was stopped'
            raise NothingToLearnError(self.path, f'the demonstration was not kept: {why}')

    def _trial(self) -> Content:
        self._check_memory()
        (_, n_refused, refusal), ended, own = self._decision_table, self.status, self.decisions
        notes = [f'{counted(n_refused, "message")} refused, the first: {refusal}'] if (
            n_refused) else []
        if ended is not None and ended.decisions > len(own):
            notes.append(f'{ended.decisions - len(own)} of {ended.decisions} decisions are '
                         f'missing')
        if self.label:
            notes.append(f'labelled {self.label} by a person')
        outcome = ended.outcome if ended is not None and ended.outcome else Outcome.ABORTED
        doubt = '' if outcome is Outcome.ABORTED else doubt_about(
            self.messages('odom'), self.header, own, ended, self.messages('control_field'))
        outcome = Outcome.ABORTED if doubt else judged(outcome, self.label)
        wide = trial_local_grids(
            self.messages('neighbourhood'), self.header, own,
            ended.stamp if ended is not None and ended.stamp else math.inf)
        return Content(Trial(own, outcome, self.folder.number, wide), None, ended,
                       (*notes, *self._beside()), doubt)

    def _check_memory(self) -> None:
        """Refuse a trial on the field of another memory; old bags do not say which it was."""
        ended = self.status
        if not self.header.memory or ended is None or ended.outcome is Outcome.ABORTED:
            return
        problem = difference(ended.memory, self.header.memory)
        if problem:
            raise NothingToLearnError(self.path, f'the controller {problem}')

    def _beside(self) -> list[str]:
        """Name the recordings beside its own."""
        return [f'{file.name} lies beside it and is not read' for file in storage_files(self.path)
                if file.name != self.folder.bag.name]

    @cached_property
    def _decision_table(self) -> tuple[npt.NDArray[np.void], int, str]:
        return decision_table(
            self.messages('experience'), self.header.grid, self.header.fitted)

    @cached_property
    def _own_trial(self) -> tuple[int, TrialStatus | None]:
        return own_trial(self.messages('trial'), self._decision_table[0])

    @property
    def decisions(self) -> npt.NDArray[np.void]:
        """Return the decisions of the trial that it is about; none for a demonstration."""
        if self.header.kind is EpisodeKind.DEMO:
            return np.zeros(0, dtype=DECISION_DTYPE)
        rows = self._decision_table[0]
        return np.asarray(rows[rows['trial'] == self._own_trial[0]])

    @cached_property
    def poses(self) -> Poses:
        """Return where the robot was, message by message."""
        messages = self.messages('odom')
        if not len(messages):
            return Poses(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
        names = ('sec', 'nanosec', 'x', 'y', 'qx', 'qy', 'qz', 'qw')
        columns = read_columns(messages, dict.fromkeys(names, 1))
        kept = columns.accepted
        sec, nanosec, x, y, qx, qy, qz, qw = (columns.values[name][kept] for name in names)
        yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        return Poses(sec + nanosec * 1e-9, messages.log_times[kept],
                     np.stack([x, y, yaw], axis=1))

    @property
    def start(self) -> float:
        """Return the stamp at which the drive begins, [s]; 0 for a bag without odometry."""
        return float(self.poses.stamps[0]) if len(self.poses.stamps) else 0.0

    @property
    def duration(self) -> float:
        """Return how long the drive lasts, [s]."""
        stamps = self.poses.stamps
        return float(stamps[-1] - stamps[0]) if len(stamps) else 0.0

    @property
    def begun(self) -> float | None:
        """Return the time of day of the first record, [s] since 1970; None in simulated time."""
        first = min((int(self.bag.messages(topic).log_times.min())
                     for topic, n in self.bag.counts.items() if n), default=0) * 1e-9
        return first if first > 1e9 else None

    def field(self, before: int | None = None) -> ControlField | None:
        """Return the newest field, at most as new as a log time [ns]; None if there is none."""
        return self._newest('control_field', field_from_cloud, before)

    def prototypes(self, before: int | None = None) -> Prototypes | None:
        """Return the newest prototypes, see `field`."""
        return self._newest('prototypes', prototypes_from_cloud, before)

    def _newest(
        self, role: str, read: Callable[..., _Table], before: int | None,
    ) -> _Table | None:
        messages = self.messages(role)
        times = messages.log_times
        found = np.arange(len(times)) if before is None else np.flatnonzero(times <= before)
        try:
            return read(cloud_from_cdr(messages[int(found[-1])])) if len(found) else None
        except ValueError as error:
            raise BagError(f'{self.path}: {error}') from None
