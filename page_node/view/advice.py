"""What goes on and what to do next, as a code that the page has words for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from typing import Any, Final

from control_field.records import Outcome
from control_field.robot.stop_reasons import StopReason
from msgs_bridge.messages.trial_status import State, TrialStatus
from page_node.view.situation import Situation

#: Why a recording ended that nobody kept, where there is something to do about it.
_ENDED: Final = ('left', 'intruded', 'disk')
#: What is under way in a phase of the learner, where nobody has to do anything. A trial that it
#: is at and that is not under way has just ended.
_BUSY: Final[Mapping[str, str]] = {
    'settling': 'learning', 'learning': 'learning', 'waiting': 'starting', 'placing': 'placing',
    'starting': 'starting', 'trial': 'learning', 'finishing': 'learning'}


@dataclass(frozen=True)
class Advice:
    """
    What to tell a person.

    Parameters
    ----------
    code : str
        The page has words for `advice.<code>` in every language.
    values : mapping
        What stands in them; ``n`` is what a plural goes by.
    because : str
        Key of a second sentence, such as ``stopped.no_way`` or ``held.blocked``; empty for none.
    details : str
        The same in a node's own words, for who wants to know; empty for none.

    """

    code: str
    values: Mapping[str, Any] = field(default_factory=dict)
    because: str = ''
    details: str = ''

    def content(self) -> dict[str, Any]:
        """Return it as it goes to the page."""
        return {'code': self.code, 'values': dict(self.values), 'because': self.because,
                'details': self.details}


def advice_for(situation: Situation) -> Advice:
    """Say what goes on and what to do next; what keeps everything from going on comes first."""
    return (_about_absence(situation) or _about_drive(situation) or _about_trial(situation)
            or _about_work(situation) or _about_next(situation))


def _about_absence(situation: Situation) -> Advice | None:
    """Say who is missing, or who does not fit."""
    if not situation.has_learner and not situation.has_controller and not situation.has_robot:
        return Advice('nobody')
    if situation.conflict and situation.has_other_cells and situation.is_simulated:
        return Advice('other_cells', details=situation.conflict)
    if situation.conflict:
        return Advice('conflict', details=situation.conflict)
    if not situation.has_robot:
        return Advice('no_robot')
    if not situation.has_controller:
        return Advice('no_controller', details=situation.status.problem)
    if not situation.has_learner:
        return Advice('no_learner')
    if situation.status.problem:
        return Advice('not_heard', details=situation.status.problem)
    return None


def _about_drive(situation: Situation) -> Advice | None:
    """Say what is in the way of who drives, and how a recording goes."""
    status = situation.status
    if status.phase == 'demonstration':
        if situation.held and situation.is_driven:
            return Advice('record_held', {}, _held(situation), status.held)
        if situation.is_stuck:
            return Advice('does_not_move')
        return Advice('record' if situation.has_moved else 'record_begin')
    if situation.is_driven and not _is_under_way(situation.trial):
        if situation.held:
            return Advice('drive_held', {}, _held(situation), status.held)
        if situation.is_stuck:
            return Advice('does_not_move')
    return None


def _is_under_way(trial: TrialStatus) -> bool:
    return trial.state in (State.RUNNING, State.PAUSED)


def _about_trial(situation: Situation) -> Advice | None:
    """Say how the trial that is under way goes."""
    trial, status = situation.trial, situation.status
    if not _is_under_way(trial):
        return None
    if trial.stop_reason is StopReason.TAKEN_OVER:
        if situation.held and situation.is_driven:
            return Advice('trial_corrected_held', {}, _held(situation), status.held)
        return Advice('trial_corrected')
    if trial.state is State.PAUSED:
        return Advice('trial_paused', {}, _stopped(trial), trial.reason)
    if situation.held:
        return Advice('trial_held', {}, _held(situation), status.held)
    return Advice('trial_series' if status.trials_left > 1 else 'trial')


def _about_work(situation: Situation) -> Advice | None:
    """Say what is waited for between drives and trials."""
    status = situation.status
    if status.phase == 'waiting' and situation.has_waited:
        return Advice('waiting', details=situation.doing)
    code = _BUSY.get(status.phase, '')
    # In the middle of a series nothing new is said at every turn of it.
    is_between = status.trials_left > 0 and situation.trial.trial > 0
    return Advice('trial_series' if is_between else code) if code else None


def _about_next(situation: Situation) -> Advice:
    """Say what to do next where nothing is under way."""
    trial, robot = situation.trial, 'simulated' if situation.is_simulated else 'real'
    if situation.ended in _ENDED:
        return Advice(f'recording_{situation.ended}')
    if not situation.is_learnt:
        return Advice('show_first' if not situation.n_episodes else 'show_again')
    if situation.tries_left:
        return Advice('drive_back', {'n': situation.tries_left})
    if trial.state is State.ENDED and trial.outcome is not None:
        return _about_end(trial, trial.outcome, robot)
    return Advice(f'try_{robot}', {'share': _percent(situation.status.basin)})


def _about_end(trial: TrialStatus, outcome: Outcome, robot: str) -> Advice:
    values = {'trial': trial.trial, 'n': trial.steps}
    if outcome is Outcome.GOAL:
        return Advice(f'ended_goal_{robot}', values)
    if trial.stop_reason is StopReason.ASKED:
        return Advice(f'ended_asked_{robot}', values)
    return Advice(f'ended_{outcome}_{robot}', values, _stopped(trial), trial.reason)


def _held(situation: Situation) -> str:
    return f'held.{situation.held}'


def _stopped(trial: TrialStatus) -> str:
    return f'stopped.{trial.stop_reason}' if trial.stop_reason else ''


def _percent(share: float) -> int:
    """Return a share in percent; what is not all of it is never rounded up to 100."""
    return math.floor(100.0 * share + 1e-9) if math.isfinite(share) else 0
