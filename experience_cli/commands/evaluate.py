"""`experience evaluate`: how good is what is learnt, on any world, without ROS."""

import argparse
from collections.abc import Sequence
from dataclasses import fields
import json
import math
from pathlib import Path
import re
import sys
from typing import Any, TYPE_CHECKING

from control_field.drives.plausibility import SPEED_MAX
from control_field.grid import Grid
from control_field.parameters import Parameters
from experience_cli.commands.learn_import import speed
from experience_cli.errors import UserError

if TYPE_CHECKING:
    from control_field.records import Demonstration
    from experience_cli.output import Output
    from experience_evaluation.experiment import Course, Experiment

_METHODS = ('ours, q_learning, sarsa, dyna_q, prioritised_sweeping (each also with +demo: taught '
            'the same demonstration), nearest_prototype, eq7, replanner')
_TEACHERS = ('shortest', 'blind', 'detour')
_COLUMNS = ('field_success', 'success', 'success_spl', 'collisions', 'hidden_neurons', 'fidelity')
_EPILOG = """\
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


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add `evaluate` to the command line."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'evaluate', help='judge what is learnt on a map, from all its free cells',
        description='Teach, try and judge on any map, without ROS: from which share of all free '
        'cells does the robot get to the goal?', epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    # argparse takes '-2,3' for an option unless it looks like a negative number.
    parser._negative_number_matcher = re.compile(r'^-\.?\d')
    _add_task(parser)
    _add_method(parser)
    _add_output(parser)
    _add_bag(parser)
    return parser


def _add_bag(parser: argparse.ArgumentParser) -> None:
    from experience_cli.reading import add_frame_option, add_reading_options
    group = parser.add_argument_group('with --demo-bag', 'How the bag is to be read.')
    add_reading_options(group)
    add_frame_option(group, 'that of the world; /tf takes the poses there, if it can (odom)')


def _add_task(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add('--world', required=True, metavar='FILE',
        help='map_server .yaml or MovingAI .map, or the name of a world that comes along, as '
        'task1')
    add('--goal', metavar='X,Y', type=_point, help='[m]; with --demo-bag the end of the drive')
    add('--demo-start', metavar='X,Y', type=_point, action='append', default=[],
        help='[m]; once for every demonstration; trials with fixed starts start at the first')
    add('--teacher', choices=_TEACHERS, default='shortest',
        help='shortest: knows the map; blind: drives straight through the open workspace, and its '
             'local grid is that of the open workspace; detour: knows the map and goes 1.3 to 2 '
             'times as far (default: shortest)')
    add('--demo-steps', metavar='N', type=_count(1, 1_000_000),
        help='show a random way without loops of exactly N steps, instead of a teacher')
    add('--demo-bag', metavar='BAG', help='take the demonstration from a bag')
    add('--max-speed', metavar='M/S', type=speed, default=SPEED_MAX,
        help=f'with --demo-bag: a drive that is faster is no robot (default: {SPEED_MAX:g} m/s)')
    add('--trials', metavar='K', type=_count(0, 100_000), default=10,
        help='how often the robot tries after it was shown the way (default: 10)')
    add('--starts', choices=('spread', 'fixed'), default='spread',
        help='where trials start: where they teach most, or where the first demonstration does '
             '(default: spread)')
    add('--judge-every', metavar='N', type=_count(1, 100_000), default=1,
        help='judge after 0, N, 2 N, ... and after all trials: large worlds have many starts '
             '(default: 1)')
    add('--start-radius', metavar='R', type=_distance, default=math.inf,
        help="judge only the cells at most so far from the first demonstration's start, [m]")


def _add_method(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add('--method', default='ours', help=f'one of {_METHODS} (default: ours)')
    add('--profile', choices=('paper', 'full'), default='full',
        help='paper: its equations to the letter; full: with what keeps its promise (default: '
             'full)')
    add('--corner-cutting', action='store_true',
        help='a diagonal step may pass a blocked cell beside it')
    add('--set', metavar='NAME=VALUE', action='append', default=[],
        help='any learning parameter; may be given several times')
    add('--seeds', metavar='N', type=_count(1, 100_000), default=20,
        help='how often all of it is done, each time with other chances (default: 20)')
    add('--seed0', metavar='S', type=_count(0, 2**62), default=0,
        help='the first seed (default: 0)')
    add('--jobs', metavar='J', type=_count(1, 1024), default=1,
        help='processes; the results do not depend on it (default: 1)')


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--json', metavar='OUT', help='write the report; - for standard output')
    parser.add_argument('--save-field', metavar='FIELD.npz',
                        help='write the field of the first seed after all trials')


def _numbers(text: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(',')]
    except ValueError:
        numbers = []
    return [number for number in numbers if math.isfinite(number)]


def _point(text: str) -> tuple[float, float]:
    numbers = _numbers(text)
    if len(numbers) != 2 or text.count(',') != 1:
        raise argparse.ArgumentTypeError(f'{text!r} is no point, write it as X,Y in metres')
    return numbers[0], numbers[1]


def _distance(text: str) -> float:
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] < 0.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no distance, must be 0 m or more')
    return numbers[0]


def _count(low: int, high: int) -> Any:
    def count(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = low - 1
        if not low <= number <= high:
            raise argparse.ArgumentTypeError(
                f'{text!r} must be a whole number from {low} to {high}')
        return number

    return count


def run(arguments: argparse.Namespace) -> int:
    """
    Evaluate.

    Raises
    ------
    UserError
        If the world, a place, a parameter or a path to write to is wrong.

    """
    report_file, field_file = _outputs(arguments)
    experiment = _experiment(arguments)
    _check_not_the_world(arguments.world, report_file, field_file)
    seeds = range(arguments.seed0, arguments.seed0 + arguments.seeds)
    courses, lost = _courses(experiment, seeds, arguments.jobs)
    # It takes a second to load what the evaluation needs: not before the arguments are right.
    from experience_evaluation.field_file import npz_bytes
    from experience_evaluation.report import report, table
    result = report(experiment, courses, arguments.world, arguments.demo_bag, lost)
    text = json.dumps(result, indent=1, allow_nan=False)
    if report_file is not None:
        report_file.write((text + '\n').encode())
    if field_file is not None:
        field_file.write(npz_bytes(courses[0].field))
    print(text if arguments.json == '-' else table(result, _COLUMNS))
    return 1 if lost else 0


def _courses(experiment: 'Experiment', seeds: Sequence[int], n_jobs: int,
             ) -> 'tuple[list[Course], list[int]]':
    """Return what the seeds came to, and those that were killed whatever was done."""
    from experience_evaluation.teachers import NoWayError
    from experience_evaluation.workers import LostError, run_all
    try:
        return run_all([(experiment, seed) for seed in seeds], n_jobs, 'evaluate'), []
    except LostError as error:
        lost = [seeds[index] for index in error.lost]
        if not error.courses:
            raise UserError(f'{error}: not one seed is finished, try --jobs 1') from error
        print(f'experience evaluate: {error}: the report is without the seeds '
              f'{", ".join(map(str, lost))}, try --jobs 1', file=sys.stderr)
        return error.courses, lost
    except NoWayError as error:
        how = (f'--teacher {experiment.teacher}' if experiment.demo_steps is None
               else f'--demo-steps {experiment.demo_steps}')
        where = '' if error.start is None else (
            f' (--demo-start {_text(experiment.grid, error.start)})')
        raise UserError(f'{how}: {error}{where}') from error


def _outputs(arguments: argparse.Namespace) -> 'tuple[Output | None, Output | None]':
    """Return where the report and the field go; that they can is looked at before any work."""
    from experience_cli.output import Output
    names = (None if arguments.json == '-' else arguments.json, '--json'), (
        arguments.save_field, '--save-field')
    paths = [Path(name).resolve() for name, _ in names if name]
    if len(paths) == 2 and paths[0] == paths[1] and not paths[0].is_char_device():
        raise UserError(f'--json and --save-field both name {names[0][0]}, name two files')
    report_file, field_file = (
        None if name is None else Output(name, option) for name, option in names)
    return report_file, field_file


def _check_not_the_world(world: str, *outputs: 'Output | None') -> None:
    from world_maps.world import find_world
    for path in (output.path for output in outputs if output is not None):
        if path.exists() and path.samefile(find_world(world)):
            raise UserError(f'{path}: is the world itself, name another file to write to')


def _parameters(arguments: argparse.Namespace) -> Parameters:
    kinds = {spec.name: spec.type for spec in fields(Parameters)}
    values: dict[str, Any] = {'profile': arguments.profile,
                              'corner_cutting': arguments.corner_cutting}
    for text in arguments.set:
        name, equals, value = text.partition('=')
        if not equals:
            raise UserError(f'--set {text}: write it as NAME=VALUE')
        if name in ('seed', 'profile'):
            raise UserError(f'--set {name}: it is chosen with '
                            f'{"--seeds and --seed0" if name == "seed" else "--profile"}')
        values[name] = _value(value, str(getattr(kinds.get(name), '__name__', kinds.get(name))))
    try:
        return Parameters.from_mapping(values)
    except ValueError as error:
        raise UserError(f'--set: {error}') from error


def _value(text: str, kind: str) -> Any:
    """Read a value as its parameter's type; what does not fit is left for Parameters to refuse."""
    if kind == 'bool':
        return {'true': True, '1': True, 'false': False, '0': False}.get(text.lower(), text)
    if kind in ('int', 'float'):
        try:
            return int(text) if kind == 'int' else float(text)
        except ValueError:
            return text
    return text


