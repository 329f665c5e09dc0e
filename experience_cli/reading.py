"""How a bag of another recorder is to be read: the options of every command that takes one."""

import argparse
import math
from typing import Any, Final

from experience_cli.errors import UserError

#: Options that name topics, by role.
_TOPICS: Final = {'odom': 'odom_topic', 'neighbourhood': 'neighbourhood_topic',
                  'scan': 'scan_topic', 'cmd_vel': 'cmd_vel_topic'}
#: What else says how, all of them None where nothing is said.
_OTHERS: Final = ('base_frame', 'laser', 'body_radius', 'zero_is_no_return', 'from', 'to')
#: The names of all of them.
READING: Final = (*_TOPICS.values(), *_OTHERS)
_HELP: Final = {
    'odom': 'which topic says where the robot was: Odometry, a pose, or /tf (the one called odom)',
    'neighbourhood': 'which one is its 3x3 local grid (the one called so)',
    'scan': 'which one to make the 3x3 local grid from (the one called so, or the only LaserScan)',
    'cmd_vel': 'which one is cmd_vel (the one called so)'}


def add_reading_options(group: Any) -> None:
    """Add the options that say what the topics of a bag of others are."""
    for role, option in _TOPICS.items():
        group.add_argument('--' + option.replace('_', '-'), metavar='TOPIC', help=_HELP[role])
    group.add_argument('--base-frame', metavar='NAME',
                       help="the robot's middle in /tf (base_footprint or base_link)")
    group.add_argument('--laser', type=float, nargs=6,
                       metavar=('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW'),
                       help='where the laser sits on the robot, [m], [rad] (as /tf_static says)')
    group.add_argument('--body-radius', type=_radius, metavar='M',
                       help='what is nearer to its middle is the robot itself (0.105 m)')
    group.add_argument('--zero-is-no-return', action='store_const', const=True,
                       help="the laser's driver writes 0 where nothing is in range")
    group.add_argument('--from', type=float, metavar='S',
                       help='read the drive from there on only, [s] from its first pose')
    group.add_argument('--to', type=float, metavar='S', help='read it up to there only, [s]')


def add_frame_option(group: Any, text: str) -> None:
    """Add the option that names the frame of the workspace."""
    group.add_argument('--frame', metavar='NAME', help=text)


def reading_of(arguments: argparse.Namespace) -> Any:
    """
    Return how a bag is to be read.

    Raises
    ------
    UserError
        If a number is none.

    """
    from episode_store.external.drive import Reading
    from msgs_bridge.sensing.laser_mount import Mount
    from msgs_bridge.sensing.local_grid_from_scan import Body

    names = {role: getattr(arguments, option) for role, option in _TOPICS.items()}
    values: dict[str, Any] = {
        'names': {role: name for role, name in names.items() if name is not None},
        'base_frame': arguments.base_frame or '',
        'zero_is_no_return': bool(arguments.zero_is_no_return)}
    if arguments.laser is not None:
        if not all(map(math.isfinite, arguments.laser)):
            raise UserError('--laser: must be six finite numbers')
        x, y, z, roll, pitch, yaw = arguments.laser
        values['mount'] = Mount(x, y, yaw, z, roll, pitch)
    if arguments.body_radius is not None:
        values['body'] = Body(arguments.body_radius)
    first, last = getattr(arguments, 'from'), arguments.to
    if first is not None or last is not None:
        values['span'] = _span(0.0 if first is None else first, math.inf if last is None else last)
    return Reading(**values)


def _span(first: float, last: float) -> Any:
    from episode_store.external.span import Span

    if not 0.0 <= first < last:
        raise UserError(f'--from {first:g} --to {last:g}: --from must be 0 or more, --to after it')
    return Span(first, last)


def guessed(drive: Any, arguments: argparse.Namespace) -> list[str]:
    """Say which topic was taken for odom by its type alone."""
    odom = drive.read_from
    is_named = arguments.odom_topic is not None or odom.rpartition('/')[2] in ('odom', 'tf')
    return [] if is_named else [f'odom is {odom}, the only one of its type']


def _radius(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= 2.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no radius, must be 0 to 2 m')
    return value
