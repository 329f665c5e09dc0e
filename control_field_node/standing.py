"""How a trial stands and how it ended, as the controller tells it."""

from typing import TYPE_CHECKING

from control_field.robot.limits import STANDSTILL
from control_field_node import words
from control_field_node.trial_run import Move, TrialRun
from msgs_bridge.messages.trial_status import State, TrialStatus

if TYPE_CHECKING:  # it asks, and is asked
    from control_field_node.supervisor import Supervisor


def status_now(supervisor: 'Supervisor') -> TrialStatus:
    """Return how the trial stands, or that there is none."""
    run, problem = supervisor.run, supervisor.problem
    if run is None:
        why, reason = words.why_idle(supervisor.field, supervisor.refusal)
        return supervisor.ended or TrialStatus(
            State.IDLE, supervisor.trial, reason=why, stop_reason=reason,
            revision=-1 if supervisor.field is None else supervisor.field.revision,
            memory='' if supervisor.field is None else supervisor.field.memory)
    return TrialStatus(
        State.RUNNING if problem is None else State.PAUSED, run.trial,
        reason='' if problem is None else problem.told(supervisor.detail), stop_reason=problem,
        steps=run.policy.n_steps, decisions=run.policy.n_decisions,
        reinforcements=run.policy.n_reinforcements, revision=run.revision,
        stamp=_stamp(supervisor), memory=run.memory)


def status_at_end(supervisor: 'Supervisor', run: TrialRun, move: Move) -> TrialStatus:
    """Return how a trial ended by a move."""
    return TrialStatus(
        State.ENDED, run.trial, move.outcome, move.reason, run.policy.n_steps,
        run.policy.n_decisions, run.policy.n_reinforcements, run.revision, _stamp(supervisor),
        stop_reason=move.stop, memory=run.memory)


def drives(supervisor: 'Supervisor') -> bool:
    """Tell whether the robot moves because the controller told it to."""
    is_driven = supervisor.by_hand or (supervisor.run is not None and supervisor.problem is None)
    return is_driven and supervisor.velocity != STANDSTILL


def _stamp(supervisor: 'Supervisor') -> float:
    return 0.0 if supervisor.pose is None else supervisor.pose.stamp