def _experiment(arguments: argparse.Namespace) -> 'Experiment':
    from experience_evaluation.experiment import Experiment
    from experience_evaluation.methods.registry import METHODS
    from world_maps.world import find_world, load_world, WorldError
    if arguments.method not in METHODS:
        raise UserError(f'--method {arguments.method}: there is no such method, there are: '
                        f'{", ".join(METHODS)}')
    parameters = _parameters(arguments)
    if arguments.demo_steps is not None and arguments.teacher != 'shortest':
        raise UserError(f'--teacher {arguments.teacher}: --demo-steps shows a random way instead '
                        f'of a teacher, leave out one of them')
    try:
        world = load_world(find_world(arguments.world))
    except WorldError as error:
        raise UserError(f'--world {error}') from error
    for note in world.notes:
        print(f'experience evaluate: --world {note}', file=sys.stderr)
    demonstrations: tuple[Demonstration, ...] = ()
    starts = [_cell(world.grid, point, '--demo-start') for point in arguments.demo_start]
    _check_reading(arguments)
    if arguments.demo_bag:
        demonstrations = (_demonstration(arguments, world.grid),)
        cells = demonstrations[0].cells
        goal = (int(cells[-1, 0]), int(cells[-1, 1]))
        starts = starts or [(int(cells[0, 0]), int(cells[0, 1]))]
        if arguments.goal and _cell(world.grid, arguments.goal, '--goal') != goal:
            raise UserError(f'--goal: the drive in {arguments.demo_bag} ends elsewhere, at '
                            f'{_text(world.grid, goal)}; leave --goal out')
    elif not arguments.goal or not starts:
        raise UserError('--goal X,Y and --demo-start X,Y are needed (or --demo-bag BAG)')
    else:
        goal = _cell(world.grid, arguments.goal, '--goal')
    experiment = Experiment(
        world.grid, world.occupancy, goal, starts, arguments.trials,
        arguments.starts == 'spread', arguments.teacher, arguments.method, parameters,
        demonstrations, arguments.start_radius, arguments.demo_steps,
        _judged_after(arguments.trials, arguments.judge_every))
    _check_places(experiment)
    return experiment


