"""Why the robot did what it did at a moment: decision, command, who had a say in the heading."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.learning.provenance import Voices, voices_at
from control_field.local_grid import UNKNOWN
from control_field.records import ControlField, Kind, Prototypes
from control_field.robot.collision_monitor import limit_command
from control_field.robot.limits import Limits, STANDSTILL, Velocity
from control_field.robot.obstacle_boxes import local_grid_from_cells, LocalGrid
from control_field.windows import moved
from episode_store.episode import Episode
from episode_store.errors import NoSuchMomentError
from episode_store.relearn import Relearner
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.topic_tables import decision_table, local_grid_table, statuses
from msgs_bridge.messages.trial_status import TrialStatus

#: A requested command belongs to a moment if it is no older, [s].
_RECENT = 0.5
#: Time since the command before, where there is none, [s].
_USUAL_STEP = 0.05
#: Commands that differ by less are the same one, [m/s] and [rad/s].
_SAME = 1e-6
#: Taken where nobody says what the robot is.
BURGER: Final = Limits()
_NO_HEADING: Final[Mapping[str, str]] = {
    'taken_over': 'the bag holds no field: it was taken over from {}',
    'outside': 'the workspace of the field that was in force did not reach there',
    'not_yet': 'there was no field yet',
    'not_recorded': 'the bag holds no field: which one was in force is not known'}


class NoHeading(StrEnum):
    """Why there is no heading to be explained."""

    TAKEN_OVER = 'taken_over'      #: the bag was taken over from another recorder's
    OUTSIDE = 'outside'            #: the workspace of the field in force did not reach there
    NOT_YET = 'not_yet'            #: nothing had been learnt
    NOT_RECORDED = 'not_recorded'  #: which field was in force is not known


@dataclass(frozen=True)
class MonitoredVelocity:
    """
    What the collision monitor makes of the requested command under the limits assumed.

    Parameters
    ----------
    velocity : tuple of float, [m/s] and [rad/s]
    rule : str
        `collision_monitor.Intervention`.
    reproduces : bool
        Whether that is the command that went to the wheels.

    """

    velocity: Velocity
    rule: str
    reproduces: bool


@dataclass(frozen=True, eq=False)
class ExplainedHeading:
    """
    The field's heading in a cell, taken apart.

    Parameters
    ----------
    field : ControlField
    prototypes : Prototypes
        That it was made of.
    voices : Voices or None
        None if the prototypes do not make up the field's vector.
    source : str
        ``recorded``, ``relearnt`` (the recorded map has changed since the headings were made) or
        ``curious`` (a trial that was to look around: no prototype had a say).
    cell : tuple of int
        The cell, of the field's workspace.

    """

    field: ControlField
    prototypes: Prototypes
    voices: Voices | None
    source: str
    cell: tuple[int, int]


class Moment:
    """
    A moment of a bag.

    Parameters
    ----------
    episode : Episode
    at : float, [s]
        From the first odometry; past the end of the drive, a stamp.
    limits : Limits
        Of the body, which are not in a bag.

    Raises
    ------
    NoSuchMomentError
        If the drive does not reach it.

    """

    def __init__(self, episode: Episode, at: float, limits: Limits = BURGER) -> None:
        self.episode = episode
        self.limits = limits
        self.header = episode.header
        poses = episode.poses
        if not len(poses.stamps):
            raise NoSuchMomentError(f'{episode.folder.name} holds no odometry, nothing to explain')
        stamp = _stamp_of(episode, at)
        self._i = int(np.flatnonzero(poses.stamps <= stamp + 1e-6)[-1])
        self.stamp = float(poses.stamps[self._i])
        self.log_time = int(poses.log_times[self._i])
        x, y, yaw = poses.xyyaw[self._i].tolist()
        self.pose = (x, y, yaw)
        self.robot_cell = self.header.grid.cell_from_world(x, y)

    @property
    def seconds(self) -> float:
        """Return the time since the drive began, [s]."""
        return self.stamp - self.episode.start

    @cached_property
    def decisions(self) -> npt.NDArray[np.void]:
        """
        Return the decision in force, its refused heading before it; none before the first one.

        Returns
        -------
        ndarray of DECISION_DTYPE, shape (0 to 2,)

        """
        rows = decision_table(self.episode.messages('experience'), self.header.grid,
                              self.header.fitted)[0]
        if len(rows):
            rows = rows[rows['trial'] == rows['trial'][-1]]
        past = rows[rows['stamp'] <= self.stamp + 1e-6]
        if not len(past):
            return past
        if len(past) > 1 and past['kind'][-2] == Kind.BLOCKED and (
                past['stamp'][-2] == past['stamp'][-1]):
            return past[-2:]
        return past[-1:]

    @property
    def cell(self) -> tuple[int, int]:
        """Return the cell that the command comes from: where the step was decided."""
        if len(self.decisions):
            return int(self.decisions[-1]['row']), int(self.decisions[-1]['col'])
        return self.robot_cell

    @cached_property
    def status(self) -> TrialStatus | None:
        """Return how the trial stood."""
        messages = self.episode.messages('trial')
        found = None
        for i, status in statuses(messages):
            if messages.log_times[i] <= self.log_time:
                found = status
        return found

    @cached_property
    def applied(self) -> Velocity | None:
        """Return the command that went to the wheels, [m/s] and [rad/s]."""
        return self._command('cmd_vel', self._i)

    @cached_property
    def requested(self) -> Velocity | None:
        """Return the command that was asked for, as far as it was recorded."""
        return self._command('cmd_vel_requested', self._i)

    @property
    def clipped_by(self) -> str:
        """
        Return the `Intervention` of the collision monitor on the requested command.

        Empty if none was recorded, ``unknown`` if the collision monitor does not make the one of
        the other with the limits taken and the recorded pose (a localisation or anchoring may have
        mended it).
        """
        if self.requested is None or self.applied is None:
            return ''
        if self.monitored is None:
            return 'none'
        return self.monitored.rule if self.monitored.reproduces else 'unknown'

    @cached_property
    def monitored(self) -> MonitoredVelocity | None:
        """Return what the collision monitor makes of the request; None if it was applied as is."""
        if self.requested is None or self.applied is None:
            return None
        if math.dist(self.requested, self.applied) < 1e-9:
            return None
        velocity, rule = limit_command(
            self.requested, *self._before(), self.pose, self._local_grid(), self.limits)
        return MonitoredVelocity(velocity, str(rule), math.dist(velocity, self.applied) < _SAME)

    @cached_property
    def at_limits(self) -> list[str]:
        """Return the limits of the body that the command reaches: it may have asked for more."""
        if self.applied is None:
            return []
        (v, w), ((before_v, before_w), dt), limits = self.applied, self._before(), self.limits
        reached = {'speed': abs(v) - limits.v_max, 'turning rate': abs(w) - limits.w_max}
        if self._i:
            reached |= {
                'acceleration': abs(v - before_v) - limits.a_max * dt,
                'turning acceleration': abs(w - before_w) - limits.alpha_max * dt}
        return [name for name, over in reached.items() if over > -1e-6]

    def _before(self) -> tuple[Velocity, float]:
        """Return the command before this one, and the time since, [s]."""
        if not self._i:
            return STANDSTILL, _USUAL_STEP
        stamps = self.episode.poses.stamps
        dt = float(stamps[self._i] - stamps[self._i - 1])
        return self._command('cmd_vel', self._i - 1) or STANDSTILL, max(dt, 0.0)

    def _local_grid(self) -> LocalGrid | None:
        grid = self.header.grid
        table = local_grid_table(
            self.episode.messages('neighbourhood'), grid, self.header.fitted)
        seen = np.flatnonzero(table.stamps <= self.stamp + 1e-6)
        if not len(seen):
            return None
        i = int(seen[-1])
        cells = np.zeros((3, 3), dtype=np.int64)
        for masks, state in ((table.blocked, 100), (table.unknown, -1)):
            for heading in range(8):
                if masks[i] >> heading & 1:
                    cells[1 + STEP_ROW[heading], 1 + STEP_COL[heading]] = state
        row, col = table.cells[i].tolist()
        return local_grid_from_cells(
            cells.tolist(), row, col, grid, self.header.parameters.unknown_is_blocked)

    def _command(self, role: str, i: int) -> Velocity | None:
        """Return the newest command in answer to the i-th odometry."""
        messages, poses = self.episode.messages(role), self.episode.poses
        if not len(messages):
            return None
        stamped = messages.type_name.endswith('Stamped')
        names = ('vx', 'wz', 'sec', 'nanosec') if stamped else ('vx', 'wz')
        values = read_columns(messages, dict.fromkeys(names, 1)).values
        found, answers = np.zeros(0, dtype=np.int64), False
        if stamped:
            stamps = values['sec'] + values['nanosec'] * 1e-9
            found = np.flatnonzero(stamps == poses.stamps[i])
            # Where commands bear the stamps of what they answer, any other answers something else.
            answers = bool(np.isin(stamps, poses.stamps).any())
        if not len(found) and not answers:
            end = (int(poses.log_times[i + 1]) - 1 if i + 1 < len(poses.log_times)
                   else int(poses.log_times[i]) + 10**9)
            times = messages.log_times
            since = int(poses.log_times[i]) - round(_RECENT * 1e9)
            found = np.flatnonzero((times <= end) & (times >= since))
        if not len(found):
            return None
        return float(values['vx'][found[-1]]), float(values['wz'][found[-1]])

    @cached_property
    def heading(self) -> ExplainedHeading | None:
        """
        Return the heading of the cell; None where there is none, see `no_heading`.

        Raises
        ------
        BagError
            If what was recorded cannot be read.

        """
        parameters = self.header.parameters
        end = max(self.log_time, int(self.episode.poses.log_times[0]))
        field, prototypes = self.episode.field(end), self.episode.prototypes(end)
        cell = None if field is None else self._cell_of(field)
        if field is None or cell is None:
            return None
        is_flat = bool(np.isin(field.coherence, (0.0, 1.0)).all())
        if prototypes is not None and not is_flat:
            voices = voices_at(field, prototypes, parameters, *cell)
            if voices is not None:
                return ExplainedHeading(field, prototypes, voices, 'recorded', cell)
        return self._relearnt(field, prototypes, cell)

    def _cell_of(self, field: ControlField) -> tuple[int, int] | None:
        """Return the cell as the workspace of a field has it; None if it lies outside that."""
        offset = self.header.grid.offset_to(field.grid)
        if offset is None:
            return None
        row, col = self.cell[0] + offset[0], self.cell[1] + offset[1]
        return (row, col) if field.grid.contains(row, col) else None

    @property
    def why_no_heading(self) -> NoHeading:
        """Return why there is no heading: there was no field, or just none in the bag."""
        if self.header.imported_from:
            return NoHeading.TAKEN_OVER
        folder = self.episode.folder
        end = max(self.log_time, int(self.episode.poses.log_times[0]))
        if self.episode.field(end) is not None:
            return NoHeading.OUTSIDE
        if len(self.episode.messages('control_field')) or all(
                other.number >= folder.number for other in folder.task.episodes()):
            return NoHeading.NOT_YET
        return NoHeading.NOT_RECORDED

    @property
    def no_heading(self) -> str:
        """Say it in a sentence."""
        return _NO_HEADING[self.why_no_heading].format(self.header.imported_from)

    def _relearnt(
        self, field: ControlField, prototypes: Prototypes | None, cell: tuple[int, int],
    ) -> ExplainedHeading | None:
        """Learn from the bags before this one, which says on which map the headings were made."""
        folder, parameters = self.episode.folder, self.header.parameters
        relearner, known = Relearner.for_header(self.header), None
        for before in folder.task.episodes():
            if before.number < folder.number:
                refresh = relearner.learn(Episode(before)).refresh
                if refresh is not None and refresh.pushed:
                    known = moved(refresh.composition.planned, refresh.field.grid, field.grid,
                                  UNKNOWN)
        relearner = relearner.in_workspace(field.grid)
        if relearner.refresh is None or relearner.grid != field.grid:
            return None if prototypes is None else ExplainedHeading(field, prototypes, voices_at(
                field, prototypes, parameters, *cell), 'recorded', cell)
        made_of = relearner.refresh.prototypes
        weights = relearner.refresh.composition.weights
        exploration = relearner.field(exploring=True)
        if exploration is not relearner.refresh.field and np.array_equal(
                exploration.vx, field.vx) and np.array_equal(exploration.vy, field.vy):
            return ExplainedHeading(field, made_of, None, 'curious', cell)
        shown = relearner.shown
        if shown is not None and np.array_equal(shown.field.vx, field.vx):
            made_of, weights, known = shown.prototypes, shown.weights, shown.planned
        return ExplainedHeading(field, made_of, voices_at(
            field, made_of, parameters, *cell, known, weights), 'relearnt', cell)


def _stamp_of(episode: Episode, at: float) -> float:
    """Return the stamp of a moment that a person names."""
    start, duration = episode.start, episode.duration
    if 0.0 <= at <= duration + 1e-6:
        return start + at
    if start <= at <= start + duration + 1e-6:
        return at
    raise NoSuchMomentError(
        f'--at {at:g}: {episode.folder.name} lasts from 0 to {duration:.2f} s '
        f'(stamps {start:.3f} to {start + duration:.3f} s)')


def check_recorded(episode: Episode, at: float) -> None:
    """
    Refuse a moment at which nothing was recorded.

    Raises
    ------
    NoSuchMomentError
        If it lies where messages are missing.

    """
    # What lies past the end of the drive may be a stamp.
    second = at if at <= episode.duration + 1e-6 else at - episode.start
    hole = episode.gaps.hole_at(second)
    if hole is not None:
        raise NoSuchMomentError(f'{episode.folder.name} at {second:.2f} s: there is nothing to '
                                f'explain, the recording is incomplete: {hole}')
