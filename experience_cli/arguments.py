"""
The command line: every command with its options, in the order of the help.

A command is a module of `commands` that is imported when it is called; nothing heavy is imported
here, so that the help and the first mistakes come at once.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
import re
from typing import Any, Final, NamedTuple, NoReturn

from experience_cli.argument_types import radius, speed
from experience_cli.evaluation_options import add_method_options, add_task_options

#: Where the bags are if nobody says.
BAGS: Final = Path('bags')
#: What `demo` takes where nothing is said; what runs already (--attach) has its own.
DEMO_DEFAULTS: Final[dict[str, Any]] = {
    'out': Path('out/demo'), 'profile': 'full', 'seed': 0, 'realtime': False, 'settings': ''}
#: Limits of the robot by the name of the controller's parameter: unit and meaning.
LIMITS: Final = {
    'v_max': ('m/s', 'greatest speed'), 'w_max': ('rad/s', 'greatest turning rate'),
    'a_max': ('m/s^2', 'greatest change of speed'),
    'alpha_max': ('rad/s^2', 'greatest change of turning rate'),
    'robot_radius': ('m', 'radius')}
#: Options that name the topics of a bag of another recorder, by role.
TOPICS: Final = {'odom': 'odom_topic', 'neighbourhood': 'neighbourhood_topic',
                 'scan': 'scan_topic', 'cmd_vel': 'cmd_vel_topic'}
#: All options that say how such a bag is to be read; None where nothing is said.
READING: Final = (*TOPICS.values(), 'base_frame', 'laser', 'body_radius', 'zero_is_no_return',
                  'from', 'to')
#: Options that describe the workspace; where none is given it fits itself to the drive.
WORKSPACE: Final = ('rows', 'cols', 'resolution', 'origin', 'frame', 'cell_radius')
#: Of a TurtleBot3 Burger, [m]: the cells hold such a robot where nothing else is said.
ROBOT_RADIUS: Final = 0.105
_TOPIC_HELP: Final = {
    'odom': 'which topic says where the robot was: Odometry, a pose, or /tf (the one called odom)',
    'neighbourhood': 'which one is its 3x3 local grid (the one called so)',
    'scan': 'which one to make the 3x3 local grid from (the one called so, or the only LaserScan)',
    'cmd_vel': 'which one is cmd_vel (the one called so)'}
_BAG_OR_TASK: Final = 'task1/0003, task1, or the folder of a bag or a task'
_FIELD_FILE: Final = """\
After 0, 1, ... K trials every free cell with a way to the goal is a start, in the true world:
field_success follows the flow alone, success adds local grid and exploration (nothing is learnt
then).

To follow the flow of FIELD.npz: at a cell's centre take the nearest of the eight headings to
(vx, vy) there, step to that neighbouring cell, and so on. (0, 0), a blocked cell, the edge, a
diagonal step beside a blocked cell (without --corner-cutting) and a cell entered twice are
failures. Row 0 is the lowest y. The centre of cell (row, col) is
origin + (col + 0.5, row + 0.5) * resolution.

Worlds: a map_server .yaml with its image, or a MovingAI .map (1 m a cell, lower left corner at
(0, 0), the first line of the map is the highest y). Coordinates are metres in the map frame."""


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2."""
        line = ' '.join(message.split())
        self.exit(2, f'{self.prog}: {line} (see {self.prog} --help)\n')


class Command(NamedTuple):
    """
    A subcommand.

    Parameters
    ----------
    module : str
        Of `commands`, with ``run(arguments) -> int``.
    help : str
        A line for the list of all commands.
    add_options : callable
        Describes it to its parser.

    """

    module: str
    help: str
    add_options: Callable[[argparse.ArgumentParser], None]


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = Parser(
        prog='experience', description='Teach a robot by driving it once, and let it try.',
        epilog='A bag is one recording: of a drive of yours (demo) or of a try of the robot '
        '(trial). bags/kitchen holds those of the task kitchen; kitchen/0002 names one of them. '
        'A field says which way the robot goes from every place.')
    subparsers = top.add_subparsers(dest='command', metavar='COMMAND', required=True)
    for name, command in COMMANDS.items():
        command.add_options(subparsers.add_parser(name, help=command.help))
    return top


