"""How a session gets from one phase to the next, and what it remembers on the way."""

from collections.abc import Callable
import math

from control_field.poses import StartPose
from learner_node.absence import Absence
from learner_node.attendance import Attendance
from learner_node.decision_counter import DecisionCounter, Intruder, is_running
from learner_node.effects import Abandon, Close, Discard, Effect, Effects, Place, Say, StopTrial
from learner_node.phases import (
    Arrival, ASLEEP, IN_TRIAL, obstacle, Peers, Phase, RECORDING, remedy, RETRY, SessionError,
    WORDS)
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import TrialStatus
from msgs_bridge.node.node_info import Operation


class Transitions:
    """
    The state of a session, and the steps that more than one thing that happens leads to.

    Parameters
    ----------
    settings : Settings
    next_start : callable
        Returns where the next trial starts.

    """

    def __init__(self, settings: Settings, next_start: Callable[[], StartPose]) -> None:
        """Start idle, without a field."""
        self.settings = settings
        self.phase = Phase.IDLE
        self.n_left = 0
        #: Whether a person has stopped the trials: none begins by itself then.
        self.is_stopped = False
        self.revision = -1
        #: Whose field is in force, see `memory_identity`.
        self.memory = ''
        self.trial = 0
        #: Returns why something must not be done now, such as what does not fit in the suite.
        self.why_not: Callable[[Operation], str] = lambda operation: ''
        self._next_start = next_start
        self._start = StartPose(0.0, 0.0)
        self._peers = Peers()
        self._status: TrialStatus | None = None
        self._decision_counter, self._intruder = DecisionCounter(), Intruder()
        self._arrival = Arrival()
        self._began = self._heard = self._moved = self._asked = -math.inf
        self._absence, self._attendance = Absence(), Attendance()
        self._n_asked = self._n_silent = 0
        self._stamp = 0.0
        self._told = self._lost = self._refusal = ''
        self._looked = self._woke = -math.inf
        self._slept = 0.0

    def _look_at_clock(self, now: float) -> None:
        """Take in the time; what this process itself slept through was nobody's silence."""
        slept, self._looked = now - self._looked, now
        if not ASLEEP < slept < math.inf:
            return
        self._slept, self._woke = slept, now
        self._attendance.slept(slept, now)
        self._began, self._heard, self._moved, self._asked = (
            min(since + slept, now)
            for since in (self._began, self._heard, self._moved, self._asked))

    @property
    def is_recording(self) -> bool:
        """Tell whether what arrives belongs into the open bag."""
        return self.phase in RECORDING

    @property
    def controller_status(self) -> TrialStatus | None:
        """Return the newest word of the controller; None where it is not there."""
        return self._status

    def describe(self) -> str:
        """Say in a few words what is under way."""
        if self.phase is Phase.WAITING:
            return f'waiting: {self._obstacle() or "all is there"}'
        return WORDS.get(self.phase, f'trial {self.trial} is under way')

    def _check_idle(self, what: str, operation: Operation) -> None:
        if self.phase is not Phase.IDLE:
            raise SessionError(f'cannot {what} now: {self.describe()}{remedy(self.phase)}')
        if why := self.why_not(operation):
            raise SessionError(f'cannot {what}: {why}')

    def _end_series(self) -> None:
        self.n_left, self.is_stopped = 0, True

    def _go(self, phase: Phase, now: float) -> None:
        self.phase, self._began = phase, now

    def _ask(self, request: Effect, now: float) -> Effects:
        self._asked, self._n_silent = now, 0
        self._n_asked += 1
        return [request]

    def _proceed(self, now: float) -> Effects:
        """Set the robot back for the next trial when everything is there for it."""
        if self.phase is not Phase.WAITING:
            return []
        missing = self._obstacle()
        if missing:
            return self._wait(missing, now)
        self._start = self._next_start()
        self._n_asked, self._told = 0, ''
        self._arrival.leave()
        self._go(Phase.PLACING, now)
        return self._ask(Place(self._start), now)

    def _wait(self, missing: str, now: float) -> Effects:
        effects: Effects = []
        if is_running(self._status) and now - self._asked > RETRY:
            effects += self._ask(StopTrial(), now)
        if missing != self._told and now - self._began > self.settings.peer_timeout:
            self._told = missing
            effects.append(Say(f'the next trial waits: {missing}', warns=True))
        return effects

    def _obstacle(self) -> str:
        return self.why_not(Operation.DRIVE) or obstacle(
            self._peers, self._status, self.revision, self.settings.controller, self.memory)

    def _learn(self, now: float) -> Effects:
        self._go(Phase.LEARNING, now)
        return [Close()]

    def _break_off(self, reason: str, now: float, told: bool = False) -> Effects:
        """End the trial as aborted; nothing is learnt from it, and it is tried again."""
        trial = f'trial {self.trial}' if self.trial else 'the trial to come'
        effects: Effects = [Say(f'{trial} is broken off: {reason}', warns=True)]
        if self.phase is Phase.STARTING:
            effects.append(Discard())
        elif self.phase in IN_TRIAL:
            effects.append(Abandon('' if told else reason, self.trial))
        # A request to a controller that runs nothing could come late and stop the trial after it.
        if self.phase in IN_TRIAL and self._peers.controller and is_running(self._status):
            effects.append(StopTrial())
        # A controller that is gone may use the number again.
        self._decision_counter.clear()
        self._decision_counter.pass_over(self.trial if is_running(self._status) else 0)
        self.trial = 0
        self._asked = now
        self._go(Phase.WAITING if self.n_left else Phase.IDLE, now)
        return effects
