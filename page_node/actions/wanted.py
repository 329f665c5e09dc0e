"""What a request of the page wants done, checked before anything is."""

from collections.abc import Callable, Mapping
import math
import re
from typing import Any, Final, NamedTuple

from msgs_bridge.teaching.actions import Action
from page_node.refusal import RefusedError

#: Names of actions on the page, and what they are.
ACTIONS: Final[Mapping[str, Action]] = {
    'start': Action.START, 'keep': Action.KEEP, 'redo': Action.REDO, 'cancel': Action.CANCEL,
    'drop_last': Action.DROP_LAST, 'forget': Action.DROP_LAST, 'undo': Action.UNDO,
    'label_success': Action.LABEL_SUCCESS, 'label_failure': Action.LABEL_FAILURE,
    'run_trials': Action.RUN_TRIALS, 'stop': Action.STOP, 'set_back': Action.SET_BACK,
    'teach_here': Action.TEACH_HERE}
#: Changes the speeds of a full push, and is no action of teaching.
SET_SPEEDS: Final = 'set_speeds'
#: Most trials of one request.
_MOST_TRIALS: Final = 1000
#: Farthest place, [m].
_FAR: Final = 1e6
_EPISODE: Final = re.compile(r'[0-9]{4,9}_(demo|trial)')


class Wanted(NamedTuple):
    """An action, and what it is about."""

    name: str
    values: Mapping[str, Any]


def _number(value: Any) -> float | None:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if is_number and math.isfinite(value) and abs(value) <= _FAR else None


def _count(value: Any) -> int | None:
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    return value if is_whole and 1 <= value <= _MOST_TRIALS else None


def _episode(value: Any) -> str | None:
    return value if isinstance(value, str) and _EPISODE.fullmatch(value) else None


#: What an action may be given, and whether it has to be.
_VALUES: Final[Mapping[str, tuple[Mapping[str, Callable[[Any], Any]], bool]]] = {
    'run_trials': ({'n': _count}, False),
    'label_success': ({'episode': _episode}, False),
    'label_failure': ({'episode': _episode}, False),
    'forget': ({'episode': _episode}, True),
    'teach_here': ({'x': _number, 'y': _number}, False),
    SET_SPEEDS: ({'v': _number, 'w': _number}, True)}


def read_wanted(name: str, body: Mapping[str, Any]) -> Wanted:
    """
    Read what is wanted.

    Raises
    ------
    RefusedError
        If there is no such action, or it is given something else than it takes.

    """
    if name not in ACTIONS and name != SET_SPEEDS:
        raise RefusedError('unknown_action', f'there is no action {name[:40]!r}', 404)
    takes, is_needed = _VALUES.get(name, ({}, False))
    if set(body) != set(takes) and (body or is_needed):
        allowed = ', '.join(takes) or 'nothing'
        raise RefusedError('malformed', f'{name} takes {allowed}', 400)
    values = {key: takes[key](value) for key, value in body.items()}
    for key, value in values.items():
        if value is None:
            raise RefusedError('malformed', f'{name}: {key} cannot be that', 400)
    return Wanted(name, values)