def _demo(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Start simulator, controller and learner, show the robot the way once, let it try, and '
        "draw the paper's figures.")
    add = parser.add_argument
    add('--out', type=Path, metavar='FOLDER', help=f'all goes there ({DEMO_DEFAULTS["out"]})')
    add('--tasks', metavar='LIST',
        help='which tasks, or names or files of worlds (1,2; with --attach 1; with --page '
        'dead_ends, where the robot fails at first)')
    add('--trials', type=int, default=6, metavar='N', help='tries of each task (%(default)s)')
    add('--movers', default='', metavar='FILE',
        help='who moves and what changes: a file of doc/maps.md, or crossing or door')
    add('--settings', metavar='FILE',
        help='learning parameters: a file, or a name in config/settings (that of the world)')
    add('--profile', choices=('paper', 'full'),
        help="the paper's equations to the letter, or with what keeps their promise "
        f'({DEMO_DEFAULTS["profile"]})')
    add('--seed', type=int, metavar='N',
        help=f'number that all chance comes from ({DEMO_DEFAULTS["seed"]})')
    add('--realtime', action='store_true', default=None, help='as slow as a real robot')
    add('--page', action='store_true',
        help='show it live in a browser, four times as fast as real, and stay there until Ctrl-C')
    add('--no-browser', action='store_true', help='with --page: print the address, open nothing')
    add('--attach', action='store_true',
        help='start no nodes: use the simulator, controller and learner that run in this ROS '
        'domain already, and write nothing beside their bags')
    add('--namespace', default='', metavar='NAME', help='of the nodes that run already')


def _page(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Start a simulated robot, controller, learner and a page to teach them from, and open it '
        'in a browser, until Ctrl-C. With --robot: for a robot that has been brought up.')
    add = parser.add_argument
    add('--world', metavar='WORLD',
        help='where the simulated robot is: a name in config/worlds, or a file (task1)')
    add('--robot', metavar='ROBOT',
        help='a real robot: its name in config/robots, or a parameter file that `experience '
        'robot` has written')
    add('--task', metavar='NAME', help="what is learnt (the world's name; of a robot: task)")
    add('--bags', type=Path, default=BAGS, metavar='FOLDER', help='the memory (%(default)s)')
    add('--host', default='127.0.0.1', metavar='ADDRESS',
        help='who can open the page: this machine alone (%(default)s), or with 0.0.0.0 whoever '
        'has the address that is then printed')
    add('--port', type=int, metavar='N', help='(8300, or a free one)')
    add('--no-browser', action='store_true', help='print the address, open nothing')
    add('--out', type=Path, default=Path('out/page'), metavar='FOLDER', help='for the logs')
    add('--foxglove-port', type=int, default=0, metavar='N',
        help='let Foxglove on this machine in, too, by this port (doc/page.md)')


def _learn(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Learn anew from bags, in the order of their numbers, and say what each of them has '
        'taught. The same bags always give the same field, byte for byte the one that '
        'learner_node published.')
    add = parser.add_argument
    add('bags', nargs='+', type=Path, metavar='BAG_OR_TASK',
        help=f'{_BAG_OR_TASK}; bags of other recorders')
    add('--save', type=Path, metavar='FIELD.npz', help='write the field here')
    add('--check', action='store_true',
        help='compare with the fields that the live learner published, and fail where a bag is '
        'incomplete')
    add('-v', '--verbose', action='store_true',
        help='say of each bag in numbers, too, what it taught')
    add('--quiet', action='store_true', help='print the last line only')
    group = _add_external(parser)
    group.add_argument('--into', type=Path, metavar='TASK_FOLDER',
                       help='keep each as the next demonstration of a task, and relearn that')
    group.add_argument('--new-task', action='store_true',
                       help='begin a task also where its name is nearly that of another one')


