"""One line that says how teaching stands, never wider than the terminal."""

from collections.abc import Mapping
import math
from typing import Final

from control_field.words import counted
from msgs_bridge.teaching.status import Status
from msgs_bridge.untrusted.text import printable

_DOING: Final[Mapping[str, str]] = {
    '': 'no learner', 'idle': 'ready', 'demonstration': 'RECORDING', 'settling': 'keeping',
    'learning': 'learning', 'waiting': 'waiting', 'placing': 'setting back',
    'starting': 'starting', 'trial': 'trying', 'finishing': 'trying'}
_SEPARATOR: Final = ' | '


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
