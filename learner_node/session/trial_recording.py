"""The part of a session in which a trial is recorded, be it of a series or somebody else's."""

from collections import Counter
from typing import Final

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from episode_store.task_folder import EpisodeKind
from learner_node.session.inputs import is_running
from learner_node.session.outputs import Abandon, Close, Discard, Outputs, Record, Say, StopTrial
from learner_node.session.phases import IN_TRIAL, Phase
from learner_node.session.series import Series
from learner_node.session.state import SessionState
from learner_node.session.unrecorded_trials import UnrecordedTrials
from msgs_bridge.messages.trial_status import State, TrialStatus

#: Who stops a trial, or leaves it unwatched, wants no other either.
_ENDS_SERIES: Final = (StopReason.ASKED, StopReason.NO_HEARTBEAT)


class TrialRecording:
    """
    The trial that is recorded: taken up, finished when all of it is there, or broken off.

    Parameters
    ----------
    state : SessionState
    series : Series
        Goes on after it.

    """

    def __init__(self, state: SessionState, series: Series) -> None:
        """Start with none."""
        self.unrecorded = UnrecordedTrials(state)
        self._state, self._series = state, series
        #: How many decisions have arrived, by trial.
        self._n_decisions: Counter[int] = Counter()

    def forget(self) -> None:
        """Forget what has arrived: a controller that begins anew uses the numbers again."""
        self._n_decisions.clear()
        self.unrecorded.pass_over(0)

    def start(self, now: float) -> Outputs:
        """Record the trial that the controller is asked to start."""
        self.forget()
        self._state.trial = 0
        return [Record(EpisodeKind.TRIAL), *self._series.start(now)]

    def on_decisions(self, trial: int, n_rows: int, now: float) -> Outputs:
        """Count decisions that have arrived."""
        self._n_decisions[trial] += n_rows
        return self.finish(now) or self.take_up(now)

    def on_status(self, status: TrialStatus, before: TrialStatus | None, now: float) -> Outputs:
        """Go on with what the controller says; ``before`` is what it said before."""
        if self._is_overtaken(status, now):
            return self._break_off_overtaken(status, now)
        if is_running(status):
            return self._on_running(status, before, now)
        if status.state is State.ENDED:
            return self._on_ended(status, before, now)
        if self._state.phase is Phase.TRIAL:
            return self.break_off('the controller started anew', now)
        self.unrecorded.pass_over(0)
        # A controller that begins has not got what the one before it was asked.
        if self._state.phase is Phase.STARTING:
            self._series.request.on_lost(now)
        return self._series.proceed(now)

    def _is_overtaken(self, status: TrialStatus, now: float) -> bool:
        """Return True if another trial has begun while this process was suspended."""
        return (self._state.phase is Phase.TRIAL and status.state is not State.IDLE
                and status.trial != self._state.trial and self._has_just_woken(now)
                and not self._state.misfit(status))

    def _has_just_woken(self, now: float) -> bool:
        state = self._state
        return state.inputs.suspension.age(now) <= 2.0 * state.settings.peer_timeout

    def _break_off_overtaken(self, status: TrialStatus, now: float) -> Outputs:
        """Break a trial off whose end was slept through; who runs the one there is goes on."""
        inputs = self._state.inputs
        inputs.status = None
        outputs = self.break_off(
            f'the controller is at trial {status.trial} by now, and its end was not heard; trial '
            f'{status.trial} is not recorded either', now)
        inputs.status = status
        self.unrecorded.pass_over(status.trial)
        return outputs

    def _on_running(
        self, status: TrialStatus, before: TrialStatus | None, now: float,
    ) -> Outputs:
        state = self._state
        if state.phase is Phase.STARTING and (before is None or status.trial != before.trial):
            state.trial = status.trial
            state.go(Phase.TRIAL, now)
            if status.revision != state.revision:
                return self.break_off(
                    f'it runs on field revision {status.revision}, not {state.revision}', now)
        if state.phase is Phase.TRIAL and status.trial == state.trial and (
                misfit := state.misfit(status)):
            return self.break_off(f'the controller {misfit}', now)
        return self.take_up(now)

    def take_up(self, now: float) -> Outputs:
        """Record the trial that somebody else has started, as long as nothing of it is lost."""
        state, status = self._state, self._state.inputs.status
        if (state.phase is not Phase.IDLE or not is_running(status)
                or self.unrecorded.is_known(status.trial)
                or self._n_decisions[status.trial] < status.decisions):
            return []
        if state.misfit(status):
            return []  # another learner's; what lasts is said by the tick
        state.trial = status.trial
        state.go(Phase.TRIAL, now)
        return [Record(EpisodeKind.TRIAL)]

    def _on_ended(
        self, status: TrialStatus, before: TrialStatus | None, now: float,
    ) -> Outputs:
        state = self._state
        if state.phase is Phase.STARTING and self._n_decisions[status.trial] > 0:
            state.trial = status.trial  # it ended before it was seen to run
        if state.phase not in IN_TRIAL or status.trial != state.trial:
            return [*self.unrecorded.on_ended(status, before), *self._series.proceed(now)]
        state.go(Phase.FINISHING, now)
        return self.finish(now)

    def finish(self, now: float) -> Outputs:
        """Close the trial's bag when all its decisions are there, and the drive up to its end."""
        state, status = self._state, self._state.inputs.status
        if state.phase is not Phase.FINISHING or status is None or status.outcome is None:
            return []
        if self._n_decisions[state.trial] < status.decisions or (
                self._is_drive_behind(status) and state.may_settle(now)):
            return []
        if status.outcome is Outcome.ABORTED:
            return self.break_off(status.reason or 'the controller aborted it', now, told=True)
        if misfit := state.misfit(status):
            return self.break_off(f'the controller {misfit}', now)
        if status.stop_reason in _ENDS_SERIES:
            self._series.end()
        # A controller that begins anew may use the number again.
        del self._n_decisions[state.trial]
        state.go(Phase.LEARNING, now)
        return [Close()]

    def _is_drive_behind(self, status: TrialStatus) -> bool:
        inputs = self._state.inputs
        return inputs.odometry_stamp < status.stamp or inputs.awaits_local_grid(status.stamp)

    def tick(self, now: float) -> Outputs:
        """Break the trial off if something of it has not come for too long."""
        state, status = self._state, self._state.inputs.status
        timeout = state.settings.peer_timeout
        if state.phase is Phase.IDLE:
            return self.unrecorded.tick(self._n_decisions[status.trial] if status else 0)
        if state.phase is Phase.FINISHING:
            is_late = now - state.since > timeout
            return self.break_off(self._what_is_short(now), now) if is_late else self.finish(now)
        if status is None or status.state is not State.RUNNING:
            return []
        silence = state.inputs.silence(now, state.since, timeout)
        return self.break_off(silence, now) if silence else []

    def _what_is_short(self, now: float) -> str:
        """Say that a trial has ended of which something is missing."""
        status, suspension = self._state.inputs.status, self._state.inputs.suspension
        n_decided = status.decisions if status else 0
        said = f'{self._n_decisions[self._state.trial]} of {n_decided} decisions arrived'
        if not self._has_just_woken(now):
            return said
        return f'{said}; the learner itself had stood still for {suspension.duration:.1f} s'

    def break_off(self, reason: str, now: float, told: bool = False) -> Outputs:
        """End the trial as aborted; nothing is learnt from it, and it is tried again."""
        state, inputs = self._state, self._state.inputs
        trial = f'trial {state.trial}' if state.trial else 'the trial to come'
        outputs: Outputs = [Say(f'{trial} is broken off: {reason}', warns=True)]
        if state.phase is Phase.STARTING:
            outputs.append(Discard())
        elif state.phase in IN_TRIAL:
            outputs.append(Abandon('' if told else reason, state.trial))
        # A request to a controller that runs nothing could come late and stop the trial after it.
        if state.phase in IN_TRIAL and inputs.peers.controller and is_running(inputs.status):
            outputs.append(StopTrial())
            state.unheard_stop.on_made(now)
        self.forget()
        self.unrecorded.pass_over(state.trial if is_running(inputs.status) else 0)
        state.trial = 0
        self._series.request.postpone(now)
        self._series.go_on(now)
        return outputs
