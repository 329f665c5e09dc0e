"""
The controller without ROS: which trial runs, what stops it, and what may go to the wheels.

Whoever owns a `Supervisor` tells it what arrives, with the time on a steady clock, and publishes
the `Answer` it gets.
"""

from collections.abc import Callable, Sequence
from typing import Final

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.collision_monitor import Intervention
from control_field.robot.limits import nearest_to_rest, STANDSTILL, Velocity
from control_field.robot.stop_rules import StopReason
from control_field.robot.takeover import moves, TakeoverDetector
from control_field_node import words
from control_field_node.answer import Answer, NOTHING, STOP
from control_field_node.heartbeat import Heartbeat
from control_field_node.intake import Intake
from control_field_node.local_grids import LocalGrids
from control_field_node.localisation import Localisation
from control_field_node.refusals import why_no_start
from control_field_node.seen import Seen
from control_field_node.settings import Settings
from control_field_node.standing import status_at_end, status_now
from control_field_node.trial_run import ended_by, Move, TrialRun
from control_field_node.wheels import Wheels
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import FRAME_OWNERS, Pose, problem_with_frame
from msgs_bridge.messages.trial_status import TrialStatus

#: Time a command is taken to last where it is not known yet, [s].
_USUAL_STEP: Final = 0.05


