"""The command that holds: limited, passed through the collision monitor, taken back. ROS-free."""

from collections import Counter
from typing import Final

from control_field.robot.collision_monitor import Intervention, limit_command
from control_field.robot.late_collision_monitor import limit_late_command
from control_field.robot.limits import STANDSTILL, Velocity, within_acceleration, within_speed
from control_field_node.commands.guard_timing import GuardTiming
from control_field_node.commands.robot_link import place_of, RobotLink
from control_field_node.inputs.observation import Observation
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import Pose

#: Time between two calls of `VelocityOutput.guard`, [s].
GUARD_PERIOD: Final = 0.02


class VelocityOutput:
    """
    Passes commands on as far as the collision monitor lets them, and remembers the last.

    Parameters
    ----------
    settings : Settings
    counts : Counter
        Interventions of the collision monitor are counted there.

    Attributes
    ----------
    velocity : tuple of float, [m/s] and [rad/s]
        The command that holds.
    held : str
        Why a robot that is to drive stands; empty if it does not.
    is_kept_back : bool
        Whether the last command stands the robot for something that moves.
    is_stopped : bool
        Whether a person's commands are answered by standstill until the keys are let go.
    link : RobotLink
    timing : GuardTiming

    """

    def __init__(self, settings: Settings, counts: 'Counter[str]') -> None:
        """Stand."""
        self.velocity: Velocity = STANDSTILL
        self.held = ''
        self.is_kept_back = self.is_stopped = False
        self.link = RobotLink(settings)
        self.timing = GuardTiming()
        self._counts = counts
        self._requested_speed = 0.0
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self._limits = settings.limits
        self.link.change_settings(settings)

    def ramped(self, wanted: Velocity, dt: float) -> Velocity:
        """Return what can be reached of a velocity, [m/s] and [rad/s], in a time, [s]."""
        return within_acceleration(
            within_speed(wanted, self._limits), self.velocity, dt, self._limits)

    def slowed(self, velocity: Velocity) -> Velocity:
        """Return a velocity as far as the latency allows it, and nothing else keeps it back."""
        share = self.link.speed_share
        return share * velocity[0], share * velocity[1]

    def stand(self) -> None:
        """Make standstill the command that holds, and nothing its cause."""
        self.velocity, self.held = STANDSTILL, ''

    def stands(self, pose: Pose, now: float) -> bool:
        """Return whether the robot does not drive, as far as what it was told to has arrived."""
        return not self.velocity[0] and self.link.has_stopped(pose, now)

    @property
    def commanded_speed(self) -> float:
        """
        Return the speed that the robot should have, [m/s].

        For one that stands it is what it would get if it were seen to move at all: it may be
        stuck. On a link that loses commands it may as well not have got them.
        """
        return self._requested_speed if self.link.is_stuck else self.velocity[0]

    def pass_on(
        self, wanted: Velocity, pose: Pose, observation: Observation | None, dt: float, now: float,
    ) -> Intervention:
        """
        Make a command the one that holds, as far as the collision monitor lets it.

        Parameters
        ----------
        wanted : tuple of float, [m/s] and [rad/s]
        pose : Pose
            The newest.
        observation : Observation or None
        dt : float, [s]
            Time until the next command.
        now : float, [s]

        """
        local_grid = None if observation is None else observation.local_grid
        self._requested_speed = wanted[0]
        if self.link.must_stand:
            wanted = STANDSTILL
        situation = wanted, self.velocity, dt, place_of(pose), local_grid, self._limits
        if self.link.is_lockstep:
            self.velocity, reason = limit_command(*situation)
        else:
            self.velocity, reason = limit_late_command(*situation, self.link.lag(now))
            self.link.on_command(self.velocity, now)
        if reason is not Intervention.NONE:
            self._counts[f'gate {reason}'] += 1
        is_held = (wanted[0] and not self.velocity[0]) or (
            wanted[1] and self.velocity == STANDSTILL)
        self.held = reason.sentence if is_held else ''
        self.is_kept_back = bool(self.held) and reason.is_for_movers
        return reason

    def guard(
        self, pose: Pose, observation: Observation | None, now: float, clock: float | None,
        is_driving: bool,
    ) -> Velocity | None:
        """
        Check whether the last command may hold; return the command to send, None if none is.

        Parameters
        ----------
        pose : Pose
            The newest.
        observation : Observation or None
        now, clock : float, [s]
        is_driving : bool
            Whether it is for this process to drive the robot.

        """
        before = self.velocity
        self.link.on_guard(before, now, clock)
        if is_driving and self.timing.was_held_up and before != STANDSTILL:
            self._counts['held up'] += 1
            self.velocity = STANDSTILL
            self.held = f'nobody could look after the robot for {self.timing.gap:.2f} s'
        elif is_driving and (before[0] or (before[1] and self._limits.footprint is not None)):
            self.pass_on(before, pose, observation, GUARD_PERIOD, now)
        if before == self.velocity and not (
                (is_driving or before == STANDSTILL) and self.link.needs_repeat(now)):
            return None
        self.link.on_command(self.velocity, now)
        return self.velocity
