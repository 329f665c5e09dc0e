"""
What each node publishes of its parameters on `/diagnostics`, and which of them conflict.

Simulator, local grid and learner have a workspace each, learner and controller the parameters of
the method; the topics between them would not show that these differ. Of a workspace that fits
itself only the cells have to be those of the others. Two nodes of one role in one
namespace belong to two suites that have met.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
import itertools
import json
import math
from typing import Any, Final

from control_field.grid import Grid
from msgs_bridge.untrusted.text import printable

#: Roles, as they stand in the names of diagnostics, and what people call them.
ROLES: Final[Mapping[str, str]] = {
    'learner': 'learners', 'controller': 'controllers', 'robot': 'simulated robots',
    'sight': 'nodes that make the local grid'}
#: How to keep suites apart.
REMEDY: Final = (
    'give each suite a ROS_DOMAIN_ID of its own (export ROS_DOMAIN_ID=... in all its terminals), '
    'or a namespace (-r __ns:=/...)')
#: Of a workspace, as parameters are called.
_WORKSPACE: Final = ('rows', 'cols', 'resolution', 'origin_x', 'origin_y', 'frame_id')
_MOST: Final = 4000
#: No parameter is greater; it is well within what a float can be.
_GREATEST: Final = 2.0**64
#: How far off each other's cells may lie, [cells].
_SLACK: Final = 1e-3

Values = Mapping[str, Any]


class Operation(StrEnum):
    """What people ask a suite for: a demonstration, a trial, a change of recorded bags."""

    TEACH = 'teach'
    DRIVE = 'drive'
    CHANGE = 'change'


@dataclass(frozen=True)
class NodeInfo:
    """
    What a node is started with.

    Parameters
    ----------
    name : str
        Full name of the node.
    role : str
        One of `ROLES`.
    instance : str
        Which process: machine, number, and a random part.
    workspace, method : mapping or None
        Parameters by name; None where it has none.
    phase : str
        What a learner is doing, such as ``demonstration``; it stands there by itself.

    """

    name: str
    role: str
    instance: str
    workspace: Values | None = None
    method: Values | None = None
    phase: str = ''

    @property
    def namespace(self) -> str:
        """Return the namespace of the node, with a slash at its end."""
        return self.name.rpartition('/')[0] + '/'

    @property
    def label(self) -> str:
        """Return the name of the node for people."""
        return printable(self.name.rpartition('/')[2])


@dataclass(frozen=True)
class Conflict:
    """
    A conflict between nodes.

    Parameters
    ----------
    text : str
        One line with the remedy.
    prevents : frozenset of Operation
        What must not be done while it lasts.
    log_key : str
        Conflicts of one key are logged once; the text where it is empty.
    is_of_cells : bool
        Whether the cells of one are none of the other's.

    """

    text: str
    prevents: frozenset[Operation] = frozenset()
    log_key: str = ''
    is_of_cells: bool = False


def workspace_from_grid(grid: Grid, is_fitted: bool = False) -> dict[str, Any]:
    """Return a workspace as parameters by name; 0 rows and columns where it fits itself."""
    rows, cols = (0, 0) if is_fitted else grid.shape
    return dict(zip(_WORKSPACE, (rows, cols, grid.resolution, grid.origin_x, grid.origin_y,
                                 grid.frame_id), strict=True))


def cells_of(info: NodeInfo) -> Grid | None:
    """Return a cell of those that a node says it has; None if it says none."""
    values = info.workspace
    if values is None:
        return None
    try:
        return Grid(1, 1, float(values['resolution']), float(values['origin_x']),
                    float(values['origin_y']), values['frame_id']).lattice
    except ValueError:
        return None


def method_from_parameters(parameters: Any, names: Iterable[str] | None = None) -> dict[str, Any]:
    """Return the parameters of the method by name."""
    values = asdict(parameters)
    return values if names is None else {name: values[name] for name in names}


def values_from_node_info(info: NodeInfo) -> dict[str, str]:
    """Return the values that a DiagnosticStatus gets of a node's parameters."""
    values = {'workspace': info.workspace, 'method': info.method}
    return {'instance': info.instance, **{
        key: json.dumps(dict(value)) for key, value in values.items() if value is not None}}


def node_info_from_status(status: Any) -> NodeInfo | None:
    """Read what a node is started with; None if a status does not hold that, or is not valid."""
    name, _, role = status.name.rpartition(': ')
    values = {pair.key: pair.value for pair in status.values}
    if role not in ROLES or not values.get('instance'):
        return None
    return NodeInfo(f'/{name.lstrip("/")}', role, values['instance'][:200],
                     _workspace(_mapping(values.get('workspace', ''))),
                     _mapping(values.get('method', '')), values.get('phase', '')[:40])


def _mapping(text: str) -> dict[str, Any] | None:
    if not text or len(text) > _MOST:
        return None
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        return None
    simple = isinstance(values, dict) and all(
        isinstance(value, str) or (isinstance(value, (int, float)) and abs(value) < _GREATEST)
        for value in values.values())
    return values if simple else None


def _workspace(values: dict[str, Any] | None) -> dict[str, Any] | None:
    """Return a workspace that one can reckon with; None if it is none."""
    if values is None or set(values) != set(_WORKSPACE) or not isinstance(
            values['frame_id'], str):
        return None
    numbers = [values[name] for name in _WORKSPACE[:-1]]
    sound = not any(isinstance(number, str) for number in numbers)
    return values if sound and values['resolution'] > 0.0 else None


