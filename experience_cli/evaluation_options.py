"""The options of `experience evaluate`: what is judged."""

from collections.abc import Callable
import math
from typing import Final

from experience_cli.argument_types import (
    change, count, distance, point, radius, side, sight, speed)

_METHODS: Final = (
    'ours, q_learning, sarsa, dyna_q, dyna_q+, prioritised_sweeping (each also with +demo: taught '
    'the same demonstration), nearest_prototype, eq7, replanner, forgetting_replanner')


def add_task_options(add: Callable[..., object]) -> None:
    """Add what says where the robot tries, and what it is shown."""
    add('--world', required=True, metavar='FILE',
        help='map_server .yaml, MovingAI .map or a drawn image, or the name of a world that comes '
        'along, as task1; pixels that are smaller than the robot become cells of its size')
    add('--robot-radius', metavar='M', type=radius, default=None,
        help='of the robot that the cells are made for (default: 0.105 m, cells of 0.25 m)')
    add('--resolution', metavar='M', type=side, default=None,
        help='side of the cells, instead; that of a pixel keeps the pixels. Of an image alone: '
        'side of a pixel')
    add('--change', metavar='K:FILE', type=change, action='append', default=[],
        help='from trial K + 1 on the world is another one of the same size; may be given several '
        'times, K growing')
    add('--movers', metavar='FILE',
        help='what moves in the world, and what changes at a trial or a time: a YAML file, or the '
        'name of one that comes along, as crossing')
    add('--sight', metavar='N', type=sight, default=3,
        help='side of the local grid, an odd number of cells up to 61; what lies behind something '
        'is not seen (default: 3)')
    add('--goal', metavar='X,Y', type=point,
        help='[m]; the nearest free cell to it; with --demo-bag the end of the drive')
    add('--demo-start', metavar='X,Y', type=point, action='append', default=[],
        help='[m], as --goal; once for every demonstration; trials with fixed starts start at '
        'the first')
    add('--teacher', choices=('shortest', 'blind', 'detour'), default='shortest',
        help='shortest: knows the map; blind: drives straight through the open workspace, and its '
             'local grid is that of the open workspace; detour: knows the map and goes 1.3 to 2 '
             'times as far (default: shortest)')
    add('--demo-steps', metavar='N', type=count(1, 1_000_000),
        help='show a random way without loops of exactly N steps, instead of a teacher')
    add('--demo-bag', metavar='BAG', help='take the demonstration from a bag')
    add('--max-speed', metavar='M/S', type=speed,
        help='with --demo-bag: a drive that is faster is no robot (default: 3 m/s)')
    add('--trials', metavar='K', type=count(0, 100_000), default=10,
        help='how often the robot tries after it was shown the way (default: 10)')
    add('--starts', choices=('spread', 'fixed'), default='spread',
        help='where trials start: where they teach most, or where the first demonstration does '
             '(default: spread)')
    add('--judge-every', metavar='N', type=count(1, 100_000), default=1,
        help='judge after 0, N, 2 N, ... and after all trials: large worlds have many starts '
             '(default: 1)')
    add('--start-radius', metavar='R', type=distance, default=math.inf,
        help="judge only the cells at most so far from the first demonstration's start, [m]")


def add_method_options(add: Callable[..., object]) -> None:
    """Add what says how it learns, and how often all of it is done."""
    # dyna-q+ is how the book writes it.
    add('--method', type=lambda name: name.replace('-', '_'), default='ours',
        help=f'one of {_METHODS} (default: ours)')
    add('--profile', choices=('paper', 'full'), default='full',
        help='paper: its equations to the letter; full: with what keeps its promise (default: '
             'full)')
    add('--corner-cutting', action='store_true',
        help='a diagonal step may pass a blocked cell beside it')
    add('--set', metavar='NAME=VALUE', action='append', default=[],
        help='any learning parameter; may be given several times')
    add('--seeds', metavar='N', type=count(1, 100_000), default=20,
        help='how often all of it is done, each time with other chances (default: 20)')
    add('--seed0', metavar='S', type=count(0, 2**62), default=0,
        help='the first seed (default: 0)')
    add('--jobs', metavar='J', type=count(1, 1024), default=1,
        help='processes; the results do not depend on it (default: 1)')