def _judged_after(n_trials: int, every: int) -> tuple[int, ...]:
    return (*range(0, n_trials, every), n_trials)


def _cell(grid: Grid, point: tuple[float, float], option: str) -> tuple[int, int]:
    try:
        row, col = grid.cell_from_world(*point)
    except ValueError:  # so far away that there are no numbers
        row, col = -1, -1
    if not grid.contains(row, col):
        right = grid.origin_x + grid.n_cols * grid.resolution
        top = grid.origin_y + grid.n_rows * grid.resolution
        raise UserError(f'{option} {point[0]:g},{point[1]:g}: lies outside the world, which '
                        f'reaches from {grid.origin_x:g},{grid.origin_y:g} to {right:g},{top:g}')
    return row, col


def _text(grid: Grid, cell: tuple[int, int]) -> str:
    x, y = grid.world_from_cell(*cell)
    return f'{x:g},{y:g}'


def _check_places(experiment: 'Experiment') -> None:
    """Refuse a goal or start that is blocked, and starts that lead nowhere."""
    grid, goal = experiment.grid, experiment.goal
    if experiment.occupancy[goal] != 0:
        raise UserError(f'--goal {_text(grid, goal)}: that cell is blocked, choose a free one')
    reachable = experiment.reachable()
    for start in experiment.demo_starts:
        where = f'--demo-start {_text(grid, start)}'
        if experiment.occupancy[start] != 0:
            raise UserError(f'{where}: that cell is blocked, choose a free one')
        if not reachable[start]:
            raise UserError(f'{where}: no way leads from there to the goal {_text(grid, goal)}')
        if start == goal:
            raise UserError(f'{where}: that is the goal itself, start in another cell')


def _check_reading(arguments: argparse.Namespace) -> None:
    """Refuse options that say how a bag is to be read where there is none."""
    from experience_cli.reading import READING
    for option in () if arguments.demo_bag else (*READING, 'frame'):
        if getattr(arguments, option) is not None:
            raise UserError(f'--{option.replace("_", "-")}: says how a bag is to be read, name it '
                            f'with --demo-bag')


def _demonstration(arguments: argparse.Namespace, grid: Grid) -> 'Demonstration':
    from dataclasses import replace

    from episode_store.episode import OutsideDriveError
    from episode_store.external.drive import open_drive
    from episode_store.external.take_over import learnt_from
    from experience_cli.bag_argument import named_path
    from experience_cli.reading import guessed, reading_of
    bag = str(named_path(Path(arguments.demo_bag)))
    if not Path(bag).exists():
        raise UserError(f'--demo-bag {bag}: there is no such bag, check the path')
    grid = replace(grid, frame_id=arguments.frame or grid.frame_id)
    try:
        drive = open_drive(bag, grid, reading_of(arguments))
        demonstration, report, notes = learnt_from(drive, grid, speed_max=arguments.max_speed)
    except OutsideDriveError as error:
        raise UserError(f'--demo-bag {error}; it was driven in another world') from error
    said = [f'--demo-bag {bag}: {report}', *guessed(drive, arguments), *notes]
    print('; '.join(said), file=sys.stderr)
    return demonstration
