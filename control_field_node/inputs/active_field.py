"""The control field in force, and why another was refused."""

from typing import Final

from control_field.grid import Grid
from control_field.records import ControlField
from control_field.robot.stop_rules import StopReason
from control_field_node.inputs.input_monitor import RefusalLog
from msgs_bridge.messages.memory_identity import task_of
from msgs_bridge.messages.poses import problem_with_frame
from msgs_bridge.messages.trial_status import State, TrialStatus

#: Of a goal that was demonstrated.
_LEADS_THERE: Final = 'goal_pose: the control field leads there; ~/start_trial starts'


class ActiveField:
    """
    Holds the control field in force.

    Parameters
    ----------
    refusals : RefusalLog

    Attributes
    ----------
    current : ControlField or None
    refusal : str
        Why the newest field was refused; empty if it was not.

    """

    def __init__(self, refusals: RefusalLog) -> None:
        """Start without a field."""
        self.current: ControlField | None = None
        self.refusal = ''
        self._refusals = refusals

    @property
    def grid(self) -> Grid | None:
        """Return the workspace; None while there is no field that leads anywhere."""
        return None if self.current is None or self.current.is_void else self.current.grid

    def accept(self, field: ControlField, is_logged: bool) -> bool:
        """Put a field in force, and log a new one if asked to; refuse one that `_problem` has."""
        old = self.current
        if old is not None and (problem := _problem(field, old, not is_logged)):
            self.refuse(problem)
            return False
        self.refusal = ''
        self.current = field
        if is_logged and (old is None or (field.revision, field.memory) != (
                old.revision, old.memory)):
            self._refusals.log('info', _described(field))
        return True

    def refuse(self, why: str) -> None:
        """Keep the field in force; log each kind of reason once."""
        self._refusals.counts['refused fields'] += 1
        if self._refusals.logged.add(f'control field: {why}'):
            self._refusals.log('error', f'control field refused: {why} (not said again)')
        self.refusal = why

    def why_idle(self) -> StopReason | None:
        """Return why no trial can be started; None if one can be."""
        if self.current is not None and not self.current.is_void:
            return None
        return StopReason.WRONG_FIELD if self.refusal else StopReason.NO_FIELD

    def idle_status(self, trial: int) -> TrialStatus:
        """Return the status after a number of trials while none runs."""
        field, reason = self.current, self.why_idle()
        return TrialStatus(
            State.IDLE, trial, reason='' if reason is None else reason.sentence_with(self.refusal),
            stop_reason=reason, revision=-1 if field is None else field.revision,
            memory='' if field is None else field.memory)

    def on_goal(self, x: float, y: float, frame_id: str) -> None:
        """Log whether the field leads to a goal: that is demonstrated, not clicked."""
        problem = problem_with_goal(self.current, x, y, frame_id)
        self._refusals.log('warning' if problem else 'info', problem or _LEADS_THERE)


def _problem(field: ControlField, old: ControlField, is_running: bool) -> str:
    """Return why a field cannot take the place of another; empty where it can."""
    if old.is_void or field.grid.offset_to(old.grid) is not None or (
            field.is_void and not is_running):
        return ''
    cells = f'it is of {field.grid}, the one there is of {old.grid}: their cells are not the same'
    if is_running:
        return f'{cells}, and a trial runs; it can be changed between trials'
    same = f'{cells}, and both are of one memory; restart the controller'
    return same if field.memory == old.memory else ''


def _described(field: ControlField) -> str:
    task = task_of(field.memory)
    text = f'control field revision {field.revision}' + (f' of task {task}' if task else '')
    return text if field.revision else f'{text}: it is empty, nothing was learnt yet'


def problem_with_goal(
    field: ControlField | None, x: float, y: float, frame_id: str,
) -> str:
    """Return why the robot will not drive to a point, [m]; empty where the field leads there."""
    if field is None or field.is_void:
        return 'goal_pose: there is no control field yet'
    if problem := problem_with_frame(frame_id, field.grid.frame_id, 'goal_pose'):
        return f'{problem}: choose that as the fixed frame of what it is clicked in'
    if field.grid.cell_from_world(x, y) == field.goal:
        return ''
    there = field.grid.world_from_cell(*field.goal)
    return (f'goal_pose: the control field leads to ({there[0]:g}, {there[1]:g}) m only; '
            f'demonstrate the way to ({x:g}, {y:g}) m')
