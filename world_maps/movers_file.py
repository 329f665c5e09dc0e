"""What moves and what changes in a world, from a YAML file beside its map."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE
from msgs_bridge.untrusted.yaml_texts import yaml_from_text
from world_maps.changes import cells_within, Change
from world_maps.errors import read_bytes, WorldError
from world_maps.mover import Mover, tracks, Waypoint
from world_maps.world import config_file, load_pixels, World

_LIMIT: Final = 256 * 1024
_MOST: Final = 1000
_MOVER_KEYS: Final = ('name', 'radius', 'speed', 'waypoints', 'mode', 'start', 'comes_every',
                      'patience')
_WHEN: Final = ('at_trial', 'at_time')
_WHAT: Final = ('close', 'open', 'map')
_MOST_TRIAL, _MOST_SECONDS = 1_000_000, 1e9
_REACH: Final = 1e7

_T = TypeVar('_T')


@dataclass(frozen=True, eq=False)
class Script:
    """
    What happens in a world by itself.

    Parameters
    ----------
    movers : tuple of Mover
    changes : tuple of Change

    """

    movers: tuple[Mover, ...] = ()
    changes: tuple[Change, ...] = ()


def load_movers(path: str | Path, world: World) -> Script:
    """
    Read the keys ``movers`` and ``changes`` of a YAML file; ``doc/maps.md`` describes them.

    Parameters
    ----------
    path : str or Path
    world : World
        In which all this happens.

    Raises
    ------
    WorldError
        If it is missing, malformed or does not fit the world; one line that names the file, the
        entry, the key, its value and what to do.

    """
    path = Path(path)
    fields = _fields(path)
    script = Script(_entries(path, fields, 'movers', _mover),
                    _entries(path, fields, 'changes', lambda entry: _change(entry, path, world)))
    try:
        tracks(script.movers, world, 0)
    except ValueError as error:
        raise WorldError(path, f'{error} in the world {world.name}') from error
    return script


def find_movers(name: str) -> Path:
    """
    Return the file that is given by path, or by bare name from ``config/movers``.

    Raises
    ------
    WorldError
        If there is none of that bare name; the message lists those that there are.

    """
    return config_file(name, 'movers', ('.yaml', '.yml'))


def _fields(path: Path) -> Mapping[str, Any]:
    try:
        fields = yaml_from_text(read_bytes(path, _LIMIT), as_written=True)
    except WorldError:
        raise
    except ValueError as error:
        raise WorldError(path, f'{error}, see doc/maps.md') from error
    if not isinstance(fields, dict) or not fields.keys() <= {'movers', 'changes'} or not fields:
        raise WorldError(path, 'must have the keys movers and changes, or one of the two, and no '
                               'other: see doc/maps.md')
    return fields


def _entries(
    path: Path, fields: Mapping[str, Any], name: str, read: Callable[[dict[str, Any]], _T],
) -> tuple[_T, ...]:
    """Read every entry of a list; what is wrong with one is said with its number."""
    entries = fields.get(name, [])
    if not isinstance(entries, list) or len(entries) > _MOST:
        raise WorldError(path, f'{name} must be a list of at most {_MOST} entries, each begun by '
                               f'a dash')
    found = []
    for number, entry in enumerate(entries, start=1):
        try:
            if not isinstance(entry, dict):
                raise ValueError(f'is {str(entry)[:40]!r}, must have keys and values')
            found.append(read(entry))
        except WorldError:
            raise
        except ValueError as error:
            raise WorldError(path, f'entry {number} of {name}: {error}') from error
    return tuple(found)


def _mover(entry: dict[str, Any]) -> Mover:
    _check_keys(entry, _MOVER_KEYS)
    if 'radius' not in entry:
        raise ValueError('radius is missing, say how large it is in metres')
    values: dict[str, Any] = {
        key: _number(key, entry[key]) for key in ('radius', 'speed', 'start', 'comes_every',
                                                  'patience') if key in entry}
    values |= {key: str(entry[key]) for key in ('name', 'mode') if key in entry}
    waypoints = entry.get('waypoints', [])
    if not isinstance(waypoints, list) or len(waypoints) > _MOST:
        raise ValueError(f'waypoints must be a list of at most {_MOST} points [x, y]')
    return Mover(waypoints=tuple(_waypoint(point) for point in waypoints), **values)


def _waypoint(point: Any) -> Waypoint:
    if not isinstance(point, list) or len(point) not in (2, 3):
        raise ValueError(f'waypoints has {str(point)[:40]!r}, must be [x, y] in metres, or '
                         f'[x, y, seconds] where it waits')
    return Waypoint(*(_number('waypoints', value) for value in point))


def _change(entry: dict[str, Any], path: Path, world: World) -> Change:
    _check_keys(entry, (*_WHEN, *_WHAT))
    when, what = _one_of(entry, _WHEN), _one_of(entry, _WHAT)
    change = _other_map(entry['map'], path, world) if what == 'map' else _rectangle(
        what, entry[what], world)
    if when == 'at_time':
        seconds = _number('at_time', entry['at_time'], 0.0, _MOST_SECONDS)
        return Change(*change[:2], at_time=seconds, name=change[2])
    trial = _number('at_trial', entry['at_trial'], 1, _MOST_TRIAL)
    if trial != int(trial):
        raise ValueError(f'at_trial is {trial:g}, must be a whole number')
    return Change(*change[:2], at_trial=int(trial), name=change[2])


def _rectangle(what: str, corners: Any, world: World) -> tuple[Any, Any, str]:
    if not isinstance(corners, list) or len(corners) != 4:
        raise ValueError(f'{what} is {str(corners)[:40]!r}, must be two corners [x, y, x, y] in '
                         f'metres')
    x, y, other_x, other_y = (_number(what, value, -_REACH, _REACH) for value in corners)
    grid = world.pixels.grid
    cells = cells_within(grid, (min(x, other_x), min(y, other_y)),
                         (max(x, other_x), max(y, other_y)))
    if not cells.any():
        squares = 'cell' if world.drawn is None else 'pixel'
        raise ValueError(f'{what}: no {squares} of the world {world.name} has its centre in the '
                         f'rectangle from ({x:g}, {y:g}) to ({other_x:g}, {other_y:g}) m, make it '
                         f'larger')
    state = BLOCKED if what == 'close' else FREE
    verb = 'closes' if what == 'close' else 'opens'
    return (cells, np.full(grid.shape, state, dtype=np.int8),
            f'({x:g}, {y:g}) to ({other_x:g}, {other_y:g}) m {verb}')


def _other_map(name: Any, path: Path, world: World) -> tuple[Any, Any, str]:
    if not isinstance(name, str) or not name or '\0' in name:
        raise ValueError('map must be the name of a map file, seen from this file')
    here = world.pixels.grid
    other, _ = load_pixels(path.parent / name, here.frame_id, here.resolution)
    if other.grid != here:
        raise ValueError(f'map {name} is of {_size(other.grid)}, must be as large as the world '
                         f'{world.name}, {_size(here)}')
    return np.ones(here.shape, dtype=bool), other.occupancy, f'the map is {Path(name).stem}'


def _size(grid: Grid) -> str:
    return f'{grid.size} from ({grid.origin_x:g}, {grid.origin_y:g}) m'


def _check_keys(entry: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for key in entry:
        if key not in known:
            raise ValueError(f'{str(key)[:40]!r} is no key here; there are: {", ".join(known)}')


def _one_of(entry: Mapping[str, Any], names: tuple[str, ...]) -> str:
    given = [name for name in names if name in entry]
    if len(given) != 1:
        raise ValueError(f'has {" and ".join(given) or "none"} of {", ".join(names)}, must have '
                         f'exactly one')
    return given[0]


def _number(
    name: str, text: Any, low: float = -float('inf'), high: float = float('inf'),
) -> float:
    try:
        value = float(text) if isinstance(text, str) and '_' not in text else None
    except ValueError:
        value = None
    if value is None:
        raise ValueError(f'{name} is {str(text)[:40]!r}, must be a number')
    if not low <= value <= high:
        raise ValueError(f'{name} is {value:g}, must be between {low:g} and {high:g}')
    return value
