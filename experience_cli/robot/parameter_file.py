"""A parameter file for our nodes, in which each value says where it was taken from."""

from dataclasses import fields
import math
import textwrap
from typing import Any, Final, NamedTuple

from control_field.grid import cell_side
from control_field.robot.footprint import Footprint, footprint_from_points, text_from_points
from control_field_node.settings import Settings as ControllerSettings
from experience_cli.robot.facts import Fact, Facts
from msgs_bridge.sensing.laser_mount import Mount
from neighbourhood_node.settings import NeighbourhoodSettings

_DEFAULT: Final = 'TO BE CHECKED, no file says it: '
#: Where nothing says it: slow and gentle, which does no harm.
_GUESSES: Final = {
    'v_max': (0.2, 'a slow one'), 'a_max': (0.5, 'a gentle one, it brakes as gently'),
    'alpha_max': (1.0, 'a gentle one'), 'wheel_separation': (0.3, 'a guess')}
_RADIUS: Final = Fact(0.25, _DEFAULT + 'a guess; what is too small runs into things')
#: Keys drive at this share of the greatest speed, and turn so fast at most, [rad/s].
_KEYS, _TURN = 0.7, 1.0
#: What a demonstration may be faster than the robot, before it is not its own.
_FASTER: Final = 2.0
#: What software lets wheels do they do not do on the floor: the most that is believed, [m/s^2].
_MOST_BRAKING: Final = 3.0
#: So many cells a local grid has along a side at most, unless somebody asks for more.
_MOST_CELLS: Final = 39
_WIDTH: Final = 96


class Entry(NamedTuple):
    """A parameter, and what is said of it."""

    name: str
    value: Any
    source: str


def parameter_file(facts: Facts, title: str) -> str:
    """
    Return a parameter file for all nodes that run with a robot.

    Parameters
    ----------
    facts : Facts
        What is known of it. What is not gets a default that is marked, and a note is added to
        ``facts.notes`` where a value had to be changed.
    title : str
        What the robot is called, and which files were read.

    """
    body = _body(facts)
    limits = {name: _limit(facts, name) for name in ('v_max', 'a_max', 'alpha_max',
                                                     'wheel_separation')}
    limits['w_max'] = _limit(facts, 'w_max', _turning(limits))
    frame = _frame(facts)
    sections = {
        'neighbourhood_node': [*frame, *body, *_extent(facts, body), *_laser(facts)],
        'localised_odometry_node': [Entry(
            'trusted_distance', 3.0, 'how far it may drive by its wheels alone, with a '
            'localisation (pose_topic)')],
        'control_field_node': [
            *(Entry(name, *limits[name]) for name in (
                'v_max', 'w_max', 'a_max', 'alpha_max', 'wheel_separation')),
            *(entry._replace(source='as above') for entry in body),
            *_base(facts), *_timeout(facts),
            Entry('unknown_is_blocked', True, 'what no sensor shows is not driven into'),
            Entry('heartbeat', True, 'a trial runs only while a teleop_node is there, or a page '
                  'is open')],
        'learner_node': [
            *frame, body[0]._replace(source='as above'), Entry('unknown_is_blocked', True, ''),
            Entry('speed_max', round(_FASTER * limits['v_max'].value, 2),
                  'twice v_max: a demonstration that is faster is not its own')],
        'teleop_node': _driven(facts, limits),
        'page_node': [body[0]._replace(source='as above'), *_driven(facts, limits)]}
    return _header(facts, title) + ''.join(map(_section, sections, sections.values()))


def _body(facts: Facts) -> list[Entry]:
    """Return the robot's radius, and its footprint if it has one."""
    outline, radius, disc = facts.first('footprint'), facts.least('radius'), facts.first('disc')
    footprint = None if outline is None else footprint_from_points(list(outline.value))
    reach = disc.value if disc else footprint.circumscribed if footprint else 0.0
    if radius is not None and radius.value < 0.9 * reach:
        facts.notes.append(f'{radius.source} is {radius.value:g} m; by its outline the robot '
                           f'reaches {reach:.3f} m from its middle, which counts')
    if footprint is None or outline is None:
        return [_cut(facts, 'robot_radius', disc or radius or _RADIUS)]
    around = math.ceil(reach * 1000.0 - 1e-6) / 1000.0
    return [_cut(facts, 'robot_radius', Fact(around, f'the disc around the footprint, in which it '
                                             f'can turn: cells are made for it{_narrow(footprint)}'
                                             )),
            Entry('footprint', text_from_points(footprint.corners), outline.source)]


def _narrow(footprint: Footprint) -> str:
    inside = footprint.inscribed
    if inside <= 0.0:
        return ''
    return (f'. To teach ways too narrow to turn in, set it to {inside:.3f} (the disc inside) in '
            f'both nodes: cells are then {cell_side(inside):g} m, and only the footprint keeps it '
            f'off walls when it turns')


