"""How a trial stands: the DiagnosticStatus on `trial`."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from control_field.words import counted, how_it_ended

#: ``name`` of the status.
NAME: Final = 'trial'
#: Of the name of a memory.
_LONGEST: Final = 100


class State(StrEnum):
    """What the controller is doing."""

    IDLE = 'idle'
    RUNNING = 'running'
    PAUSED = 'paused'
    ENDED = 'ended'


class Label(StrEnum):
    """How a person labelled a trial afterwards."""

    NONE = ''
    SUCCESS = 'success'
    FAILURE = 'failure'


_LEVELS: Final = {
    Outcome.GOAL: DiagnosticStatus.OK, Outcome.COLLISION: DiagnosticStatus.ERROR,
    Outcome.GAVE_UP: DiagnosticStatus.WARN, Outcome.STOPPED: DiagnosticStatus.WARN,
    Outcome.ABORTED: DiagnosticStatus.WARN,
}


@dataclass(frozen=True)
class TrialStatus:
    """
    How a trial stands.

    Parameters
    ----------
    state : State
        What the controller is doing.
    trial : int
        Number, counted by the controller from 1; 0 before the first.
    outcome : Outcome or None
        How it ended, when ``state`` is ``ended``; None otherwise.
    reason : str
        One sentence on why it ended, empty for goal; or on what the robot waits for.
    steps, decisions, reinforcements : int
        Counts; ``decisions`` is how many `experience` rows the trial has published.
    revision : int
        Of the field it drives on, -1 without one.
    stamp : float, [s]
        Of the message it answers.
    label : Label
        How a person labelled it.
    stop_reason : StopReason, optional
        The name of the reason.
    memory : str
        Whose field it drives on, see `memory_identity`; empty where nobody says.

    Raises
    ------
    ValueError
        If a count is out of range, or the outcome does not go with the state.

    """

    state: State
    trial: int = 0
    outcome: Outcome | None = None
    reason: str = ''
    steps: int = 0
    decisions: int = 0
    reinforcements: int = 0
    revision: int = -1
    stamp: float = 0.0
    label: Label = Label.NONE
    stop_reason: StopReason | None = None
    memory: str = ''

    def __post_init__(self) -> None:
        """Check the ranges."""
        object.__setattr__(self, 'state', State(self.state))
        object.__setattr__(self, 'label', Label(self.label))
        for name, low in (('trial', 0), ('steps', 0), ('decisions', 0), ('reinforcements', 0),
                          ('revision', -1)):
            if not low <= getattr(self, name) < 2**32:
                raise ValueError(f'trial: {name} is {getattr(self, name)}, must be {low} or more')
        if not (math.isfinite(self.stamp) and self.stamp >= 0.0):
            raise ValueError(f'trial: stamp is {self.stamp}, must be 0 s or more')
        if (self.state is State.ENDED) != (self.outcome is not None):
            raise ValueError(f'trial: state is {self.state} with outcome '
                             f'{self.outcome or "empty"}, must have one only when ended')

    @property
    def sentence(self) -> str:
        """Say it in one sentence for a person."""
        if self.state is State.IDLE:
            return 'no trial is running'
        why = f': {self.reason}' if self.reason else ''
        if self.state is State.RUNNING:
            return f'trial {self.trial} is running, {counted(self.steps, "step")}{why}'
        if self.outcome is None:
            return f'trial {self.trial} is {self.state}, {counted(self.steps, "step")}'
        return f'trial {self.trial} {how_it_ended(self.outcome, self.steps)}{why}'

    @property
    def level(self) -> bytes:
        """Return the level of the DiagnosticStatus."""
        if self.outcome is not None:
            return bytes(_LEVELS[self.outcome])
        level = {State.IDLE: DiagnosticStatus.STALE, State.PAUSED: DiagnosticStatus.WARN}.get(
            self.state, DiagnosticStatus.OK)
        return bytes(level)


def status_from_trial(status: TrialStatus, hardware_id: str = '') -> DiagnosticStatus:
    """Write how a trial stands; ``hardware_id`` names the robot."""
    values = {
        'state': status.state, 'trial': status.trial, 'outcome': status.outcome or '',
        'reason': status.reason, 'steps': status.steps, 'decisions': status.decisions,
        'reinforcements': status.reinforcements, 'revision': status.revision,
        'stamp': repr(float(status.stamp)), 'stop_reason': status.stop_reason or '',
    }
    for name in ('label', 'memory'):
        if getattr(status, name):
            values[name] = getattr(status, name)
    return DiagnosticStatus(
        level=status.level, name=NAME, message=status.sentence, hardware_id=hardware_id,
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


def trial_from_status(msg: Any) -> TrialStatus:
    """
    Read how a trial stands; keys that are not known are passed over.

    Raises
    ------
    ValueError
        If it is another status, or a value is missing, no number, or out of range.

    """
    if msg.name.rpartition('/')[2].rpartition(' ')[2] != NAME:
        raise ValueError(f'trial: name is {msg.name[:80]!r}, must be {NAME!r}')
    values = {pair.key: pair.value for pair in msg.values}
    outcome = _value(values, 'outcome')
    return TrialStatus(
        state=_choice(values, 'state', State), outcome=(
            _choice(values, 'outcome', Outcome) if outcome else None),
        reason=_value(values, 'reason'), stamp=_number(values, 'stamp', float),
        label=_choice({'label': ''} | values, 'label', Label),
        stop_reason=_choice(values, 'stop_reason', StopReason) if values.get(
            'stop_reason') else None,
        memory=values.get('memory', '')[:_LONGEST],
        **{name: _number(values, name, int) for name in (
            'trial', 'steps', 'decisions', 'reinforcements', 'revision')})


def _value(values: Mapping[str, str], key: str) -> str:
    if key not in values:
        raise ValueError(f'trial: value {key} is missing')
    return values[key]


def _number(values: Mapping[str, str], key: str, kind: type[Any]) -> Any:
    text = _value(values, key)
    try:
        return kind(text)
    except (ValueError, OverflowError):
        raise ValueError(f'trial: {key} is {text[:40]!r}, must be a number') from None


def _choice(values: Mapping[str, str], key: str, kind: type[Any]) -> Any:
    text = _value(values, key)
    try:
        return kind(text)
    except ValueError:
        raise ValueError(f'trial: {key} is {text[:40]!r}, must be one of '
                         f'{", ".join(str(member) for member in kind)}') from None
