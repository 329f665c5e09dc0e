"""What is known of learner and trial, from their messages and answers."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
import math
from typing import Any, Final

from control_field.robot.limits import Velocity
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.node.command_types import remedy
from msgs_bridge.teaching.status import Status

#: Time without a word from the learner after which there is none, [s]; it speaks every second.
SILENCE = 5.0
#: Phases in which the learner records what is driven as a person's.
_RECORDING: Final = ('demonstration', 'settling')
#: Phases in which it runs trials by itself, or records one that a person has started.
_SERIES: Final = ('waiting', 'placing', 'starting', 'trial', 'finishing')


class StatusTracker:
    """
    Keeps the status of learner and trial, as their messages come.

    Parameters
    ----------
    learner, controller : str
        Full names of the nodes.

    """

    def __init__(self, learner: str, controller: str) -> None:
        """Start with nothing known."""
        self._learner = f'{learner.lstrip("/")}: learner'
        self._controller = f'{controller.lstrip("/")}: controller'
        self._status = Status()
        self._learner_seen = self._controller_seen = self._began = -math.inf
        self._bag = 0, ''
        self.problem = ''  #: what a person has to mend before the robot moves
        #: Where trials start, (x, y, yaw), and where to teach next, (x, y), [m, rad].
        self.start: tuple[float, ...] = ()
        self.teach_here: list[tuple[float, ...]] = []
        self.learner_values: Mapping[str, str] = {}  #: all that the learner says of itself

    def on_trial(self, trial: TrialStatus) -> None:
        """Note how the trial stands; how the last one ended stays, until there is another."""
        if trial.state is State.IDLE and trial.trial == self._status.trial:
            self._status = replace(self._status, trial_state=str(trial.state))
            return
        self._status = replace(
            self._status, trial=trial.trial, trial_state=str(trial.state), steps=trial.steps,
            outcome=str(trial.outcome or ''), reason=trial.reason)

    @property
    def is_trying(self) -> bool:
        """Whether a trial runs."""
        return self._status.trial_state in (State.RUNNING, State.PAUSED)

    def has_series(self, now: float) -> bool:
        """Return True if the learner runs trials by itself, as far as is known."""
        return self.has_learner(now) and (
            self._status.phase in _SERIES or self._status.trials_left > 0)

    def is_recording(self, now: float) -> bool:
        """Return True if the learner records a demonstration, as far as is known."""
        return self._status.phase in _RECORDING and self.has_learner(now)

    def has_learner(self, now: float) -> bool:
        """Return True if the learner was heard lately."""
        return now - self._learner_seen <= SILENCE

    def has_controller(self, now: float) -> bool:
        """Return True if the controller was heard lately."""
        return now - self._controller_seen <= SILENCE

    def on_answer(self, service: str, on: bool | None, success: bool, now: float) -> None:
        """
        Note what came of a request; the learner tells it later.

        Parameters
        ----------
        service : str
            Such as ``run_trials``.
        on : bool or None
            What `record_demonstration` was asked for.
        success : bool
        now : float, [s]

        """
        if on and success:
            self._on_phase('demonstration', now)
        elif (on is False or service == 'discard_demonstration') and (
                self._status.phase in _RECORDING):
            self._on_phase('idle', now)
        elif service == 'run_trials' and success:
            self._on_phase(_SERIES[0], now)
        elif service == 'stop_trials' and success:
            phase = 'idle' if self._status.phase in _SERIES else self._status.phase
            self._status = replace(self._status, trials_left=0, phase=phase)

    def on_diagnostics(self, array: Any, now: float) -> None:
        """Note what nodes say about themselves; others than these two are passed over."""
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == self._learner:
                self._on_learner(values, now)
            elif status.name == self._controller:
                self._controller_seen = now
                self._status = replace(self._status, held=values.get('held', ''))

    def _on_learner(self, values: Mapping[str, str], now: float) -> None:
        self._on_phase(values.get('phase', ''), now)
        self.learner_values = values
        self._bag = int(_number(values, 'trial', 0.0)), values.get('bag', '')
        self.start = _place(values.get('start', ''), 3)
        places = (_place(text, 2) for text in values.get('teach_here', '').split(';'))
        self.teach_here = [place for place in places if place]
        self._status = replace(
            self._status, trials_left=int(_number(values, 'trials_left', 0.0)),
            prototypes=int(_number(values, 'prototypes', -1.0)),
            basin=_number(values, 'basin', math.nan),
            fidelity=_number(values, 'fidelity', math.nan))

    def _on_phase(self, phase: str, now: float) -> None:
        if phase == 'demonstration' != self._status.phase:
            self._began = now
        self._learner_seen = now
        self._status = replace(self._status, phase=phase)

    def at(self, now: float, speeds: Velocity) -> Status:
        """Return the status at a time."""
        status = replace(self._status, speeds=speeds, problem=self.problem, seconds=(
            now - self._began if self._status.phase == 'demonstration' else 0.0))
        trial, bag = self._bag
        if trial == status.trial:
            status = replace(status, bag=bag)
        if not self.has_controller(now):
            status = replace(status, held='')
        return status if self.has_learner(now) else replace(status, phase='')


def _number(values: Mapping[str, str], key: str, missing: float) -> float:
    """Return a value as a number that can be written in a line, or what stands for none."""
    try:
        number = float(values[key])
    except (KeyError, ValueError):
        return missing
    return number if abs(number) < 1e9 else missing


def _place(text: str, n: int) -> tuple[float, ...]:
    """Return so many finite numbers of a text, none where it has others."""
    try:
        numbers = tuple(map(float, text.split()))
    except ValueError:
        return ()
    return numbers if len(numbers) == n and all(map(math.isfinite, numbers)) else ()


def problem_with_readers(topic: str, mine: str, readers: Iterable[Any]) -> tuple[str, str]:
    """
    Say what is wrong with who reads the commands.

    Parameters
    ----------
    topic : str
        Where commands go.
    mine : str
        Type they have, ``geometry_msgs/msg/Twist`` or ``.../TwistStamped``.
    readers : iterable of TopicEndpointInfo
        Who is on the topic.

    Returns
    -------
    problem : str
        A few words for the status line, empty if all is well.
    sentence : str
        The whole of it where there is more to say.

    """
    readers = list(readers)
    if not readers:
        return f'nobody listens on {topic}', ''
    others = [peer for peer in readers if peer.topic_type != mine]
    if not others:
        return '', ''
    return f'wrong type: {remedy(mine)}', (
        f'{others[0].node_name} reads {topic} as {others[0].topic_type} but this node publishes '
        f'{mine}: {remedy(mine)}')
