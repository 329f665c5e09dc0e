"""What has arrived of the controller's trials: whether one that others start can be recorded."""

from collections import Counter
from typing import Final, TypeGuard

from learner_node.phases import Phase, SessionError
from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.trial_status import State, TrialStatus

#: Ticks after which decisions that have not arrived are lost; ticks for the reason of `LOST`.
_LATE: Final = 40
#: The same after which a trial that was heard of during a demonstration is no late word of one
#: that has ended: the word of its end would have come.
_LASTING: Final = 3
#: Why a demonstration during which a trial ran is not kept, by the trial's number.
INTRUDED: Final = 'trial {} ran meanwhile and drove the robot; show the way again'
#: Why a trial was not recorded, by what the session was doing when it ended.
_BUSY: Final = {
    Phase.DEMONSTRATION: 'a demonstration was being recorded',
    Phase.SETTLING: 'a demonstration was being kept',
    Phase.LEARNING: 'the learner was still learning'}


def is_running(status: TrialStatus | None) -> TypeGuard[TrialStatus]:
    """Tell whether a trial runs, or is paused."""
    return status is not None and status.state in (State.RUNNING, State.PAUSED)


class DecisionCounter:
    """The decisions that have arrived, by trial, and which trial is over for the session."""

    def __init__(self) -> None:
        """Start with none."""
        self._counts: Counter[int] = Counter()
        self._passed = self._short = self._n_short = 0
        self._told = ''

    def __getitem__(self, trial: int) -> int:
        """Return how many decisions of a trial have arrived."""
        return self._counts[trial]

    def add(self, trial: int, n_rows: int) -> None:
        """Take in that decisions of a trial have arrived."""
        self._counts[trial] += n_rows

    def forget(self, trial: int) -> None:
        """Forget a trial that was recorded: a controller started anew may use its number again."""
        del self._counts[trial]

    def pass_over(self, trial: int) -> None:
        """Leave a trial be: it was broken off, and people know; 0 for none."""
        self._passed = trial

    def clear(self) -> None:
        """Forget all trials."""
        self._counts.clear()
        self._passed = 0

    def is_whole(self, status: TrialStatus | None) -> bool:
        """Tell whether a trial runs of which nothing is lost yet."""
        return (is_running(status) and status.trial != self._passed
                and self._counts[status.trial] >= status.decisions)

    def loss(self, status: TrialStatus | None, memory: str = '') -> str:
        """Say, once, that a trial runs that cannot be recorded any more; call it every tick."""
        if not is_running(status) or status.trial == self._passed or (
                self.is_whole(status) and status.memory == memory):
            self._n_short = 0
            return ''
        self._n_short = self._n_short + 1 if status.trial == self._short else 1
        self._short = status.trial
        if self._n_short < _LATE:
            return ''
        self._passed = status.trial
        if external := difference(status.memory, memory):
            return self._external(status.trial, external)
        n = self._counts[status.trial]
        return (f'trial {status.trial} is not recorded: {n} of its {status.decisions} decisions '
                f'arrived here, it began before the learner could hear it')

    def _external(self, trial: int, why: str) -> str:
        """Say, once a kind, that a trial is none of this learner's."""
        told, self._told = self._told, why
        return '' if told == why else f'trial {trial} is not recorded: the controller {why}'

    def missed(
        self, status: TrialStatus, before: TrialStatus | None, phase: Phase, memory: str = '',
    ) -> str:
        """
        Say that a trial has ended that was not recorded, if people do not know it yet.

        Parameters
        ----------
        status : TrialStatus
            Of its end.
        before : TrialStatus or None
            The one before; what was not seen to run may have ended long ago.
        phase : Phase
            What the session was doing meanwhile.
        memory : str
            Whose field is in force.

        """
        if (before is None or not is_running(before) or before.trial != status.trial
                or status.trial == self._passed):
            return ''
        self._passed = status.trial
        if external := difference(status.memory, memory):
            return self._external(status.trial, external)
        why = _BUSY.get(phase, 'the learner runs trials itself')
        return f'trial {status.trial} is not recorded: {why}'


class Intruder:
    """
    Finds the trial that somebody runs while a demonstration is recorded.

    What the robot drives then is not what a person shows. A trial that had ended before the
    demonstration began is none, however late it is heard of.
    """

    def __init__(self) -> None:
        """Start with none."""
        self._since = 0.0
        self._n_ticks = 0

    def begin(self, status: TrialStatus | None, stamp: float, controller: str) -> None:
        """
        Take in that a demonstration is to begin.

        Parameters
        ----------
        status : TrialStatus or None
            Newest word of the controller.
        stamp : float, [s]
            Of the newest odometry.
        controller : str
            Its name.

        Raises
        ------
        SessionError
            If a trial is still running.

        """
        if is_running(status):
            raise SessionError(f'cannot record a demonstration now: trial {status.trial} is still '
                               f'{status.state}, stop it ({controller}/stop_trial)')
        self._since, self._n_ticks = stamp, 0

    def saw(self, status: TrialStatus, before: TrialStatus | None) -> bool:
        """Tell whether a trial has run since the demonstration began, for sure."""
        ran = is_running(status) or (is_running(before) and before.trial == status.trial)
        return ran and status.stamp > self._since

    def lasts(self, status: TrialStatus | None) -> bool:
        """Tell whether a trial goes on, whatever its stamps say; call it every tick."""
        self._n_ticks = self._n_ticks + 1 if is_running(status) else 0
        return self._n_ticks >= _LASTING
