"""
When to stop, and whether the robot may go on by itself.

Every rule that depends on time is here, with time passed in: ``now`` is a steady clock in seconds
(in lock-step the stamp of the message), stamps are those of the messages. Nothing learnt changes
a rule. The table for people is ``doc/safety.md``.
"""

from dataclasses import dataclass
import math
from typing import Final

from control_field.grid import Grid
from control_field.poses import possible_turn, TURN_MAX
from control_field.robot.stop_reasons import \
    StopReason as StopReason  # noqa: PLC0414 - others find it here
from control_field.robot.suspension import Suspension


@dataclass(frozen=True, slots=True)
class StopRules:
    """
    The numbers of the rules.

    Parameters
    ----------
    odom_timeout, neighbourhood_timeout : float
        Age at which a message is stale, [s].
    v_max : float
        What the robot can drive, [m/s].
    pose_jump : float
        How far a pose may be off beyond what the robot can drive, [m].
    progress_distance, progress_time : float
        How far the robot must come, [m], in which time, [s].
    stall_time : float
        How long it may be told to drive without moving, [s].
    time_limit : float
        Longest trial, [s].
    w_max : float
        How fast the robot can turn, [rad/s]; less than most robots do is taken for that.

    """

    odom_timeout: float = 0.5
    neighbourhood_timeout: float = 0.5
    v_max: float = 0.22
    pose_jump: float = 0.1
    progress_distance: float = 0.5
    progress_time: float = 10.0
    stall_time: float = 2.0
    time_limit: float = 3600.0
    w_max: float = TURN_MAX


#: Speed from which a command counts as told to drive, [m/s], and what counts as moving, [m].
_TOLD: Final = 0.02
_MOVED: Final = 0.01
#: What counts as turning, [rad]; less is the heading being corrected against what is in the way.
_TURNED: Final = 0.2
#: Messages in a row with stamps behind the last good one that are a clock set back, not late.
_SET_BACK: Final = 5
#: What came longer ago arrives no more, [s].
_LATELY: Final = 2.0


class Timeout:
    """
    How old the newest message of one kind is.

    Parameters
    ----------
    timeout : float
        Age from which it is stale, [s].
    suspension : Suspension, optional
        Of this process, which reads nothing then.

    """

    def __init__(self, timeout: float, suspension: Suspension | None = None) -> None:
        """Start with nothing received."""
        self.timeout = timeout
        self._suspension = suspension or Suspension()
        self.arrived = -math.inf
        self._passed_over, self._why = -math.inf, ''

    def on_arrival(self, now: float) -> None:
        """Note an arrival."""
        self.arrived = now

    def pass_over(self, now: float, why: str) -> None:
        """Note an arrival that does not count, and why."""
        self._passed_over, self._why = now, why

    @property
    def has_come(self) -> bool:
        """Return whether anything that counts has ever arrived."""
        return self.arrived > -math.inf

    def is_ignored(self, now: float) -> bool:
        """Return whether the newest that arrived, not long ago, does not count."""
        return self._passed_over >= self.arrived and now - self._passed_over <= _LATELY

    def absence(self, now: float, what: str) -> str:
        """
        Say how something is missing: whether it arrives and does not count, or does not arrive.

        Parameters
        ----------
        now : float, [s]
        what : str
            What it is called.

        """
        if self.is_ignored(now):
            return f'{what} arrives but does not count: {self._why}'
        last = max(self.arrived, self._passed_over)
        if last == -math.inf:
            return f'no {what} has arrived yet'
        if slept := self._suspension.duration_since(last):
            return (f'no {what} has been read for {now - last:.1f} s, of which this program '
                    f'itself stood still for {slept:.1f} s')
        return f'no {what} has arrived for {now - last:.1f} s'

    def is_stale(self, now: float) -> bool:
        """Return whether nothing has arrived for the timeout, or ever."""
        return now - self.arrived > self.timeout