def _evaluate(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Teach, try and judge on any map, without ROS: from which share of all free cells does '
        'the robot get to the goal?')
    parser.epilog = _FIELD_FILE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    # argparse takes '-2,3' for an option unless it looks like a negative number.
    parser._negative_number_matcher = re.compile(r'^-\.?\d')
    add_task_options(parser.add_argument)
    add_method_options(parser.add_argument)
    parser.add_argument('--json', metavar='OUT',
                        help='write the report; - for standard output')
    parser.add_argument('--save-field', metavar='FIELD.npz',
                        help='write the field of the first seed after all trials')
    group = parser.add_argument_group('with --demo-bag', 'How the bag is to be read.')
    _add_reading(group)
    group.add_argument('--frame', metavar='NAME',
                       help='that of the world; /tf takes the poses there, if it can (odom)')


def _inspect(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Draw what a task, or its bags up to one, have taught, as a PNG: which way the robot goes '
        'from every place, from where it gets to the goal, what it has seen.')
    parser.add_argument('bag', type=Path, metavar='BAG_OR_TASK', help=_BAG_OR_TASK)
    parser.add_argument('--out', type=Path, metavar='FILE.png',
                        help='where to write it (beside the bag)')
    _add_external(parser)


def _explain(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Say in a sentence what the robot did at a moment of a bag and where it has that from. '
        'Then in numbers: the decision, which prototypes (places with the direction learnt there) '
        'weighed how much in it by equation 7 of the paper, from which bag and second each of '
        'them is, and what the collision monitor did to the command.')
    _add_bag(parser)
    parser.add_argument('--at', type=float, required=True, metavar='T',
                        help='seconds from the first odometry, or a stamp past the end of that')
    parser.add_argument('--json', action='store_true', help='print a JSON object instead')
    for name, (unit, what) in LIMITS.items():
        parser.add_argument(f'--{name.replace("_", "-")}', type=float, metavar='X',
                            help=f"the robot's {what}, [{unit}]; a bag does not say it, and a "
                            f"TurtleBot3 Burger's is taken")
    parser.add_argument('--footprint', metavar='OUTLINE',
                        help='its outline, if it is no disc: "[[x, y], ...]", [m]')
    _add_external(parser, with_radius=False)


def _diff(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Compare two fields of one workspace: where their headings differ, what each is worth, '
        'which prototypes came and went. A field is a bag (what it was driven on), the folder of '
        'a task (what its bags teach), a bag of another recorder (what it teaches alone, in the '
        'workspace of the other field where nothing else is said) or a saved .npz.')
    for name in ('first', 'second'):
        parser.add_argument(name, metavar='BAG_TASK_OR_NPZ')
    parser.add_argument('--out', type=Path, metavar='FILE.png', default=Path('out/diff.png'),
                        help='where to draw it (%(default)s)')
    parser.add_argument('--json', action='store_true', help='print a JSON object instead of text')
    _add_bags(parser)
    _add_external(parser)


def _list(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'List the bags of a task, or of all tasks: what each one holds, how it ended, what a '
        'person said of it, and whether it is learnt from.')
    parser.epilog = (
        'A demo is a drive of yours, a trial a try of the robot. STATE: kept is learnt from; not '
        'kept and aborted are not, a line below the list says why; incomplete is learnt from '
        'where that can be, seconds of it are missing; cut was not closed, `experience repair` '
        'mends it; recording is under way; forgotten was taken away, `experience forget --undo` '
        'brings it back; unreadable is no bag of ours.')
    parser.add_argument('folder', nargs='?', type=Path, default=BAGS, metavar='TASK',
                        help='a task, a bag such as task1/0003, or the folder of all tasks '
                        '(%(default)s)')
    parser.add_argument('--json', action='store_true', help='print a JSON list instead')


