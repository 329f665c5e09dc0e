"""What goes to the wheels: the collision monitor, and where the robot is by now. ROS-free."""

from collections import Counter
from dataclasses import replace
import math
from typing import Final

from control_field.robot.collision_monitor import Intervention, limit_command
from control_field.robot.late_collision_monitor import limit_late_command
from control_field.robot.latency import Lateness, REPEAT
from control_field.robot.limits import STANDSTILL, Velocity, within_acceleration, within_speed
from control_field_node.punctuality import Punctuality
from control_field_node.seen import Seen
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import Pose

#: How often whoever owns a supervisor calls its `guard`, [s].
GUARD_PERIOD: Final = 0.02


class Wheels:
    """
    Passes commands on as far as the collision monitor lets them, and remembers them.

    In lock-step a pose is of now and its answer holds for exactly one tick; else there is a link
    between, and `Lateness` knows how late things are.

    Parameters
    ----------
    settings : Settings
    counts : Counter
        What the collision monitor did is counted there.

    Attributes
    ----------
    velocity : tuple of float, [m/s] and [rad/s]
        The command that holds.
    held : str
        Why a robot that is to drive stands; empty if it does not.
    lateness : Lateness
    punctuality : Punctuality
    is_to_stand : bool
        Whether the robot comes to a standstill whatever is asked for, within its acceleration.

    """

    def __init__(self, settings: Settings, counts: 'Counter[str]') -> None:
        """Stand."""
        self.velocity: Velocity = STANDSTILL
        self.held, self.is_to_stand = '', False
        self.punctuality = Punctuality()
        self.lateness = Lateness(settings.slow_latency, settings.cmd_vel_timeout)
        self._counts = counts
        self._wanted = self._ahead = 0.0
        self._sent_at = self._last = -math.inf
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self._lockstep, self._limits = settings.lockstep, settings.limits
        self.lateness.slow_from = settings.slow_latency
        self.lateness.base_timeout = settings.cmd_vel_timeout

    def ramped(self, wanted: Velocity, dt: float) -> Velocity:
        """Return what can be reached of a velocity, [m/s] and [rad/s], in a time, [s]."""
        wanted = STANDSTILL if self.is_to_stand else within_speed(wanted, self._limits)
        return within_acceleration(wanted, self.velocity, dt, self._limits)

    def stand(self) -> bool:
        """Take in that nobody asks for more than standstill; tell whether somebody did."""
        drove, self.velocity, self.held = self.velocity != STANDSTILL, STANDSTILL, ''
        return drove

    def heard(self, pose: Pose, now: float, clock: float | None, odometry: Pose | None = None,
              is_ours: bool = False) -> None:
        """
        Take in where the robot was at the stamp of a pose; see `Supervisor.saw_pose`.

        ``odometry`` is the pose before it was mended, ``is_ours`` tells whether this process
        drives the robot.
        """
        if not self._lockstep:
            self._ahead = 0.0 if clock is None else clock - now
            at = self._time(now)
            if self.lateness.sent.newest != self.velocity:  # the robot was stopped since
                self.lateness.sends(min(self._last, at), self.velocity)
            self._last = at
            self.lateness.heard(at, pose.stamp, _place(pose), _place(odometry or pose), is_ours)

    @property
    def is_lost(self) -> bool:
        """Tell whether the robot does not do what is sent: it is to stand until it has stood."""
        return not self._lockstep and self.lateness.following.is_lost and not self._is_stuck

    def predicted(self, pose: Pose, now: float) -> Pose:
        """Return where the robot is by now, with the stamp of the pose."""
        if self._lockstep:
            return pose
        x, y, yaw = self.lateness.predicted(_place(pose), self._time(now))
        return replace(pose, x=x, y=y, yaw=math.remainder(yaw, math.tau))

    def slowed(self, velocity: Velocity) -> Velocity:
        """Return a velocity as far as the latency allows it, and nothing else keeps it back."""
        if self.is_to_stand:
            return STANDSTILL
        share = 1.0 if self._lockstep else self.lateness.slowing
        return share * velocity[0], share * velocity[1]

    @property
    def patience(self) -> float:
        """Return how many times longer than usual the robot may take for its way."""
        return 1.0 if self._lockstep else self.lateness.patience

    @property
    def told(self) -> float:
        """
        Return the speed that the robot should have, [m/s].

        One that stands is told what it would be, were it seen to move at all: it may be stuck.
        Where commands were seen to come late it may as well not have heard.
        """
        return self._wanted if self._is_stuck else self.velocity[0]

    @property
    def _is_stuck(self) -> bool:
        following = self.lateness.following
        return not self._lockstep and following.is_unanswered and not self.lateness.is_lossy

    def pass_on(
        self, wanted: Velocity, pose: Pose, seen: Seen | None, dt: float, now: float,
    ) -> Intervention:
        """
        Make a command what holds from now on, as far as the collision monitor lets it.

        Parameters
        ----------
        wanted : tuple of float, [m/s] and [rad/s]
        pose : Pose
            The last one.
        seen : Seen or None
        dt : float, [s]
            Time until the next command.
        now : float, [s]

        """
        local_grid = None if seen is None else seen.local_grid
        self._wanted = wanted[0]
        if not self._lockstep and self.lateness.following.is_lost:
            wanted = STANDSTILL
        if self._lockstep:
            self.velocity, reason = limit_command(
                wanted, self.velocity, dt, _place(pose), local_grid, self._limits)
        else:
            at = self._time(now)
            self.velocity, reason = limit_late_command(
                wanted, self.velocity, dt, _place(pose), local_grid, self._limits,
                self.lateness.lag(at))
            self._sent(at)
        if reason is not Intervention.NONE:
            self._counts[f'gate {reason}'] += 1
        self.held = reason.sentence if wanted[0] and not self.velocity[0] else ''
        return reason

    def look(
        self, pose: Pose, seen: Seen | None, now: float, clock: float | None, drives: bool,
    ) -> bool:
        """
        Look whether the last command may hold; tell whether one is to be sent.

        Parameters
        ----------
        pose : Pose
            The last one.
        seen : Seen or None
        now, clock : float, [s]
        drives : bool
            Whether it is for this process to drive the robot.

        """
        self._ahead = 0.0 if clock is None else clock - now
        at = self._last = self._time(now)
        before = self.velocity
        self.lateness.sends(at, before)
        if drives and self.punctuality.was_held_up and before != STANDSTILL:
            self._counts['held up'] += 1
            self.velocity = STANDSTILL
            self.held = f'nobody could look after the robot for {self.punctuality.gap:.2f} s'
        elif drives and before[0]:
            self.pass_on(before, pose, seen, GUARD_PERIOD, now)
        is_due = before != self.velocity or (
            (drives or before == STANDSTILL) and self._is_to_be_said_again(at))
        if is_due:
            self._sent(at)
        return is_due

    def _sent(self, at: float) -> None:
        self.lateness.sends(at, self.velocity)
        self._sent_at = at

    def _is_to_be_said_again(self, at: float) -> bool:
        """Tell whether the last command may have got lost and still matters."""
        link = self.lateness
        return (link.is_lossy and at - self._sent_at > REPEAT - 1e-6
                and at - link.sent.changed_at < 2.0 * link.base_timeout)

    def _time(self, now: float) -> float:
        """Return the time on the clock that stamps are made of."""
        return now + self._ahead


def _place(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw
