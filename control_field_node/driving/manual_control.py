"""A person who drives the robot, in a trial or outside one. ROS-free."""

from collections.abc import Callable, Sequence
from typing import Final

from control_field.robot.collision_monitor import Intervention
from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.stop_rules import StopReason
from control_field.robot.takeover import moves, TakeoverDetector
from control_field_node.commands.command_age_check import senders_on
from control_field_node.commands.velocity_output import VelocityOutput
from control_field_node.driving.trial_control import TrialControl
from control_field_node.driving.trial_run import Answer, NOTHING, STOP
from control_field_node.inputs.sensing import Sensing
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import Pose

#: Of a person's commands before there is anything to check them against.
UNMONITORED: Final = ('no usable odometry or no usable neighbourhood has come yet: only the '
                      'limits of speed hold')
_TAKE_NOTHING: Final = ('standstill is sent without anybody driving. That takes no trial over, '
                        'but the robot obeys it between our commands: end that program, or have '
                        'it publish on cmd_vel_teleop')


class Keys:
    """
    Whether a person presses keys, and how long ago the last command was.

    Attributes
    ----------
    is_pressed : bool

    """

    def __init__(self) -> None:
        """Start with no key pressed."""
        self.is_pressed = False
        self._pressed_at = 0.0
        self._stamp: float | None = None

    def update(self, is_moving: bool, now: float, timeout: float) -> bool:
        """Take in a command; return whether the keys were let go and only standstill goes on."""
        if is_moving:
            self.is_pressed, self._pressed_at = True, now
        elif now - self._pressed_at > timeout:
            self.is_pressed = False
            return True
        return False

    def step(self, dt: float, stamp: float) -> float:
        """Return the time since the last command, [s], in that of stamps if it is more."""
        last, self._stamp = self._stamp, stamp
        return dt if last is None else max(dt, stamp - last)

    def forget_step(self) -> None:
        """Begin the next `step` anew."""
        self._stamp = None


class ManualControl:
    """
    Passes a person's commands on, and hands a trial over to who drives.

    Parameters
    ----------
    settings : Settings
    trial : TrialControl
    sensing : Sensing
    output : VelocityOutput

    Attributes
    ----------
    takeover : TakeoverDetector
    keys : Keys
    is_unmonitored : bool
        Whether there is nothing to check the person's commands against.
    publishers_on : callable
        Returns the names of the other nodes that publish on a topic.

    """

    def __init__(
        self, settings: Settings, trial: TrialControl, sensing: Sensing, output: VelocityOutput,
    ) -> None:
        """Start with nobody driving."""
        self.takeover = TakeoverDetector(settings.takeover_timeout)
        self.keys = Keys()
        self.is_unmonitored = False
        self.publishers_on: Callable[[str], Sequence[str]] = lambda topic: ()
        self._trial, self._sensing, self._output = trial, sensing, output
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self.takeover.timeout = settings.takeover_timeout
        self._is_allowed_outside_trials = settings.teleop_outside_trials

    def is_taken_over(self, now: float) -> bool:
        """Return whether a person drives or holds the robot."""
        return self.takeover.is_taken_over(now)

    def has_let_go(self, now: float) -> bool:
        """Return whether a person took a trial over and does not drive any more."""
        return self._trial.pause_reason is StopReason.TAKEN_OVER and not self.is_taken_over(now)

    def hand_over(self) -> Answer:
        """Leave the trial's robot to the person who drives it, and log who that is."""
        if self._trial.run is None or self._trial.pause_reason is StopReason.TAKEN_OVER:
            return NOTHING
        topic = self.takeover.topic
        return self._trial.halt(
            StopReason.TAKEN_OVER, senders_on(topic, self.publishers_on(topic)))

    def on_external_command(self, velocity: Velocity, now: float) -> Answer:
        """Take in a command on `cmd_vel` of somebody else, who may drive."""
        topic, refusals = 'cmd_vel', self._sensing.inputs.refusals
        self.takeover.on_external_command(now, moves(velocity), topic)
        if self.takeover.holds(topic, now):
            self._output.velocity = velocity
            return self.hand_over()
        if self._trial.run is not None and refusals.logged.add(f'{topic}: {_TAKE_NOTHING}'):
            senders = senders_on(topic, self.publishers_on(topic)) or topic
            refusals.log('warning', f'{senders}: {_TAKE_NOTHING}')
        return NOTHING

    def on_teleop_command(self, wanted: Velocity, now: float, dt: float) -> Answer:
        """
        Pass a person's command on, as far as the collision monitor lets it.

        In a trial standstill takes nothing over from the field, unless it follows a drive. Where
        no local grid has ever come only the limits hold; where it is stale, the robot only turns.
        """
        topic, is_moving = 'cmd_vel_teleop', moves(wanted)
        self.takeover.on_external_command(now, is_moving, topic)
        if self._trial.run is not None and not self.takeover.holds(topic, now):
            return NOTHING  # standstill of a program that nobody has driven with
        if self.keys.update(is_moving, now, self.takeover.timeout):
            self._output.is_stopped = False
        if self._output.is_stopped:
            return STOP
        if self._trial.run is None and not self._is_allowed_outside_trials:
            return NOTHING
        self.hand_over()
        return self._pass_on(self._output.ramped(wanted, dt), now, dt)

    def _pass_on(self, wanted: Velocity, now: float, dt: float) -> Answer:
        sensing, output, pose = self._sensing, self._output, self._sensing.pose
        self.is_unmonitored = pose is None or not sensing.inputs.local_grid.has_come
        if pose is None or self.is_unmonitored:
            if sensing.inputs.refusals.logged.add(UNMONITORED):
                sensing.inputs.refusals.log('warning', UNMONITORED)
            output.velocity, output.held = wanted, ''
            return Answer(wanted)
        self._pass_on_monitored(wanted, pose, now, sensing.period + self.keys.step(dt, pose.stamp))
        return Answer(output.velocity)

    def _pass_on_monitored(self, wanted: Velocity, pose: Pose, now: float, dt: float) -> None:
        sensing, output = self._sensing, self._output
        observation = sensing.observe(
            now, self._trial.unknown_is_blocked, self._trial.run is not None)
        reason = output.pass_on(wanted, pose, observation, dt, now)
        if output.held and reason is Intervention.NO_LOCAL_GRID:
            output.held += f': {sensing.local_grid_problem(now)}'

    def release(self) -> Answer:
        """Take in that nobody presses keys any more; stop a robot that was driven by them."""
        self.keys.is_pressed = self._output.is_stopped = self.is_unmonitored = False
        if self._trial.run is not None:
            return NOTHING
        self.keys.forget_step()
        was_driving = self._output.velocity != STANDSTILL
        self._output.stand()
        return STOP if was_driving else NOTHING
