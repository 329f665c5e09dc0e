"""What arrives: whether it is recent, in order and to be trusted. ROS-free."""

from collections import Counter
from collections.abc import Callable
import math

from control_field.robot.latency import OTHER_CLOCK
from control_field.robot.stop_rules import PoseMonitor, StopReason, Timeout
from control_field.robot.suspension import Suspension
from control_field_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from msgs_bridge.node.throttled_log import OncePerTemplate


class RefusalLog:
    """
    Counts what is refused or ignored, and logs each kind of it once.

    Parameters
    ----------
    log : callable
        Gets the level, ``'info'``, ``'warning'`` or ``'error'``, and one line.

    Attributes
    ----------
    counts : Counter
        By what it is.
    logged : OncePerTemplate
        Lines that must not be logged again.

    """

    def __init__(self, log: Callable[[str, str], None]) -> None:
        """Start with nothing refused."""
        self.counts: Counter[str] = Counter()
        self.logged = OncePerTemplate()
        self.log = log

    def refuse(self, what: str, is_logged: bool = False) -> None:
        """Count a message that is not to be trusted; log it once a kind, unless it is already."""
        self.counts['refused messages'] += 1
        if self.logged.add(what) and not is_logged:
            self.log('warning', f'refused: {what} (not said again)')


class PoseFilter:
    """
    Passes over odometry that is late or repeated.

    Parameters
    ----------
    settings : Settings
    refusals : RefusalLog

    Attributes
    ----------
    order : PoseMonitor
        Whether stamps and poses follow each other.
    is_late : bool
        Whether the newest odometry is too old to drive by, and none has counted since.

    """

    def __init__(self, settings: Settings, refusals: RefusalLog) -> None:
        """Start with no pose."""
        self.order = PoseMonitor(settings.rules)
        self.is_late = False
        self._late_stamp = -math.inf
        self._refusals = refusals
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self._timeout = settings.odom_timeout
        self.order.rules = settings.rules

    def check(self, pose: Pose, clock: float) -> str:
        """
        Take in a pose, once; return why it is to be passed over, empty if it counts.

        A stamp that is far from ``clock`` is of another clock, such as a simulator's, and tells no
        age. One behind the last ones is late, too, until so many are that the clock was set back.

        Parameters
        ----------
        pose : Pose
        clock : float, [s]
            The time that stamps are made of.

        """
        age, timeout = clock - pose.stamp, self._timeout
        self.order.note_stamp(pose.stamp)
        # Stamps that do not advance grow old, too; that is no fault of link or clocks.
        is_repeated = self.order.is_repeated(pose.stamp) or pose.stamp == self._late_stamp
        is_old = not is_repeated and timeout < age < OTHER_CLOCK and not self.order.was_set_back
        if is_old:
            self.is_late, self._late_stamp = True, pose.stamp
        if is_old and not self.order.is_behind:
            self._refusals.refuse(
                f'odom: age is {age:.2f} s when it arrives, must be below odom_timeout '
                f'({timeout:g} s); is the link that slow, or are the clocks not set?')
        is_out_of_order = is_repeated or (is_old and self.order.is_behind)
        self._refusals.counts['late odometry'] += is_out_of_order
        if is_out_of_order:
            return f'its stamps do not advance (last {pose.stamp:.2f} s)'
        return (f'it is {age:.2f} s old by its stamps, must be below odom_timeout ({timeout:g} '
                f's): is the link that slow, or are the clocks not set?') if is_old else ''


class InputMonitor:
    """
    Knows how recent each input is, and since when all are good again.

    Parameters
    ----------
    settings : Settings
    refusals : RefusalLog

    Attributes
    ----------
    odometry, local_grid, localisation : Timeout
    poses : PoseFilter
    suspension : Suspension
        Of this process: it has to look at the clock often.

    """

    def __init__(self, settings: Settings, refusals: RefusalLog) -> None:
        """Start with nothing received."""
        self.refusals = refusals
        self.suspension = Suspension()
        self.odometry, self.local_grid, self.localisation = (
            Timeout(math.inf, self.suspension) for _ in range(3))
        self.poses = PoseFilter(settings, refusals)
        self._bad_until = -math.inf
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings; in lock-step nothing is ever stale."""
        self._settings = settings
        self.poses.change_settings(settings)
        is_waited_for = settings.lockstep
        self.odometry.timeout = math.inf if is_waited_for else settings.odom_timeout
        self.local_grid.timeout = math.inf if is_waited_for else settings.neighbourhood_timeout

    def distrust(self, now: float) -> None:
        """Take in bad odometry: it has to be good for its timeout."""
        self._bad_until = now + (
            0.0 if self._settings.lockstep else self._settings.odom_timeout)

    def is_bad(self, now: float) -> bool:
        """Return whether what was bad or missing has not been good for long enough."""
        return now < self._bad_until

    def on_odometry(self, now: float, is_paused: bool) -> None:
        """Take in odometry that counts."""
        self.poses.is_late = False
        self._on_arrival(self.odometry, now, is_paused)

    def on_local_grid(self, now: float, is_paused: bool) -> None:
        """Take in a neighbourhood that counts."""
        self._on_arrival(self.local_grid, now, is_paused)

    def _on_arrival(self, timeout: Timeout, now: float, is_paused: bool) -> None:
        """Restart a timeout; what was missing in a pause has to keep coming for a while."""
        if is_paused and timeout.is_stale(now):
            self._bad_until = now + timeout.timeout
        timeout.on_arrival(now)

    def why_stale(self, now: float) -> StopReason:
        """Return why there is no recent odometry: none comes, or only such as is too old."""
        late = self.poses.is_late and self.odometry.is_ignored(now)
        return StopReason.LATE_POSES if late else StopReason.STALE_ODOMETRY

    def is_out_of_order(self, local_grid: Neighbourhood, last: Neighbourhood | None) -> bool:
        """Return whether a neighbourhood is a little older than the last one."""
        return last is not None and not self._settings.lockstep and (
            0.0 < last.stamp - local_grid.stamp <= self._settings.neighbourhood_timeout)
