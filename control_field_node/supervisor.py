"""
The controller without ROS: answers what arrives, and decides what may go to the wheels.

Whoever owns a `Supervisor` tells it or its parts what arrives, with the time on a steady clock,
and publishes the `Answer`.
"""

from collections.abc import Callable

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.backing_off import backing_off
from control_field.robot.collision_monitor import Intervention
from control_field.robot.contact_watch import ContactWatch
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from control_field_node.commands.robot_link import place_of
from control_field_node.commands.velocity_output import VelocityOutput
from control_field_node.driving.manual_control import ManualControl
from control_field_node.driving.trial_control import Pause, TrialControl
from control_field_node.driving.trial_run import Answer, ended_by, NOTHING, STOP, TrialRun
from control_field_node.inputs.active_field import ActiveField
from control_field_node.inputs.heartbeat_monitor import HeartbeatMonitor
from control_field_node.inputs.input_monitor import RefusalLog
from control_field_node.inputs.observation import Observation
from control_field_node.inputs.sensing import Sensing
from control_field_node.refusals import problem_with_observation, why_no_start
from control_field_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import FRAME_OWNERS, Pose, problem_with_frame
from msgs_bridge.messages.trial_status import TrialStatus


class Supervisor:
    """
    Runs trials and watches over them.

    Parameters
    ----------
    settings : Settings
        Of robot and rules.
    parameters : Parameters
        Of the decisions.
    log : callable
        Gets ``'info'``, ``'warning'`` or ``'error'`` and one line.

    Attributes
    ----------
    field : ActiveField
    sensing : Sensing
    output : VelocityOutput
    trial : TrialControl
    manual : ManualControl
    heartbeat : HeartbeatMonitor
    contact : ContactWatch

    """

    def __init__(
        self, settings: Settings, parameters: Parameters, log: Callable[[str, str], None],
    ) -> None:
        """Start idle, without a field."""
        self.settings = settings
        self.refusals = RefusalLog(log)
        self.field = ActiveField(self.refusals)
        self.sensing = Sensing(settings, parameters.seed, self.refusals)
        self.output = VelocityOutput(settings, self.refusals.counts)
        self.trial = TrialControl(parameters, self.sensing, self.output)
        self.manual = ManualControl(settings, self.trial, self.sensing, self.output)
        self.heartbeat = HeartbeatMonitor(settings)
        self.contact = ContactWatch(settings.contact_timeout)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings; a trial under way keeps how it drives."""
        self.settings = self.heartbeat.settings = settings
        self.sensing.change_settings(settings)
        self.output.change_settings(settings)
        self.manual.change_settings(settings)
        self.contact.timeout = settings.contact_timeout

    @property
    def status(self) -> TrialStatus:
        """Return how the trial stands, or that there is none."""
        return self.trial.status or self.field.idle_status(self.trial.number)

    @property
    def grid(self) -> Grid | None:
        """Return the workspace that is driven in; None while no field leads anywhere."""
        return self.field.grid if self.trial.run is None else self.trial.run.grid

    @property
    def is_driving(self) -> bool:
        """Return whether the robot moves because the controller told it to."""
        return self.output.velocity != STANDSTILL and (
            self.manual.keys.is_pressed or self.trial.is_driving)

    def accept_field(self, field: ControlField) -> bool:
        """Drive on a field from the next decision on; refuse one of other cells."""
        # In a trial, the topic `trial` tells the revision.
        if not self.field.accept(field, is_logged=self.trial.run is None):
            return False
        if self.trial.run is None or field.grid == self.trial.run.grid:
            self.sensing.take_field(field)
        self.trial.take_field(field)
        return True

    def start(self, now: float) -> str:
        """Start a trial; return why not, or an empty string."""
        refusal = why_no_start(self, now)
        if refusal or self.field.current is None:
            return refusal
        self.trial.start(self.field.current, self.settings)
        self.manual.takeover.let_go()
        self.contact.forget()
        self.sensing.inputs.poses.order.place_anew()
        return ''

    def stop(self, reason: StopReason = StopReason.ASKED, detail: str = '') -> Answer:
        """End the trial with one standstill; who drives by hand has to let go first."""
        self.output.is_stopped = self.manual.keys.is_pressed
        if self.trial.run is not None:
            return self.trial.finish(ended_by(reason, reason.sentence_with(detail)))
        self.output.velocity = STANDSTILL
        return STOP if self.output.is_stopped else NOTHING

    def on_neighbourhood(self, neighbourhood: Neighbourhood, now: float,
                         cells: Grid | None = None) -> None:
        """Take in a neighbourhood, on the cells of the field or on others."""
        self.sensing.on_neighbourhood(
            neighbourhood, cells or self.grid, now, self.trial.pause is not None)

    def on_contact(self, touches: bool, now: float) -> Answer:
        """Take in what a bumper says: what runs into the standing robot is no collision."""
        pose = self.sensing.pose
        stands = pose is not None and self.output.stands(pose, now) and (
            self.trial.pause_reason is not StopReason.TAKEN_OVER)
        if self.contact.on_contact(touches, stands):
            return self.trial.halt(StopReason.CONTACT)
        return self.trial.halt(StopReason.TOUCHED) if self.contact.is_touched else NOTHING

    def on_bad_odometry(self, what: str, now: float) -> Answer:
        """Take in odometry that is not to be trusted: stand until it has been good again."""
        self.sensing.on_bad_odometry(what, now)
        if self.manual.is_taken_over(now) or self.trial.pause_reason in (
                StopReason.STALE_ODOMETRY, StopReason.LATE_POSES):
            answer = NOTHING  # a person drives, or the robot stands as nothing good comes
        else:
            answer = self.trial.halt(StopReason.BAD_INPUT, what)
        self.refusals.refuse(what, is_logged=answer is not NOTHING)
        return answer

    def on_pose(self, pose: Pose, now: float, clock: float | None = None) -> Answer:
        """Answer a pose of the odometry; ``clock`` is the time that stamps are made of."""
        self.sensing.on_pose(pose, now, self.trial.pause is not None)
        grid, velocity = self.grid, self.output.velocity
        if grid is None:
            self.output.link.on_pose(pose, velocity, now, clock)
            return NOTHING
        if problem := problem_with_frame(pose.frame_id, grid.frame_id, 'odom', FRAME_OWNERS):
            return self.on_bad_odometry(problem, now)
        place, stop = self.sensing.locate(pose, grid)
        is_ours = self.manual.keys.is_pressed or (
            self.trial.run is not None and self.trial.pause_reason is not StopReason.TAKEN_OVER)
        self.output.link.on_pose(place, velocity, now, clock, pose, is_ours)
        if self.trial.run is None:
            return NOTHING
        if stop is not None:
            return self.trial.halt(stop)
        return self._answer(self.trial.run, place, now)

    def _answer(self, run: TrialRun, pose: Pose, now: float) -> Answer:
        observation = self.sensing.observe(now, run.parameters.unknown_is_blocked)
        if self.manual.is_taken_over(now):
            return self._follow(run, pose, observation)
        if self.contact.lasts_too_long(pose.stamp):
            return self.trial.halt(StopReason.CONTACT, StopReason.TOUCHED.sentence)
        if self.contact.is_touched:
            return self.trial.halt(StopReason.TOUCHED)
        if observation is None:
            return self.trial.halt(
                StopReason.STALE_NEIGHBOURHOOD, self.sensing.local_grid_problem(now))
        if problem := _problem_with(observation, run, pose):
            return self.trial.halt(problem.reason, problem.detail)
        if self.sensing.inputs.is_bad(now):
            return NOTHING
        if run.stands_to_change:
            return self._change_field(run)
        if self.output.link.is_lost:
            return self.trial.halt(StopReason.LATE_COMMANDS)
        self.trial.resume()
        return self._drive(run, pose, observation, now)

    def _change_field(self, run: TrialRun) -> Answer:
        """Stand where a field takes long or changes the cells, and then change to it."""
        if self.trial.pause is None:
            return self.trial.halt(StopReason.READING_FIELD)
        end = run.change_field()
        if self.field.current is not None:
            self.sensing.take_field(self.field.current)
        return NOTHING if end is None else self.trial.finish(end)

    def _drive(
        self, run: TrialRun, pose: Pose, observation: Observation, now: float,
    ) -> Answer:
        output = self.output
        move = run.step(pose, observation, output.commanded_speed,
                        output.link.predicted(pose, now), output.link.patience,
                        output.is_kept_back)
        if move.outcome is not None:
            return self.trial.finish(move)
        period = self.sensing.period
        reason = output.pass_on(output.slowed(move.velocity), pose, observation, period, now)
        if output.is_kept_back or run.waiting:
            away = backing_off(
                place_of(pose), observation.local_grid, period, self.settings.limits)
            if away != STANDSTILL:
                output.pass_on(away, pose, observation, period, now)
        output.held = output.held or run.waiting
        return Answer(output.velocity, move.rows,
                      None if reason is Intervention.NONE else move.velocity)

    def _follow(self, run: TrialRun, pose: Pose, observation: Observation | None) -> Answer:
        """Report what a person drives."""
        self.manual.hand_over()
        if observation is None:
            return NOTHING
        move = run.follow(pose, observation)
        if move.outcome is not None:
            return self.trial.finish(move)
        return Answer(None, move.rows)

    def guard(self, now: float, clock: float | None = None) -> Answer:
        """Check whether the last command may hold while no pose comes, or has to be repeated."""
        pose, is_manual = self.sensing.pose, self.manual.keys.is_pressed
        self.sensing.inputs.suspension.look(now)
        if self.settings.lockstep or pose is None or (
                self.trial.pause_reason is StopReason.TAKEN_OVER and not is_manual):
            return NOTHING
        observation = self.sensing.observe(
            now, self.trial.unknown_is_blocked, self.trial.run is not None)
        is_driving = (self.trial.run is not None or is_manual) and not self.manual.is_unmonitored
        return Answer(self.output.guard(pose, observation, now, clock, is_driving))

    def check_inputs(self, now: float) -> Answer:
        """Halt a trial where something has not arrived for too long; call it every 0.1 s."""
        self.heartbeat.update(now)
        trial, inputs = self.trial, self.sensing.inputs
        inputs.suspension.look(now)
        if trial.run is not None and self.heartbeat.is_missing:
            return trial.halt(StopReason.NO_HEARTBEAT)
        if trial.run is None or inputs.is_bad(now) or self.manual.is_taken_over(now):
            return NOTHING
        if inputs.odometry.is_stale(now):
            return trial.halt(inputs.why_stale(now), inputs.odometry.absence(now, 'odometry'))
        if inputs.local_grid.is_stale(now) and trial.pause is None:
            return trial.halt(
                StopReason.STALE_NEIGHBOURHOOD, self.sensing.local_grid_problem(now))
        return NOTHING


def _problem_with(observation: Observation, run: TrialRun, pose: Pose) -> Pause | None:
    """Return why a trial pauses although there is a local grid; None if it does not."""
    if observation.is_all_unknown and run.parameters.unknown_is_blocked:
        return Pause(StopReason.STALE_NEIGHBOURHOOD, 'all around the robot is unknown')
    text = problem_with_observation(observation, run.grid, pose.x, pose.y)
    return Pause(StopReason.BAD_INPUT, text) if text else None