def _show(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Show a bag: what it started from, its topics, and what a person drove or the robot did '
        'in it. East is the way of x, north that of y. Of a bag of another recorder: where each '
        'of its topics says that the robot was, which would be learnt from, and what of it.')
    _add_bag(parser)
    parser.add_argument('--out', type=Path, metavar='FILE.png', help='draw the drive here, too')
    parser.add_argument('--json', action='store_true', help='print a JSON object instead')
    _add_external(parser)


def _label(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Judge a bag. A trial labelled a failure counts as given up, one labelled a success as '
        'having reached the goal, whatever it seemed to the robot; from a demonstration labelled '
        'a failure nothing is learnt. Nothing recorded is changed.')
    _add_bag(parser)
    parser.add_argument('label', choices=('success', 'failure', 'none'),
                        help='none takes back what was said')


def _trim(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Cut a demonstration to what shall be learnt from. Seconds count from the first odometry, '
        'as `experience show` prints them. The whole recording stays beside it.')
    _add_bag(parser)
    parser.add_argument('--from', dest='first', type=float, metavar='S', help='[s] (its start)')
    parser.add_argument('--to', dest='last', type=float, metavar='S', help='[s] (its end)')
    parser.add_argument('--undo', action='store_true', help='put the whole recording back')


def _forget(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Take a bag out of the memory: the field is then as if it never was. The bag is moved to '
        '.forgotten in the folder of its task and keeps its number.')
    _add_bag(parser)
    parser.add_argument('--undo', action='store_true',
                        help='bring a bag back that was forgotten, dropped or thrown away; of a '
                        'TASK alone what was taken away last')


def _repair(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Mend bags whose recording broke off (a crash, no power, a full disk), and say what of '
        'them is lost. A whole bag is left as it is.')
    parser.add_argument('bags', nargs='+', type=Path, metavar='BAG_OR_TASK', help=_BAG_OR_TASK)


def _robot(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        'Write a parameter file for your robot, like those of config/robots: body, speeds, '
        'wheels, where the laser sits. Each value says where it was taken from, or that it is TO '
        'BE CHECKED.')
    subparsers = parser.add_subparsers(dest='source', metavar='SOURCE', required=True)
    urdf = subparsers.add_parser('from-urdf', help='from the description of the robot')
    urdf.add_argument('file', type=Path, metavar='FILE.urdf',
                      help='the description; xacro has to be expanded: `xacro FILE > robot.urdf`')
    urdf.add_argument('--params', action='append', type=Path, default=[], metavar='FILE.yaml',
                      help='a parameter file of Nav2 or ros2_control as well; may be given again')
    urdf.add_argument('--laser', metavar='LINK', help='the link whose scans are read')
    urdf.add_argument('--base-frame', metavar='LINK',
                      help='the link that odometry is of (base_footprint or base_link)')
    urdf.add_argument('--packages', action='append', type=Path, default=[], metavar='FOLDER',
                      help='where the packages of its meshes are; may be given again')
    nav2 = subparsers.add_parser('from-nav2', help='from parameter files of Nav2 or ros2_control')
    nav2.add_argument('file', type=Path, metavar='FILE.yaml')
    nav2.add_argument('params', nargs='*', type=Path, metavar='FILE.yaml', help='more of them')
    for each in (urdf, nav2):
        each.add_argument('--output', metavar='OUT.yaml', help='where to write it (the terminal)')


def _add_bag(parser: argparse.ArgumentParser) -> None:
    """Add the argument that names a bag, and the option that says where all bags are."""
    parser.add_argument('bag', metavar='TASK/NUMBER',
                        help='the bag: task1/0003, or the path of its folder')
    _add_bags(parser)