def conflicts(infos: Iterable[NodeInfo]) -> list[Conflict]:
    """
    Return what conflicts among the nodes of one namespace.

    Parameters
    ----------
    infos : iterable of NodeInfo
        The newest of each process that is alive.

    """
    by_role: dict[str, list[NodeInfo]] = {role: [] for role in ROLES}
    for info in infos:
        by_role[info.role].append(info)
    found = [_met(role, those) for role, those in by_role.items() if len(those) > 1]
    for first, second in (('learner', 'robot'), ('learner', 'sight'), ('robot', 'sight')):
        if first == 'robot' and any(info.workspace for info in by_role['learner']):
            continue  # both are compared with it
        found += [conflict for one, other in itertools.product(by_role[first], by_role[second])
                  for conflict in _of_workspaces(one, other)]
    found += [conflict for one, other in itertools.product(
        by_role['learner'], by_role['controller']) for conflict in _of_methods(one, other)]
    return found


def _met(role: str, infos: list[NodeInfo]) -> Conflict:
    names = ' and '.join(sorted(f'{printable(each.name)} ({_process(each.instance)})'
                                for each in infos)[:4])
    return Conflict(f'{len(infos)} {ROLES[role]} in one namespace: {names}. Two suites have '
                    f'met: {REMEDY}', frozenset(Operation), f'{ROLES[role]} meet')


def _process(instance: str) -> str:
    machine, _, number = instance.rpartition('-')[0].rpartition('-')
    return printable(f'process {number} on {machine}', 80) if machine else 'another process'


def _of_workspaces(learner: NodeInfo, other: NodeInfo) -> list[Conflict]:
    ours, theirs = learner.workspace, other.workspace
    if ours is None or theirs is None or not (differing := _differing(ours, theirs)):
        return []
    fits = _shares_cells(ours, theirs)
    if not (ours['rows'] and theirs['rows']):
        return [] if fits else [_of_lattices(learner, other)]
    text = (f'{other.label} and {learner.label} have different workspaces, {_grid_text(theirs)} '
            f'and {_grid_text(ours)}: restart {learner.label} with '
            f'{_arguments(theirs, differing)}, or ')
    text += (f'{other.label} with another world' if other.role == 'robot'
             else f'{other.label} with {_arguments(ours, differing)}')
    if fits:
        text += '; until then only what both have is of use'
    return [Conflict(text, frozenset() if fits else frozenset((Operation.TEACH, Operation.DRIVE)),
                     is_of_cells=not fits)]


def _of_lattices(first: NodeInfo, other: NodeInfo) -> Conflict:
    """Return that two have cells of their own, at least one of them in a workspace that fits."""
    ours, theirs = first.workspace or {}, other.workspace or {}
    differing = _differing({name: ours[name] for name in ('frame_id', 'resolution')}, theirs)
    elsewhere = 'rows, cols and an origin on these cells'
    text = (f'{other.label} and {first.label} have different cells, {_cells_text(theirs)} and '
            f'{_cells_text(ours)}: restart {other.label} with '
            f'{_arguments(ours, differing) or elsewhere}'
            f'{", or another world," if other.role == "robot" else ""} or {first.label} with ')
    # What was learnt is of its cells.
    text += ('another task (-p task:=...)' if first.role == 'learner'
             else _arguments(theirs, differing) or 'another world')
    return Conflict(text, frozenset((Operation.TEACH, Operation.DRIVE)), is_of_cells=True)


def _cells_text(values: Values) -> str:
    corner = [values[name] % values['resolution'] for name in ('origin_x', 'origin_y')]
    return (f'of {values["resolution"]:g} m in {printable(values["frame_id"], 40)} with a corner '
            f'at ({corner[0]:g}, {corner[1]:g}) m')


def _of_methods(learner: NodeInfo, controller: NodeInfo) -> list[Conflict]:
    ours, theirs = learner.method or {}, controller.method or {}
    differing = _differing(ours, theirs)
    if not differing:
        return []
    have = ', '.join(f'{name} {printable(theirs[name], 40)} and {printable(ours[name], 40)}'
                     for name in differing)
    return [Conflict(
        f'{controller.label} and {learner.label} have different parameters of the method, '
        f'{have}: restart {controller.label} with {_arguments(ours, differing)}, or '
        f'{learner.label} with {_arguments(theirs, differing)}', frozenset((Operation.DRIVE,)))]


def _differing(ours: Values, theirs: Values) -> list[str]:
    return [name for name in ours if name in theirs and not _is_same(ours[name], theirs[name])]


def _is_same(one: Any, other: Any) -> bool:
    if isinstance(one, str) or isinstance(other, str):
        return bool(one == other)
    return math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-9)


def _shares_cells(ours: Values, theirs: Values) -> bool:
    """Return whether what one calls a cell is one of the other's, too, or would be."""
    if not all(_is_same(ours[name], theirs[name]) for name in ('frame_id', 'resolution')):
        return False
    offsets = [(ours[name] - theirs[name]) / ours['resolution']
               for name in ('origin_x', 'origin_y')]
    return all(abs(offset - round(offset)) < _SLACK for offset in offsets)


def _grid_text(values: Values) -> str:
    return (f'{values["rows"]} x {values["cols"]} cells of {values["resolution"]:g} m from '
            f'({values["origin_x"]:g}, {values["origin_y"]:g}) m in '
            f'{printable(values["frame_id"], 40)}')


def _arguments(values: Values, names: Iterable[str]) -> str:
    return ' '.join(f'-p {name}:={_ros_text(values[name])}' for name in names)


def _ros_text(value: Any) -> str:
    """Write a value as ROS reads it."""
    if isinstance(value, bool):
        return str(value).lower()
    return printable(value, 40) if isinstance(value, str) else repr(value)
