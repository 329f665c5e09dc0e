"""Trials of which no bag is made: people are told so, once each."""

from typing import Final

from learner_node.session.inputs import is_running
from learner_node.session.outputs import Outputs, Say
from learner_node.session.phases import Phase
from learner_node.session.state import SessionState
from msgs_bridge.messages.trial_status import TrialStatus

#: Ticks after which decisions that have not arrived are lost; ticks for the reason of
#: `series.LOST`.
_LATE: Final = 40
#: Why a trial was not recorded, by what the session was doing when it ended.
_BUSY: Final = {
    Phase.DEMONSTRATION: 'a demonstration was being recorded',
    Phase.SETTLING: 'a demonstration was being kept',
    Phase.LEARNING: 'the learner was still learning'}


class UnrecordedTrials:
    """
    Says, once each, which trials are not recorded and why.

    Parameters
    ----------
    state : SessionState

    """

    def __init__(self, state: SessionState) -> None:
        """Start with none."""
        self._state = state
        self._known = 0  #: the trial that people know of
        self._incomplete = self._n_ticks = 0
        self._misfit = ''  #: whose field people were told of

    def pass_over(self, trial: int) -> None:
        """Leave a trial be: it was broken off, and people know; 0 for none."""
        self._known = trial

    def is_known(self, trial: int) -> bool:
        """Return True if people know already that a trial is not recorded."""
        return trial == self._known

    def tick(self, n_decisions: int) -> Outputs:
        """
        Say that a trial runs that cannot be recorded any more, once that is sure.

        Parameters
        ----------
        n_decisions : int
            Of it that have arrived.

        """
        status = self._state.inputs.status
        if not is_running(status) or self.is_known(status.trial) or (
                n_decisions >= status.decisions and status.memory == self._state.memory):
            self._n_ticks = 0
            return []
        self._n_ticks = self._n_ticks + 1 if status.trial == self._incomplete else 1
        self._incomplete = status.trial
        if self._n_ticks < _LATE:
            return []
        return self._report(status, f'{n_decisions} of its {status.decisions} decisions arrived '
                            f'here, it began before the learner could hear it')

    def on_ended(self, status: TrialStatus, before: TrialStatus | None) -> Outputs:
        """
        Say that a trial has ended that was not recorded, if people do not know it yet.

        Parameters
        ----------
        status : TrialStatus
            Of its end.
        before : TrialStatus or None
            The one before; what was not seen to run may have ended long ago.

        """
        if not is_running(before) or before.trial != status.trial or self.is_known(status.trial):
            return []
        return self._report(
            status, _BUSY.get(self._state.phase, 'the learner runs trials itself'))

    def _report(self, status: TrialStatus, why: str) -> Outputs:
        """Say why a trial is not recorded; that it is on another field once for each field."""
        self._known = status.trial
        if misfit := self._state.misfit(status):
            reported, self._misfit = self._misfit, misfit
            if misfit == reported:
                return []
            why = f'the controller {misfit}'
        return [Say(f'trial {status.trial} is not recorded: {why}', warns=True)]
