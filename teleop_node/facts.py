"""What is known of learner and trial, gathered from their messages for the status line."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
import math
from typing import Any, Final

from control_field.robot.limits import Velocity
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.node.command_types import remedy
from teleop_node.status_line import Facts

#: Time without a word from the learner after which there is none, [s]; it speaks every second.
SILENCE = 5.0
#: Phases in which the learner records what is driven as a person's.
_RECORDING: Final = ('demonstration', 'settling')
#: Phases in which it runs trials by itself, or records one that a person has started.
_SERIES: Final = ('waiting', 'placing', 'starting', 'trial', 'finishing')


class Gathered:
    """
    The facts, as they come.

    Parameters
    ----------
    learner, controller : str
        Full names of the nodes.

    """

    def __init__(self, learner: str, controller: str) -> None:
        """Start with nothing known."""
        self._learner = f'{learner.lstrip("/")}: learner'
        self._controller = f'{controller.lstrip("/")}: controller'
        self._facts = Facts()
        self._heard = self._told = self._began = -math.inf
        self._bag = 0, ''
        #: Where trials start, (x, y, yaw), and where to teach next, (x, y), [m, rad].
        self.start: tuple[float, ...] = ()
        self.teach_here: list[tuple[float, ...]] = []

    def saw_trial(self, status: TrialStatus) -> None:
        """Take in how the trial stands; how the last one ended stays, until there is another."""
        if status.state is State.IDLE and status.trial == self._facts.trial:
            self._facts = replace(self._facts, trial_state=str(status.state))
            return
        self._facts = replace(
            self._facts, trial=status.trial, trial_state=str(status.state), steps=status.steps,
            outcome=str(status.outcome or ''), reason=status.reason)

    @property
    def is_trying(self) -> bool:
        """Tell whether a trial runs."""
        return self._facts.trial_state in (State.RUNNING, State.PAUSED)

    def has_series(self, now: float) -> bool:
        """Tell whether the learner runs trials by itself, as far as is known."""
        return now - self._heard <= SILENCE and (
            self._facts.phase in _SERIES or self._facts.trials_left > 0)

    def saw_series(self, now: float) -> None:
        """Take in that trials are going to be run; the learner tells it later."""
        self._saw_phase(_SERIES[0], now)

    def saw_end_of_series(self) -> None:
        """Take in that no more trials are run; the learner tells it later."""
        self._facts = replace(
            self._facts, trials_left=0,
            phase='idle' if self._facts.phase in _SERIES else self._facts.phase)

    def is_recording(self, now: float) -> bool:
        """Tell whether the learner records a demonstration, as far as is known."""
        return self._facts.phase in _RECORDING and now - self._heard <= SILENCE

    def saw_answer(self, on: bool | None, success: bool, now: float) -> None:
        """Take in what came of a request to record, or to keep; the learner tells it later."""
        if on and success:
            self._saw_phase('demonstration', now)
        elif on is False and self._facts.phase in _RECORDING:
            self._saw_phase('idle', now)

    def saw_diagnostics(self, array: Any, now: float) -> None:
        """Take in what nodes say about themselves; others than these two are passed over."""
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == self._learner:
                self._saw_learner(values, now)
            elif status.name == self._controller:
                self._told = now
                self._facts = replace(self._facts, held=values.get('held', ''))

    def _saw_learner(self, values: Mapping[str, str], now: float) -> None:
        self._saw_phase(values.get('phase', ''), now)
        self._bag = int(_number(values, 'trial', 0.0)), values.get('bag', '')
        self.start = _place(values.get('start', ''), 3)
        places = (_place(text, 2) for text in values.get('teach_here', '').split(';'))
        self.teach_here = [place for place in places if place]
        self._facts = replace(
            self._facts, trials_left=int(_number(values, 'trials_left', 0.0)),
            prototypes=int(_number(values, 'prototypes', -1.0)),
            basin=_number(values, 'basin', math.nan),
            fidelity=_number(values, 'fidelity', math.nan))

    def _saw_phase(self, phase: str, now: float) -> None:
        if phase == 'demonstration' != self._facts.phase:
            self._began = now
        self._heard = now
        self._facts = replace(self._facts, phase=phase)

    def at(self, now: float, speeds: Velocity, problem: str) -> Facts:
        """Return the facts at a time."""
        facts = replace(self._facts, speeds=speeds, problem=problem, seconds=(
            now - self._began if self._facts.phase == 'demonstration' else 0.0))
        trial, bag = self._bag
        if trial == facts.trial:
            facts = replace(facts, bag=bag)
        if now - self._told > SILENCE:
            facts = replace(facts, held='')
        return replace(facts, phase='') if now - self._heard > SILENCE else facts


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