def _add_bags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--bags', type=Path, metavar='FOLDER',
                        help=f'the folder of all tasks ({BAGS})')


def _add_external(parser: argparse.ArgumentParser, with_radius: bool = True) -> Any:
    """Add the options that say how a bag of another recorder is to be read; return the group."""
    group = parser.add_argument_group(
        'bags of other recorders', 'Drives that were recorded by `ros2 bag record`, `rosbag '
        'record` or the like, MCAP, sqlite3 or ROS 1; each is one demonstration.')
    _add_reading(group)
    if with_radius:
        group.add_argument('--robot-radius', type=radius, metavar='M', dest='cell_radius',
                           help='cells are as large as this robot needs (0.105 m: 0.25 m)')
    group.add_argument('--resolution', type=float, metavar='M', help='side of a cell')
    group.add_argument('--rows', type=int, metavar='N',
                       help='of the workspace, with --cols (it fits the drive)')
    group.add_argument('--cols', type=int, metavar='N', help='of the workspace, with --rows')
    group.add_argument('--origin', type=float, nargs=2, metavar=('X', 'Y'),
                       help='its lower left corner, with --rows and --cols (0 0)')
    group.add_argument('--frame', metavar='NAME',
                       help='of the workspace; /tf takes the poses there, if it can (that of the '
                       'odometry)')
    group.add_argument('--max-speed', type=speed, metavar='M/S',
                       help='a drive that is faster is no robot: not learnt (3 m/s, or of --like)')
    group.add_argument('--like', type=Path, metavar='BAG',
                       help='workspace and parameters are those of this bag, or task')
    return group


def _add_reading(group: Any) -> None:
    """Add the options that say what the topics of such a bag are."""
    for role, option in TOPICS.items():
        group.add_argument('--' + option.replace('_', '-'), metavar='TOPIC',
                           help=_TOPIC_HELP[role])
    group.add_argument('--base-frame', metavar='NAME',
                       help="the robot's middle in /tf (base_footprint or base_link)")
    group.add_argument('--laser', type=float, nargs=6,
                       metavar=('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW'),
                       help='where the laser sits on the robot, [m], [rad] (as /tf_static says)')
    group.add_argument('--body-radius', type=radius, metavar='M',
                       help='what is nearer to its middle is the robot itself (0.105 m)')
    group.add_argument('--zero-is-no-return', action='store_const', const=True,
                       help="the laser's driver writes 0 where nothing is in range")
    group.add_argument('--from', type=float, metavar='S',
                       help='read the drive from there on only, [s] from its first pose')
    group.add_argument('--to', type=float, metavar='S', help='read it up to there only, [s]')


#: All commands, by name.
COMMANDS: Final = {
    'demo': Command('demo', "teach and try the paper's two tasks on real nodes", _demo),
    'page': Command('page', 'teach and watch the robot in a browser', _page),
    'learn': Command('learn', 'learn anew from bags, and say what each has taught', _learn),
    'evaluate': Command(
        'evaluate', 'judge what is learnt on a map, from all its free cells', _evaluate),
    'inspect': Command(
        'inspect_field', 'draw what was learnt: which way the robot goes from every place',
        _inspect),
    'explain': Command('explain', 'say why the robot did what it did at a moment', _explain),
    'diff': Command(
        'diff', 'compare what two bags, tasks or saved fields lead the robot to do', _diff),
    'list': Command('list_bags', 'say which bags there are', _list),
    'show': Command('show', 'say what a bag holds', _show),
    'label': Command('label', 'say that a bag was a success or a failure', _label),
    'trim': Command('trim', 'cut a demonstration to a span of time', _trim),
    'forget': Command('forget', 'take a bag out of the memory; --undo brings it back', _forget),
    'repair': Command('repair', 'mend recordings that broke off', _repair),
    'robot': Command('robot', 'write a parameter file for a robot, from its URDF', _robot)}