class PoseMonitor:
    """
    Whether odometry can be trusted: stamps that go forward, poses that the robot can reach.

    Parameters
    ----------
    rules : StopRules
        The numbers.

    """

    def __init__(self, rules: StopRules) -> None:
        """Start with no pose."""
        self.rules = rules
        self._last: tuple[float, float, float, float] | None = None
        self._is_placed = False
        self._behind = 0, math.inf

    def place_anew(self) -> None:
        """Measure the next pose against no earlier one: until a trial begins a robot is placed."""
        self._is_placed = True

    def note_stamp(self, stamp: float) -> None:
        """Take in the stamp of every message, also of one that is not observed."""
        n, last = self._behind
        is_behind = self._last is not None and stamp < self._last[0] - self.rules.odom_timeout
        self._behind = (n + 1 if stamp > last else 1) if is_behind else 0, stamp

    @property
    def is_behind(self) -> bool:
        """Return whether the last stamp was behind by more than the timeout."""
        return self._behind[0] > 0

    @property
    def was_set_back(self) -> bool:
        """Return whether so many stamps in a row are behind that a clock was set back."""
        return self._behind[0] >= _SET_BACK

    def is_repeated(self, stamp: float) -> bool:
        """Return whether a message is a duplicate, or late by less than the timeout."""
        return self._last is not None and (
            0.0 <= self._last[0] - stamp <= self.rules.odom_timeout)

    def observe(
        self, stamp: float, x: float, y: float, grid: Grid,
        place: tuple[float, float] | None = None, yaw: float = 0.0,
    ) -> StopReason | None:
        """
        Take in a pose.

        Parameters
        ----------
        stamp : float, [s]
            Of the odometry.
        x, y : float, [m]
            Of the odometry, finite.
        grid : Grid
            The workspace.
        place : tuple of float, optional, [m]
            Where the robot is, if odometry is not taken at its word.
        yaw : float, [rad]
            Of the odometry.

        Returns
        -------
        StopReason or None
            What is wrong with it.

        """
        last, self._last = self._last, (stamp, x, y, yaw)
        was_placed, self._is_placed = self._is_placed, False
        if last is not None and stamp < last[0]:
            return StopReason.CLOCK_JUMPED_BACK
        if last is not None and not was_placed and (
                math.hypot(x - last[1], y - last[2]) > (
                    self.rules.pose_jump + self.rules.v_max * (stamp - last[0]))
                or abs(math.remainder(yaw - last[3], math.tau)) > possible_turn(
                    stamp - last[0], self.rules.w_max)):
            return StopReason.POSE_JUMPED
        if not grid.contains(*grid.cell_from_world(*(place or (x, y)))):
            return StopReason.OUTSIDE_WORKSPACE
        return None


class ProgressChecker:
    """
    Whether the robot comes forward: `progress_distance` or a cell within `progress_time`.

    Like Nav2's SimpleProgressChecker it measures from where it last came forward; entering
    the next cell counts too, so that exploring a small place is no reason to stop. Stamps that
    leap ahead, because somebody sets a clock, say nothing of how long the robot has stood.

    Parameters
    ----------
    rules : StopRules
        The numbers.

    """

    def __init__(self, rules: StopRules) -> None:
        """Start with no baseline."""
        self.rules = rules
        self._started: float | None = None
        self.restart()

    def restart(self) -> None:
        """Begin anew: after a pause the robot has not had the time."""
        self._base: tuple[float, float, float, int] | None = None
        self._still: tuple[float, float, float, float] | None = None
        self._last: float | None = None

    def observe(
        self, stamp: float, x: float, y: float, yaw: float, n_cells: int, told: float,
        patience: float = 1.0, has_waited: bool = False,
    ) -> StopReason | None:
        """
        Take in where the robot is.

        Parameters
        ----------
        stamp : float, [s]
        x, y, yaw : float, [m] and [rad]
        n_cells : int
            Cells entered so far.
        told : float
            Speed it was told to drive since the last pose, [m/s].
        patience : float
            How many times `progress_time` it has: a robot that is heard late drives slower.
        has_waited : bool
            Whether it has waited since the last pose for what is in its way: no rule counts that.

        """
        if self._started is None:
            self._started = stamp
        leap = 0.0 if self._last is None else stamp - self._last
        if leap > max(self.rules.stall_time, self.rules.odom_timeout):
            self.restart()
            self._started += leap
        elif has_waited:
            self._pass_over(leap)
        self._last = stamp
        if stamp - self._started > self.rules.time_limit:
            return StopReason.TIME_LIMIT
        if self._is_stalled(stamp, x, y, yaw, told):
            return StopReason.STALLED
        if self._base is None or n_cells != self._base[3] or math.hypot(
                x - self._base[1], y - self._base[2]) >= self.rules.progress_distance:
            self._base = (stamp, x, y, n_cells)
        if stamp - self._base[0] > self.rules.progress_time * patience:
            return StopReason.NO_PROGRESS
        return None

    def _pass_over(self, seconds: float) -> None:
        """Leave out a time, [s]."""
        self._still = None
        self._started = seconds + (self._started or 0.0)
        if self._base is not None:
            self._base = (self._base[0] + seconds, *self._base[1:])

    def _is_stalled(self, stamp: float, x: float, y: float, yaw: float, told: float) -> bool:
        still = self._still
        if still is None or abs(told) < _TOLD or abs(
                math.remainder(yaw - still[3], math.tau)) > _TURNED or math.hypot(
                x - still[1], y - still[2]) > _MOVED:
            self._still = (stamp, x, y, yaw)
            return False
        return stamp - still[0] > self.rules.stall_time


def is_lost(coherence: float, is_supported: bool, q_greatest: float, least: float) -> bool:
    """
    Return whether there is no point in following the field here.

    Parameters
    ----------
    coherence : float
        Of the field at the robot's cell, 0 to 1.
    is_supported : bool
        Whether a prototype's effective window reaches the cell.
    q_greatest : float
        Greatest absolute Q-value there.
    least : float
        Coherence below which the heading says nothing.

    """
    return not is_supported and q_greatest == 0.0 and coherence < least
