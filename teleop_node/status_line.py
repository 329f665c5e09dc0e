"""One line that says how teaching stands, never wider than the terminal."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Final

from control_field.robot.limits import Velocity
from control_field.words import counted
from msgs_bridge.untrusted.text import printable

_DOING: Final[Mapping[str, str]] = {
    '': 'no learner', 'idle': 'ready', 'demonstration': 'RECORDING', 'settling': 'keeping',
    'learning': 'learning', 'waiting': 'waiting', 'placing': 'setting back',
    'starting': 'starting', 'trial': 'trying', 'finishing': 'trying'}
_SEPARATOR: Final = ' | '


@dataclass(frozen=True)
class Status:
    """
    What the line says.

    Parameters
    ----------
    phase : str
        Of the learner; empty where there is none.
    seconds : float, [s]
        How long a demonstration has been recorded.
    trials_left : int
        Trials that are still to be run.
    trial : int
        Number of the last trial, 0 before the first.
    trial_state : str
        ``running``, ``paused`` or ``ended``.
    outcome : str
        How it ended.
    reason : str
        Why it was paused or stopped.
    steps : int
        Of that trial.
    prototypes : int
        Of the field in force, -1 without one.
    basin, fidelity : float, 0 to 1
        Of its certificate, NaN without one.
    speeds : tuple of float, [m/s] and [rad/s]
        Of the keys.
    problem : str
        What a person has to mend before the robot moves.
    held : str
        Why the collision monitor lets it stand that is told to drive.
    bag : str
        In which the last trial is recorded; empty where that is not known.

    """

    phase: str = ''
    seconds: float = 0.0
    trials_left: int = 0
    trial: int = 0
    trial_state: str = ''
    outcome: str = ''
    reason: str = ''
    steps: int = 0
    prototypes: int = -1
    basin: float = math.nan
    fidelity: float = math.nan
    speeds: Velocity = (0.0, 0.0)
    problem: str = ''
    held: str = ''
    bag: str = ''


def line_from_status(status: Status, width: int) -> str:
    """
    Write the line.

    Parameters
    ----------
    status : Status
        What it says, in the order of importance: what does not fit is left out from the end.
    width : int
        Columns it may take; the last of the terminal is better left empty.

    Returns
    -------
    str
        At most ``width`` characters.

    """
    parts = [part for part in (
        status.problem, status.held and f'HELD: {status.held}', _doing(status), _trial(status),
        _field(status),
        f'{status.speeds[0]:.2f} m/s {status.speeds[1]:.1f} rad/s') if part]
    while len(parts) > 1 and len(_SEPARATOR.join(parts)) > width:
        del parts[-1]
    return _SEPARATOR.join(parts)[:max(width, 0)]


def _doing(status: Status) -> str:
    text = _DOING.get(status.phase, status.phase)
    if status.phase == 'demonstration':
        text += f' {status.seconds:.0f} s'
    left = status.trials_left
    return text + (f', {left} trial{"s" if left > 1 else ""} left' if left else '')


def _trial(status: Status) -> str:
    if not status.trial:
        return 'no trial yet'
    how = status.outcome or status.trial_state
    if status.trial_state == 'paused' and status.reason:
        how += f' ({status.reason})'
    bag = f' ({status.bag})' if status.bag else ''
    return f'trial {status.trial} {how}, {counted(status.steps, "step")}{bag}'


def _field(status: Status) -> str:
    if status.prototypes < 0:
        return 'nothing learnt yet'
    if math.isfinite(status.basin):
        return f'goal reached from {share(status.basin)} of the places seen'
    return ''


def share(value: float) -> str:
    """Write a share in percent; what is not all of it is never rounded up to 100 %."""
    return f'{math.floor(100.0 * value + 1e-9)} %'


def line_over(text: str) -> str:
    """Return what writes a line over the one under the cursor."""
    return f'\r{printable(text)}\x1b[K'


def message_over(text: str) -> str:
    """Return what writes a message that stays, over the line under the cursor."""
    return f'\r{printable(text)}\x1b[K\n'
