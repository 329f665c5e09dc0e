"""Every parameter of the method, with unit, range and meaning, in one place."""

from collections.abc import Mapping
from dataclasses import dataclass, Field, field, fields
import math
from typing import Any, cast


def parameter(
    default: Any, meaning: str, *, unit: str = '1', low: float = -math.inf, high: float = math.inf,
    choices: tuple[str, ...] = (),
) -> Any:
    """Declare a parameter; the range is closed at both ends."""
    return field(default=default, metadata={
        'meaning': meaning, 'unit': unit, 'low': low, 'high': high, 'choices': choices})


@dataclass(frozen=True)
class Parameters:
    """
    How the robot learns; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names the parameter, the
        value and the range.

    """

    profile: str = parameter(
        'full', 'paper: equations 1 to 7 to the letter; full: with what keeps their promise',
        choices=('paper', 'full'))
    power: float = parameter(
        2.0, 'power p of the distance in equations 3 and 7', low=0.5, high=16.0)
    effective_window: float = parameter(
        6.0, 'radius of the effective window', unit='cells', low=1.0, high=1000.0)
    weight_floor: float = parameter(
        0.05, 'weight of the prototype with the least Q-value; that with the greatest has 1',
        low=1e-6, high=1.0)
    learning_rate: float = parameter(
        0.5, 'alpha of equation 6', low=0.0, high=1.0)
    discount: float = parameter(
        0.98, 'lambda of equation 6', low=0.0, high=1.0)
    oscillation_limit: int = parameter(
        4, 'times an action is chosen in one cell of a trial before exploration takes over',
        unit='times', low=1, high=1000)
    step_limit: int = parameter(
        2000, 'steps after which a trial is given up', unit='steps', low=1, high=10_000_000)
    seed: int = parameter(
        0, 'seed of everything random', low=0, high=2**63 - 1)
    corner_cutting: bool = parameter(
        False, 'whether a diagonal step may pass a blocked cell beside it (a point robot)')
    unknown_is_blocked: bool = parameter(
        False, 'whether the robot keeps out of cells while its local grid calls them unknown')
    moves: int = parameter(
        8, 'steps allowed: 8 neighbours, or 4 without the diagonals', low=4, high=8)
    pull: bool = parameter(
        True, 'full profile: pull towards the shortest known way (without rehearsal: the nearest '
        'demonstrated or learnt path)')
    visible_windows: bool = parameter(
        True, 'full profile: effective windows do not reach through known walls')
    rehearsal: bool = parameter(
        True, 'full profile: experience replay over the remembered map between trials')
    repair: bool = parameter(
        True, 'full profile, with rehearsal: prototypes that mend cells whose flow ends in a wall '
        'or a loop')
    pruning: bool = parameter(
        True, 'full profile: drop prototypes without which no course is worse')
    demonstration_advantage: float = parameter(
        0.4, 'full profile: share of its length that a demonstrated step is spared in rehearsal; '
        '0: a teacher counts no more than a trial, and shorter ways are taken',
        low=0.0, high=0.99)
    practice_advantage: float = parameter(
        0.3, 'full profile: share of its length that a step of a successful trial is spared',
        low=0.0, high=0.99)
    caution: float = parameter(
        0.2, 'full profile: how much longer rehearsal takes unseen ground to be', low=0.0,
        high=10.0)
    curiosity: float = parameter(
        0.9, 'full profile: how much shorter ground full of unseen cells counts in trials from '
        'chosen starts', low=0.0, high=0.99)
    map_memory: int = parameter(
        20, 'how long a wall that is not seen any more is certain; then it is doubted, and one '
        'seen less often is doubted sooner; 0: walls are never doubted', unit='episodes', low=0,
        high=1_000_000)
    prefer_shorter: bool = parameter(
        False, 'full profile: whether the shortest known way is taken whatever was shown, and '
        'looked for in trials from fixed starts too')

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        if self.moves not in (4, 8):
            raise ValueError(f'moves is {self.moves}, must be 4 or 8')
        # Rehearsal takes the logarithm of Q-values to the base of the discount.
        if self.profile == 'full' and self.rehearsal and not 0.5 <= self.discount <= 0.9999:
            raise ValueError(f'discount is {self.discount}, must be between 0.5 and 0.9999 '
                             f'for rehearsal in profile full')

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> 'Parameters':
        """
        Build from names and values; what is not named keeps its default.

        Raises
        ------
        ValueError
            If a name is unknown or a value out of range.

        """
        known = {spec.name for spec in fields(cls)}
        for name in values:
            if name not in known:
                raise ValueError(f'{name} is no parameter; there are: {", ".join(sorted(known))}')
        return cls(**values)


def check_fields(record: Any) -> None:
    """
    Check every value of a dataclass whose fields are declared with `parameter`.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names the parameter, the
        value and the range.

    """
    for spec in fields(record):
        check_value(spec, getattr(record, spec.name))


def check_value(spec: 'Field[Any]', value: Any) -> None:
    """Check one value against the declaration of its field; ValueError as in `check_fields`."""
    name, kind, metadata = spec.name, cast(Any, spec.type), spec.metadata
    kind = {'str': str, 'float': float, 'int': int, 'bool': bool}.get(kind, kind)
    fits = isinstance(value, kind) or (kind is float and isinstance(value, int))
    if not fits or (isinstance(value, bool) and kind is not bool):
        raise ValueError(f'{name} is {value!r}, must be of type {kind.__name__}')
    if metadata['choices'] and value not in metadata['choices']:
        raise ValueError(f'{name} is {value!r}, must be one of {", ".join(metadata["choices"])}')
    if kind in (float, int):
        low, high = metadata['low'], metadata['high']
        if not low <= value <= high:
            unit = '' if metadata['unit'] == '1' else f' [{metadata["unit"]}]'
            raise ValueError(f'{name} is {value}, must be between {low} and {high}{unit}')
