"""The link to the robot: how late poses and commands come; in lock-step never. ROS-free."""

from dataclasses import replace
import math
from typing import Final

from control_field.robot.latency import Lag, LatencyMonitor, REPEAT
from control_field.robot.limits import Velocity
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import Pose

#: What counts as standing, [m/s], and how long a robot may take to brake, [s].
_STANDS: Final = 0.02
_BRAKES: Final = 0.1


class RobotLink:
    """
    Knows where the robot may be by now, and whether it does what it is told.

    Parameters
    ----------
    settings : Settings

    Attributes
    ----------
    is_lockstep : bool
        A pose is then of now, and its answer holds for exactly one tick.
    latency : LatencyMonitor

    """

    def __init__(self, settings: Settings) -> None:
        """Start with a link that nothing is known of."""
        self.latency = LatencyMonitor(settings.slow_latency, settings.cmd_vel_timeout)
        self._clock_offset = 0.0
        self._sent_at = self._updated_at = -math.inf
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self.is_lockstep = settings.lockstep
        self.latency.slow_from = settings.slow_latency
        self.latency.base_timeout = settings.cmd_vel_timeout

    def on_pose(self, pose: Pose, velocity: Velocity, now: float, clock: float | None,
                odometry: Pose | None = None, is_ours: bool = False) -> None:
        """
        Take in where the robot was at the stamp of a pose.

        Parameters
        ----------
        pose : Pose
        velocity : tuple of float, [m/s] and [rad/s]
            The command that holds.
        now, clock : float, [s]
            Steady time, and the time that stamps are made of.
        odometry : Pose, optional
            The pose before it was corrected.
        is_ours : bool
            Whether this process drives the robot.

        """
        if self.is_lockstep:
            return
        self._clock_offset = 0.0 if clock is None else clock - now
        at = self._stamp_time(now)
        if self.latency.sent.newest != velocity:  # the robot was stopped since
            self.latency.on_command(min(self._updated_at, at), velocity)
        self._updated_at = at
        self.latency.on_pose(at, pose.stamp, place_of(pose), place_of(odometry or pose), is_ours)

    def on_guard(self, velocity: Velocity, now: float, clock: float | None) -> None:
        """Take in which command holds while no pose comes."""
        self._clock_offset = 0.0 if clock is None else clock - now
        self._updated_at = self._stamp_time(now)
        self.latency.on_command(self._updated_at, velocity)

    def on_command(self, velocity: Velocity, now: float) -> None:
        """Take in a command that is sent now."""
        self._sent_at = self._stamp_time(now)
        self.latency.on_command(self._sent_at, velocity)

    @property
    def must_stand(self) -> bool:
        """Return whether the robot does not follow its commands and has to stand."""
        return not self.is_lockstep and self.latency.following.is_lost

    @property
    def is_lost(self) -> bool:
        """Return whether it does not follow its commands, and is not merely stuck."""
        return self.must_stand and not self.is_stuck

    @property
    def is_stuck(self) -> bool:
        """Return whether the robot does not move though its commands must have arrived."""
        return not self.is_lockstep and (
            self.latency.following.is_unanswered and not self.latency.is_lossy)

    def has_stopped(self, pose: Pose, now: float) -> bool:
        """Return whether the robot cannot be driving any more, be it turning."""
        if self.is_lockstep:
            return True
        at, latency = self._stamp_time(now), self.latency
        return abs(pose.v) <= _STANDS and not any(
            v for v, _, _ in latency.sent.pieces(at - latency.longest - _BRAKES, at))

    @property
    def speed_share(self) -> float:
        """Return the share of the speed that may be driven at this latency, 0 to 1."""
        return 1.0 if self.is_lockstep else self.latency.slowing

    @property
    def patience(self) -> float:
        """Return how many times longer than on a good link the same way may take."""
        return 1.0 if self.is_lockstep else self.latency.patience

    def predicted(self, pose: Pose, now: float) -> Pose:
        """Return where the robot is by now, with the stamp of the pose."""
        if self.is_lockstep:
            return pose
        x, y, yaw = self.latency.predicted(place_of(pose), self._stamp_time(now))
        return replace(pose, x=x, y=y, yaw=math.remainder(yaw, math.tau))

    def lag(self, now: float) -> Lag:
        """Return where the robot may be by now."""
        return self.latency.lag(self._stamp_time(now))

    def needs_repeat(self, now: float) -> bool:
        """Return whether the last command may be lost and still matters."""
        at = self._stamp_time(now)
        return (self.latency.is_lossy and at - self._sent_at > REPEAT - 1e-6
                and at - self.latency.sent.changed_at < 2.0 * self.latency.base_timeout)

    def _stamp_time(self, now: float) -> float:
        """Return the time on the clock that stamps are made of."""
        return now + self._clock_offset


def place_of(pose: Pose) -> tuple[float, float, float]:
    """Return x, y and yaw."""
    return pose.x, pose.y, pose.yaw
