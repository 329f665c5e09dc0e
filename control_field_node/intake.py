"""What has arrived: how fresh it is, and what was not to be trusted. ROS-free."""

from collections import Counter
from collections.abc import Callable
import math

from control_field.robot.latency import OTHER_CLOCK
from control_field.robot.stop_rules import PoseMonitor, StopReason, Timeout
from control_field_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from msgs_bridge.node.throttled_log import OncePerTemplate


class Intake:
    """
    Looks at what arrives before anybody acts on it.

    Parameters
    ----------
    settings : Settings
        Of the rules.
    log : callable
        Gets ``'warning'`` and one line.

    Attributes
    ----------
    counts : Counter
        What was refused or passed over, by what it is.
    too_late : float, [s]
        Age of the odometry that came since the last that was fresh enough, 0 if none did.
    odometry, local grid : Freshness
    poses : PoseWatch
    why_late : str
        Why the last late pose does not count.

    """

    def __init__(self, settings: Settings, log: Callable[[str, str], None]) -> None:
        """Start with nothing received."""
        self.counts: Counter[str] = Counter()
        self.odometry, self.local_grid = Timeout(0.0), Timeout(0.0)
        self.places = Timeout(math.inf)  # of a localisation
        self.poses = PoseMonitor(settings.rules)
        self.why_late = ''
        self.too_late, self._old_stamp = 0.0, -math.inf
        self._log = log
        self._bad_until = -math.inf
        self._logged = OncePerTemplate()
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings; in lock-step nothing is ever stale."""
        self._settings = settings
        self.poses.rules = settings.rules
        waits = settings.lockstep
        self.odometry.timeout = math.inf if waits else settings.odom_timeout
        self.local_grid.timeout = math.inf if waits else settings.neighbourhood_timeout

    def refuse(self, what: str, is_said: bool = False) -> None:
        """Count something that is not to be trusted; say so once a kind, if nobody else does."""
        self.counts['refused messages'] += 1
        if self.is_first(what) and not is_said:
            self._log('warning', f'refused: {what} (not said again)')

    def is_first(self, what: str) -> bool:
        """Remember a line; return True if it is the first of its template."""
        return self._logged.add(what)

    def distrust(self, now: float) -> None:
        """Take in that odometry was bad: it has to be good for its timeout."""
        self._bad_until = now + (
            0.0 if self._settings.lockstep else self._settings.odom_timeout)

    def is_bad(self, now: float) -> bool:
        """Tell whether what was bad or missing has not been good for long enough."""
        return now < self._bad_until

    def came(self, what: Timeout, now: float, is_missed: bool) -> None:
        """Note that odometry or a local grid came; what was missed has to stay for a while."""
        if is_missed and what.is_stale(now):
            self._bad_until = now + what.timeout
        what.saw(now)
        if what is self.odometry:
            self.too_late = 0.0

    def is_late_pose(self, pose: Pose, clock: float) -> bool:
        """
        Tell whether a pose is a duplicate or came late, and is to be passed over.

        ``clock`` is what stamps are made of, [s]. A stamp far from it is of another clock,
        such as a simulator's, and its age unknown. One behind the last ones is late, too, until
        so many are that the clock was set back.
        """
        age, timeout = clock - pose.stamp, self._settings.odom_timeout
        n_behind = self.poses.n_behind(pose.stamp)
        # Stamps that stand grow old, too; that is no fault of link or clocks.
        stands = self.poses.is_repeated(pose.stamp) or pose.stamp == self._old_stamp
        old = not stands and timeout < age < OTHER_CLOCK and not self.poses.went_back(n_behind)
        if old:
            self.too_late, self._old_stamp = age, pose.stamp
        if old and not n_behind:
            self.refuse(f'odom: age is {age:.2f} s when it arrives, must be below odom_timeout '
                        f'({timeout:g} s); is the link that slow, or are the clocks not set?')
        late = stands or (old and n_behind > 0)
        self.counts['late odometry'] += late
        self.why_late = f'its stamps do not advance (last {pose.stamp:.2f} s)' if late else (
            f'it is {age:.2f} s old by its stamps, must be below odom_timeout ({timeout:g} s): '
            f'is the link that slow, or are the clocks not set?')
        return old or late

    def why_stale(self, now: float) -> StopReason:
        """Return why there is no fresh odometry: none comes, or only such as is too old."""
        late = self.too_late and self.odometry.comes_in_vain(now)
        return StopReason.LATE_POSES if late else StopReason.STALE_ODOMETRY

    def is_late_local_grid(self, local_grid: Neighbourhood, last: Neighbourhood | None) -> bool:
        """Tell whether a neighbourhood is older than the last, and is to be passed over."""
        late = last is not None and not self._settings.lockstep and (
            0.0 < last.stamp - local_grid.stamp <= self._settings.neighbourhood_timeout)
        self.counts['late neighbourhoods'] += late
        return late