class Supervisor:
    """
    Runs trials and watches over them.

    Parameters
    ----------
    settings : Settings
        Of robot and rules.
    parameters : Parameters
        Of the decisions; a trial keeps those it was started with.
    log : callable
        Gets ``'info'``, ``'warning'`` or ``'error'`` and one line.

    Attributes
    ----------
    who : callable
        Returns the names of the other nodes that publish on a topic; set by whoever knows.

    """

    def __init__(
        self, settings: Settings, parameters: Parameters, log: Callable[[str, str], None],
    ) -> None:
        """Start idle, without a field."""
        self.parameters = parameters
        self.field: ControlField | None = None
        self.run: TrialRun | None = None
        self.problem: StopReason | None = None
        self.ended_by: StopReason | None = None
        self.refusal = self.odometry_refusal = ''
        self.is_unmonitored = self.is_reading = False
        self.pose: Pose | None = None
        self.trial = 0
        self.ended: TrialStatus | None = None
        self._log = log
        self.who: Callable[[str], Sequence[str]] = lambda topic: ()
        self.localisation = Localisation(settings, parameters.seed)
        self._takeover = TakeoverDetector(settings.takeover_timeout)
        self.intake = Intake(settings, log)
        self.heartbeat = Heartbeat(settings)
        self.local_grids = LocalGrids(self.intake, self.localisation)
        self.wheels = Wheels(settings, self.intake.counts)
        self._dt = _USUAL_STEP
        self._driven: float | None = None
        self.detail = ''
        self.by_hand, self._is_stopped, self._pressed = False, False, 0.0
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings; a trial under way keeps how it drives."""
        self.settings, self.limits = settings, settings.limits
        self._takeover.timeout = settings.takeover_timeout
        self.localisation.settings = self.heartbeat.settings = settings
        self.intake.change_settings(settings)
        self.wheels.change_settings(settings)

    @property
    def grid(self) -> Grid | None:
        """Return the workspace; None before the first field."""
        return None if self.field is None else self.field.grid

    @property
    def velocity(self) -> Velocity:
        """Return the command that holds, [m/s] and [rad/s]."""
        return self.wheels.velocity

    @property
    def held(self) -> str:
        """Return why a robot that is to drive stands; empty if it does not."""
        return self.wheels.held

    @property
    def neighbourhood(self) -> Neighbourhood | None:
        """Return the newest neighbourhood that can be placed on the workspace."""
        return self.local_grids.newest

    @property
    def status(self) -> TrialStatus:
        """Return how the trial stands."""
        return status_now(self)

    def accept_field(self, field: ControlField) -> bool:
        """Take over a field for the next decision; refuse one of another grid."""
        old, tells = self.field, self.run is None  # in a trial `trial` tells the revision
        if old is not None and not old.is_void and field.grid != old.grid:
            self.refuse_field(f'it is of {field.grid}, this robot drives in {old.grid}; '
                              f'restart the controller to change the workspace')
            return False
        self.refusal = ''
        self.field = field
        self.local_grids.take_workspace(field.grid)
        self.localisation.take_field(field)
        if self.run is not None:
            self.run.refresh(field)
        else:
            # Whoever waits to start the next trial sees by the revision that it is here.
            self.ended = None
        if tells and (old is None or (field.revision, field.memory) != (
                old.revision, old.memory)):
            self._log('info', words.of_field(field))
        return True

    def reads_field(self, is_reading: bool) -> Answer:
        """Take in whether a large field is being read: stand, and say why, for as long."""
        self.is_reading = is_reading
        is_new = is_reading and self.problem is None
        return self._pause(StopReason.READING_FIELD) if is_new else NOTHING

    def refuse_field(self, why: str) -> None:
        """Keep the field there is; say so once a kind of reason."""
        self.intake.counts['refused fields'] += 1
        if self.intake.is_first(f'control field: {why}'):
            self._log('error', f'control field refused: {why} (not said again)')
        self.refusal = why

    def start(self, now: float) -> str:
        """Start a trial; return why not, or an empty string."""
        refusal = why_no_start(self, now)
        if refusal or self.field is None:
            return refusal
        self.trial += 1
        self.run = TrialRun(self.field, self.parameters, self.settings, self.trial)
        self.problem = self.ended_by = self.ended = None
        self._takeover.let_go()
        self.intake.poses.place_anew()
        self._log('info', f'trial {self.trial} starts on field revision {self.field.revision}')
        return ''

    def stop(self, reason: StopReason = StopReason.ASKED, detail: str = '') -> Answer:
        """End the trial with one standstill; who drives by hand has to let go first."""
        self._is_stopped = self.by_hand
        if self.run is None:
            self.wheels.velocity = STANDSTILL
            return STOP if self._is_stopped else NOTHING
        return self._end(ended_by(reason, reason.told(detail)))

    def _end(self, move: Move) -> Answer:
        run, silent = self.run, self.problem is StopReason.TAKEN_OVER and not self._is_stopped
        assert run is not None
        self.ended = status_at_end(self, run, move)
        self.run, self.problem, self.ended_by, self.wheels.held = None, None, move.stop, ''
        self._log('info' if move.stop is None else 'warning', self.ended.sentence)
        if silent:
            return Answer(None, move.rows)
        self.wheels.velocity = STANDSTILL
        return Answer(STANDSTILL, move.rows)

    def _pause(self, reason: StopReason, detail: str = '') -> Answer:
        """Stand still until the cause is gone; the standstill is said once."""
        run = self.run
        if run is None or reason is self.problem:
            return NOTHING
        if reason.outcome is not None:
            return self._end(ended_by(reason, detail))
        self.problem, self.detail = reason, detail
        run.interrupt()
        if reason is StopReason.TAKEN_OVER:
            self._log('warning', f'trial {run.trial} pauses: {reason.told(detail)}')
            return NOTHING
        self._log('warning', f'trial {run.trial} pauses: {detail or reason.sentence}')
        self.wheels.velocity = STANDSTILL
        return STOP

    def _resume(self) -> None:
        if self.problem is not None and self.run is not None:
            self._log('info', f'trial {self.run.trial} continues: {self.problem.end_sentence}')
            if self.problem is StopReason.TAKEN_OVER and self.pose is not None:
                self.wheels.velocity = nearest_to_rest(self.velocity, (self.pose.v, self.pose.w))
            self.problem = None

    def saw_neighbourhood(self, neighbourhood: Neighbourhood, now: float,
                          cells: Grid | None = None) -> None:
        """Take in a neighbourhood, on the field's cells or others; a late one is passed over."""
        self.local_grids.saw(neighbourhood, cells or self.grid, now, self.problem is not None)

    def saw_bad_input(self, what: str, now: float) -> Answer:
        """Take in odometry that is not to be trusted: stand still until it has been good again."""
        self.intake.distrust(now)
        self.intake.odometry.pass_over(now, what)
        self.odometry_refusal = what
        if self.problem in (StopReason.STALE_ODOMETRY, StopReason.LATE_POSES) or (
                self._takeover.is_taken_over(now)):
            answer = NOTHING  # the robot stands as nothing good comes, or a person drives it
        else:
            answer = self._pause(StopReason.BAD_INPUT, what)
        self.intake.refuse(what, is_said=answer is not NOTHING)
        return answer

    def saw_external(self, velocity: Velocity, now: float) -> Answer:
        """Take in a command on `cmd_vel` that is not an own one: somebody else may drive."""
        topic = 'cmd_vel'
        if self._takeover.saw_external(now, moves(velocity), topic):
            self.wheels.velocity = velocity
            return self._hand_over()
        if self.run is not None and self.intake.is_first(words.idle_sender((), topic)):
            self._log('warning', words.idle_sender(self.who(topic), topic))
        return NOTHING

    def _hand_over(self) -> Answer:
        """Leave the robot to the person who drives it, and say who that is."""
        if self.run is None or self.problem is StopReason.TAKEN_OVER:
            return NOTHING
        topic = self._takeover.topic
        return self._pause(StopReason.TAKEN_OVER, words.person(self.who(topic), topic))

    def saw_rival(self, who: str) -> Answer:
        """Take in that another publisher is on `cmd_vel` which must not be there."""
        return self._pause(StopReason.OTHER_PUBLISHER, f'{who} publishes cmd_vel, too')

    def saw_contact(self) -> Answer:
        """Take in that the robot touches something."""
        return self._pause(StopReason.CONTACT)

    def saw_pose(self, pose: Pose, now: float, clock: float | None = None) -> Answer:
        """Take in a pose of the odometry and answer it; ``clock`` is what stamps are made of."""
        last, self.pose, self.odometry_refusal = self.pose, pose, ''
        self.intake.came(self.intake.odometry, now, self.problem is not None)
        if self.field is None:
            self.wheels.heard(pose, now, clock)
            return NOTHING
        if problem := problem_with_frame(
                pose.frame_id, self.field.grid.frame_id, 'odom', FRAME_OWNERS):
            return self.saw_bad_input(problem, now)
        if last is not None and pose.stamp > last.stamp:
            self._dt = pose.stamp - last.stamp
        self.pose = self.localisation.place(pose, self.neighbourhood)
        self.wheels.heard(self.pose, now, clock, pose, self.by_hand or (
            self.run is not None and self.problem is not StopReason.TAKEN_OVER))
        reason = self.intake.poses.observe(
            pose.stamp, pose.x, pose.y, self.field.grid, (self.pose.x, self.pose.y))
        if self.run is None:
            return NOTHING
        if reason is not None:
            return self._pause(reason)
        return self._answer(self.run, self.pose, now)

    def _answer(self, run: TrialRun, pose: Pose, now: float) -> Answer:
        seen = self._seen_now(now)
        if self._takeover.is_taken_over(now):
            return self._follow(run, pose, seen)
        if seen is None:
            return self._pause(
                StopReason.STALE_NEIGHBOURHOOD, self.local_grids.problem(pose, now))
        if seen.shows_nothing and run.parameters.unknown_is_blocked:
            return self._pause(StopReason.STALE_NEIGHBOURHOOD, 'all around the robot is unknown')
        if problem := words.problem_with_local_grid(seen, run.policy.field.grid, pose.x, pose.y):
            return self._pause(StopReason.BAD_INPUT, problem)
        if self.intake.is_bad(now):
            return NOTHING
        if self.is_reading or (run.has_large_fresh and self.problem is None):
            return self._pause(StopReason.READING_FIELD)
        if run.has_large_fresh:  # the robot stands: nothing else is looked at meanwhile
            end = run.take_fresh()
            return NOTHING if end is None else self._end(end)
        if self.wheels.is_lost:
            return self._pause(StopReason.LATE_COMMANDS)
        self._resume()
        move = run.step(pose, seen, self.wheels.told, self.wheels.predicted(pose, now),
                        self.wheels.patience)
        if move.outcome is not None:
            return self._end(move)
        reason = self._pass_on(self.wheels.slowed(move.velocity), pose, seen, self._dt, now)
        return Answer(
            self.velocity, move.rows, None if reason is Intervention.NONE else move.velocity)

    def _follow(self, run: TrialRun, pose: Pose, seen: Seen | None) -> Answer:
        self._hand_over()
        move = Move(STANDSTILL) if seen is None else run.follow(pose, seen)
        if move.outcome is not None:
            return self._end(move)
        return Answer(None, move.rows)

    def _seen_now(self, now: float) -> Seen | None:
        parameters = self.parameters if self.run is None else self.run.parameters
        return self.local_grids.seen_from(self.pose, now, parameters.unknown_is_blocked)

    def _seen_lately(self, now: float) -> Seen | None:
        return None if self.intake.odometry.is_stale(now) else self._seen_now(now)

    def _pass_on(self, wanted: Velocity, pose: Pose, seen: Seen | None, dt: float,
                 now: float) -> Intervention:
        reason = self.wheels.pass_on(wanted, pose, seen, dt, now)
        if self.held and reason is Intervention.NO_LOCAL_GRID:
            self.wheels.held += f': {self.local_grids.problem(pose, now)}'
        return reason

    def guard(self, now: float, clock: float | None = None) -> Answer:
        """Look whether the last command may hold while no pose comes, or has to be repeated."""
        if self.settings.lockstep or self.pose is None or (
                self.problem is StopReason.TAKEN_OVER and not self.by_hand):
            return NOTHING
        seen = self._seen_lately(now)
        drives = (self.run is not None or self.by_hand) and not self.is_unmonitored
        if self.wheels.look(self.pose, seen, now, clock, drives):
            return Answer(self.velocity)
        return NOTHING

    def let_go(self) -> bool:
        """Take in that nobody drives by hand any more; tell whether the robot is to be stopped."""
        self.by_hand = self._is_stopped = self.is_unmonitored = False
        if self.run is not None:
            return False
        self._driven = None
        return self.wheels.stand()

    def saw_goal(self, x: float, y: float, frame_id: str) -> None:
        """Say where the field leads: the goal is what was demonstrated, not what is clicked."""
        problem = words.problem_with_goal(self.field, x, y, frame_id)
        self._log('warning' if problem else 'info', problem or words.LEADS_THERE)

    def watch(self, now: float) -> Answer:
        """Look whether something has not arrived for too long."""
        self.heartbeat.look(now)
        if self.run is not None and self.heartbeat.is_missing:
            return self._pause(StopReason.NO_HEARTBEAT)
        if self.run is None or self.intake.is_bad(now) or self._takeover.is_taken_over(now):
            return NOTHING
        if self.intake.odometry.is_stale(now):
            return self._pause(
                self.intake.why_stale(now), self.intake.odometry.absence(now, 'odometry'))
        if self.intake.local_grid.is_stale(now) and self.problem is None:
            return self._pause(
                StopReason.STALE_NEIGHBOURHOOD, self.local_grids.problem(self.pose, now))
        return NOTHING

    def is_let_go(self, now: float) -> bool:
        """Tell whether a person has driven and does not any more."""
        return self.problem is StopReason.TAKEN_OVER and not self._takeover.is_taken_over(now)

    def teleop(self, wanted: Velocity, now: float, dt: float) -> Answer:
        """
        Pass a person's command on, as far as the collision monitor lets it.

        In a trial standstill takes nothing over from the field, unless it follows a drive. Where
        no local grid has ever come only the limits hold; where it is stale, the robot only turns.
        """
        holds = self._takeover.saw_external(now, moves(wanted), 'cmd_vel_teleop')
        if self.run is not None and not holds:
            return NOTHING  # standstill of a program that nobody has driven with
        if moves(wanted):
            self.by_hand, self._pressed = True, now
        elif now - self._pressed > self.settings.takeover_timeout:
            self.by_hand = self._is_stopped = False  # standstill goes on, the keys are let go
        if self._is_stopped:
            return STOP
        if self.run is None and not self.settings.teleop_outside_trials:
            return NOTHING
        self._hand_over()
        wanted = self.wheels.ramped(wanted, dt)
        self.is_unmonitored = self.pose is None or not self.intake.local_grid.has_come
        if self.pose is None or self.is_unmonitored:
            if self.intake.is_first(words.UNMONITORED):
                self._log('warning', words.UNMONITORED)
            self.wheels.velocity, self.wheels.held = wanted, ''
            return Answer(wanted)
        self._pass_on(wanted, self.pose, self._seen_lately(now), self._dt + self._since(dt), now)
        return Answer(self.velocity)

    def _since(self, dt: float) -> float:
        """Return the time since a person's last command, in that of the stamps if it is more."""
        assert self.pose is not None
        last, self._driven = self._driven, self.pose.stamp
        return dt if last is None else max(dt, self.pose.stamp - last)
