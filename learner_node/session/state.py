"""What all parts of a session share: its phase, the field that was published, what was heard."""

from collections.abc import Callable
import math
from typing import Final

from learner_node.session.inputs import Inputs, is_running
from learner_node.session.phases import (
    CODES, Phase, RECORDING, remedy, SessionError, TRANSITIONS, WORDS)
from learner_node.session.unheard_stop import UnheardStop
from learner_node.settings import Settings
from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.trial_status import TrialStatus
from msgs_bridge.node.node_info import Operation

#: Longest wait for the last messages of a drive, [s]: a real robot is never quiet.
_SETTLING_TIME: Final = 0.3
#: Longest time that what had arrived by then may take to be read and recorded, [s].
_CATCHING_UP_TIME: Final = 10.0
#: Sleep of this process after which others may have forgotten it, [s]; 18 by default (ADR 23).
_FORGOTTEN: Final = 3.0


class SessionState:
    """
    The state of a session; its phase changes by `go` alone.

    Parameters
    ----------
    settings : Settings

    """

    def __init__(self, settings: Settings) -> None:
        """Start idle, without a field."""
        self.settings = settings
        self.phase = Phase.IDLE
        self.since = -math.inf  #: when the phase began, [s]
        #: Number of the trial that is recorded, by the controller's count; 0 for none.
        self.trial = 0
        #: Of the field that was published; -1 before the first.
        self.revision = -1
        #: Whose field that is, see `memory_identity`.
        self.memory = ''
        self.inputs = Inputs()
        self.unheard_stop = UnheardStop()
        #: Returns True once what had arrived by a time, [s], is recorded and was handed on.
        self.has_heard_all: Callable[[float], bool] = lambda since: True
        #: Returns why something must not be done now, such as what does not fit in the suite.
        self.why_not: Callable[[Operation], str] = lambda operation: ''

    def go(self, phase: Phase, now: float) -> None:
        """Enter a phase that may follow the present one, see `TRANSITIONS`."""
        assert phase is Phase.IDLE or phase in TRANSITIONS[self.phase], (self.phase, phase)
        self.phase, self.since = phase, now

    def on_suspended(self, seconds: float, now: float) -> None:
        """Count the time during which this process was suspended out of what is waited for."""
        self.since = min(self.since + seconds, now)
        self.inputs.on_suspended(seconds, now)
        self.unheard_stop.on_suspended(seconds, now)

    @property
    def is_recording(self) -> bool:
        """Whether what arrives belongs into the open bag."""
        return self.phase in RECORDING

    def may_settle(self, now: float) -> bool:
        """Return True while the last messages may yet come; a lock-step is ahead of its bag."""
        return now - self.since < _SETTLING_TIME * (10 if self.settings.lockstep else 1)

    def is_catching_up(self, now: float) -> bool:
        """Return True while messages wait that arrived before the phase began."""
        return now - self.since < _CATCHING_UP_TIME and not self.has_heard_all(self.since)

    def misfit(self, status: TrialStatus) -> str:
        """Say whose field the controller has, if it is not the published one; empty if it is."""
        return difference(status.memory, self.memory)

    def obstacle(self) -> str:
        """Say what keeps the next trial from being started; empty if nothing does."""
        if why := self.why_not(Operation.DRIVE):
            return why
        peers, status = self.inputs.peers, self.inputs.status
        if not peers.controller or status is None:
            return f'{self.settings.controller} is not there{self._sleep()}'
        if not peers.robot:
            return 'no robot publishes odometry'
        if is_running(status):
            return self.unheard_stop.problem or f'trial {status.trial} is still running'
        misfit = self.misfit(status)
        if status.revision != self.revision and not (misfit and status.memory):
            return f'the controller has field revision {status.revision}, not {self.revision}'
        return f'the controller {misfit}' if misfit else ''

    def _sleep(self) -> str:
        """Say that this process slept long enough for others not to be found again."""
        slept = self.inputs.slept
        return '' if slept < _FORGOTTEN else (
            f', or has not been found again since the learner was suspended for {slept:.0f} s: if '
            f'it runs, start learner_node anew, which loses nothing that was learnt')

    def describe(self) -> str:
        """Say in a few words what is under way."""
        if self.phase is Phase.WAITING:
            return f'waiting: {self.obstacle() or "all is there"}'
        return WORDS.get(self.phase, f'trial {self.trial} is under way')

    def check_idle(self, what: str, operation: Operation) -> None:
        """
        Check that something new may begin.

        Raises
        ------
        SessionError
            If something else is under way, or it must not be done now.

        """
        if self.phase is not Phase.IDLE:
            raise SessionError(f'cannot {what} now: {self.describe()}{remedy(self.phase)}',
                               CODES[self.phase])
        if why := self.why_not(operation):
            raise SessionError(f'cannot {what}: {why}', 'conflict')