def _limit(facts: Facts, name: str, guess: Fact | None = None) -> Fact:
    found = facts.first(name) if name == 'wheel_separation' else facts.least(name)
    if found is None:
        found = guess or Fact(_GUESSES[name][0], _DEFAULT + _GUESSES[name][1])
    if name == 'a_max' and found.value > _MOST_BRAKING:
        found = Fact(_MOST_BRAKING, f'{found.source} says {found.value:g}; the robot is taken to '
                     f'brake no harder than this, measure it')
    entry = _cut(facts, name, found)
    return Fact(entry.value, entry.source)


def _turning(limits: dict[str, Fact]) -> Fact:
    """Return how fast a robot turns on the spot whose wheels turn as for its greatest speed."""
    most = 2.0 * limits['v_max'].value / limits['wheel_separation'].value
    return Fact(round(min(most, 2.0), 2), _DEFAULT + 'by v_max and wheel_separation, 2 at most')


def _cut(facts: Facts, name: str, fact: Fact, kind: Any = ControllerSettings) -> Entry:
    """Return a value within the range of its parameter."""
    spec = next(field for field in fields(kind) if field.name == name)
    low, high = spec.metadata['low'], spec.metadata['high']
    value = min(max(float(fact.value), low), high)
    if value != fact.value:
        facts.notes.append(f'{name} is {fact.value:g} by {fact.source}, and {value:g} here: it '
                           f'must be {low:g} to {high:g}')
    return Entry(name, value, fact.source)


def _frame(facts: Facts) -> list[Entry]:
    frame = facts.first('odom_frame') or Fact('odom', 'the usual frame of odometry')
    return [Entry('frame_id', *frame)]


def _base(facts: Facts) -> list[Entry]:
    base = facts.first('base_frame')
    return [] if base is None else [Entry('base_frame_id', *base)]


def _timeout(facts: Facts) -> list[Entry]:
    found = facts.first('cmd_vel_timeout')
    return [] if found is None else [_cut(facts, 'cmd_vel_timeout', found)]


def _extent(facts: Facts, body: list[Entry]) -> list[Entry]:
    """Return how far the robot sees; nothing where that is not known."""
    reach = facts.least('sight_range') or facts.least('traced')
    if reach is None:
        return []
    entry = _cut(facts, 'sight_range', reach, NeighbourhoodSettings)
    side = cell_side(body[0].value)
    n = min(2 * math.floor(entry.value / side) + 1, _MOST_CELLS)
    return [Entry('sight_cells', max(n, 3), f'{max(n, 3) // 2} cells of {side:g} m to every side'),
            entry]


def _laser(facts: Facts) -> list[Entry]:
    found = facts.first('laser')
    if found is None:
        return []
    mount, sources = found.value, iter([found.source])
    names = [name for name in Mount._fields
             if name in ('x', 'y', 'z', 'yaw') or mount.roll or mount.pitch]
    return [Entry(f'laser_{name}', float(getattr(mount, name)), next(sources, ''))
            for name in names] + _zero(facts)


def _zero(facts: Facts) -> list[Entry]:
    return [Entry('zero_is_no_return', False, _DEFAULT + 'true for drivers that write 0 where '
                  'nothing is in range, such as those of the TurtleBot3')]


def _driven(facts: Facts, limits: dict[str, Fact]) -> list[Entry]:
    v_max, w_max = limits['v_max'].value, limits['w_max'].value
    stamped = facts.first('stamped') or Fact(
        False, _DEFAULT + 'whether the robot reads cmd_vel as TwistStamped (ros2_control does '
        'since Jazzy); the launch file has an argument of that name for the other nodes')
    return [Entry('speed', max(round(_KEYS * v_max, 3), 0.01), ''),
            Entry('speed_max', v_max, 'v_max'),
            Entry('turn', min(_TURN, w_max), ''), Entry('turn_max', w_max, 'w_max'),
            Entry('enable_stamped_cmd_vel', *stamped)]


def _header(facts: Facts, title: str) -> str:
    scan, stamped = facts.first('scan_topic'), facts.first('stamped')
    words = ['ros2 launch experience_controller turtlebot.launch.py params_file:=<this file>']
    words += [f'scan:={scan.value}'] if scan and scan.value != 'scan' else []
    words += [f'enable_stamped_cmd_vel:={str(bool(stamped and stamped.value)).lower()}',
              'task:=<name>']
    return _comment(title) + _comment(' '.join(words)) + ''.join(
        _comment(f'NOTE: {note}') for note in dict.fromkeys(facts.notes))


def _section(node: str, entries: list[Entry]) -> str:
    """Return the lines of a node."""
    lines = [f'/**/{node}:\n  ros__parameters:\n']
    for name, value, source in entries:
        lines.append(_comment(source, '    ') if source else '')
        lines.append(f'    {name}: {_text(value)}\n')
    return ''.join(lines)


def _comment(text: str, indent: str = '') -> str:
    lines = textwrap.wrap(' '.join(text.split()), _WIDTH - len(indent), break_long_words=False,
                          break_on_hyphens=False)
    return ''.join(f'{indent}# {line}\n' for line in lines)


def _text(value: Any) -> str:
    """Return a value as ROS reads it: a whole number with a point where it may be any."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(round(value, 5))
    if isinstance(value, int):
        return str(value)
    quote = "'"
    return quote + str(value).replace(quote, 2 * quote) + quote
