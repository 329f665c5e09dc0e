"""Which trial runs, why it pauses, and how it ended. ROS-free."""

from dataclasses import dataclass
from typing import Any

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.limits import nearest_to_rest, STANDSTILL
from control_field.robot.ready_states import ReadyStates
from control_field.robot.stop_rules import StopReason
from control_field_node.commands.velocity_output import VelocityOutput
from control_field_node.driving.trial_run import Answer, ended_by, Move, NOTHING, STOP, TrialRun
from control_field_node.inputs.sensing import Sensing
from control_field_node.settings import Settings
from msgs_bridge.messages.trial_status import State, TrialStatus


@dataclass(frozen=True, slots=True)
class Pause:
    """
    Why a trial stands still.

    Parameters
    ----------
    reason : StopReason
    detail : str
        What is known beyond the reason.

    """

    reason: StopReason
    detail: str = ''


class TrialControl:
    """
    Starts, pauses and ends trials, one at a time.

    Parameters
    ----------
    parameters : Parameters
        Of the decisions; a trial keeps those it was started with.
    sensing : Sensing
    output : VelocityOutput

    Attributes
    ----------
    run : TrialRun or None
        The trial under way.
    number : int
        Of that or the last trial; 0 before the first.
    states : ReadyStates
        What was made ready for trials to begin with.
    pause : Pause or None
    ended : TrialStatus or None
        How the last trial ended; None once there is a new field.
    ended_by : StopReason or None
        What ended the last trial; None for the goal.

    """

    def __init__(
        self, parameters: Parameters, sensing: Sensing, output: VelocityOutput,
    ) -> None:
        """Start idle."""
        self.parameters = parameters
        self.run: TrialRun | None = None
        self.number = 0
        self.states = ReadyStates()
        self.pause: Pause | None = None
        self.ended: TrialStatus | None = None
        self.ended_by: StopReason | None = None
        self._last: TrialRun | None = None
        self._sensing, self._output = sensing, output
        self._log = sensing.inputs.refusals.log

    @property
    def pause_reason(self) -> StopReason | None:
        """Return why the trial under way stands still; None if it does not."""
        return None if self.pause is None else self.pause.reason

    @property
    def is_driving(self) -> bool:
        """Return whether a trial runs and is not paused."""
        return self.run is not None and self.pause is None

    @property
    def grid(self) -> Grid | None:
        """Return the workspace that decisions are made in, or were last."""
        return None if self._last is None else self._last.grid

    @property
    def parameters_in_force(self) -> Parameters:
        """Return the parameters of the trial under way, or of the next."""
        run = self.run
        return self.parameters if run is None else run.parameters

    @property
    def unknown_is_blocked(self) -> bool:
        """Return whether unknown cells count as blocked, in this trial or the next."""
        return self.parameters_in_force.unknown_is_blocked

    def start(self, field: ControlField, settings: Settings) -> None:
        """Start the next trial."""
        self.number += 1
        self.run = self._last = TrialRun(
            field, self.parameters, settings, self.number, self.states)
        self.pause = self.ended = self.ended_by = None
        self._log('info', f'trial {self.number} starts on field revision {field.revision}')

    def take_field(self, field: ControlField) -> None:
        """Let the trial under way drive on a field; forget how the last one ended."""
        if self.run is not None:
            self.run.refresh(field)
        else:
            # Whoever waits to start the next trial sees by the revision that it is here.
            self.ended = None

    def finish(self, move: Move) -> Answer:
        """End the trial by a move, with one standstill unless a person drives."""
        run = self.run
        assert run is not None
        is_manual = self.pause_reason is StopReason.TAKEN_OVER and not self._output.is_stopped
        if run.new_field is not None:
            self._sensing.take_field(run.new_field)
        self.ended = self._status(
            run, State.ENDED, outcome=move.outcome, reason=move.reason, stop_reason=move.stop)
        self.run, self.pause, self.ended_by, self._output.held = None, None, move.stop, ''
        self._log('info' if move.stop is None else 'warning', self.ended.sentence)
        if is_manual:
            return Answer(None, move.rows)
        self._output.velocity = STANDSTILL
        return Answer(STANDSTILL, move.rows)

    def halt(self, reason: StopReason, detail: str = '') -> Answer:
        """Pause the trial until the reason is gone, or end it if the reason is one to end by."""
        run = self.run
        if run is None or reason is self.pause_reason:
            return NOTHING
        if reason.outcome is not None:
            return self.finish(ended_by(reason, detail))
        self.pause = Pause(reason, detail)
        if reason is StopReason.TOUCHED:
            run.rest()
        else:
            run.interrupt()
        if reason is StopReason.TAKEN_OVER:
            self._log('warning', f'trial {run.trial} pauses: {reason.sentence_with(detail)}')
            return NOTHING
        self._log('warning', f'trial {run.trial} pauses: {detail or reason.sentence}')
        self._output.velocity = STANDSTILL
        return STOP

    def resume(self) -> None:
        """End the pause, if there is one."""
        if self.pause is None or self.run is None:
            return
        reason, pose = self.pause.reason, self._sensing.pose
        self._log('info', f'trial {self.run.trial} continues: {reason.end_sentence}')
        if reason is StopReason.TAKEN_OVER and pose is not None:
            self._output.velocity = nearest_to_rest(self._output.velocity, (pose.v, pose.w))
        self.pause = None

    @property
    def status(self) -> TrialStatus | None:
        """Return the status of the trial under way, or of the one that has ended."""
        if self.run is None:
            return self.ended
        if self.pause is None:
            doing = self.run.waiting or self.run.policy.doubt
            return self._status(self.run, State.RUNNING, reason=doing)
        return self._status(
            self.run, State.PAUSED, reason=self.pause.reason.sentence_with(self.pause.detail),
            stop_reason=self.pause.reason)

    def _status(self, run: TrialRun, state: State, **values: Any) -> TrialStatus:
        pose = self._sensing.pose
        return TrialStatus(
            state, run.trial, steps=run.policy.n_steps, decisions=run.policy.n_decisions,
            reinforcements=run.policy.n_reinforcements, revision=run.revision,
            stamp=0.0 if pose is None else pose.stamp, memory=run.memory, **values)
