"""`experience evaluate`: how good is what is learnt, on any world, without ROS."""

import argparse
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial
import json
import math
from pathlib import Path
import sys
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from control_field.drives.plausibility import SPEED_MAX
from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.local_grid import FREE
from control_field.parameters import Parameters
from control_field.records import Demonstration
from episode_store.errors import OutsideDriveError
from episode_store.external.drive import open_drive
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.external.workspace import Workspace
from experience_cli.arguments import READING
from experience_cli.bag_argument import named_path
from experience_cli.errors import UserError
from experience_cli.external_bags import guessed, reading_of
from experience_cli.output import Output
from experience_cli.terminal import table_lines
from experience_cli.world_changes import check_changes, read_changes, read_script
from experience_evaluation.experiment import Experiment, LearningCurve
from experience_evaluation.field_file import npz_bytes
from experience_evaluation.methods.registry import METHODS
from experience_evaluation.report import report
from experience_evaluation.starts import nearest_cell
from experience_evaluation.teachers import NoWayError
from experience_evaluation.workers import LostError, run_all
from msgs_bridge.untrusted.text import printable
from world_maps.robot_cells import ROBOT_RADIUS
from world_maps.world import find_world, load_world, World, WorldError

#: Row and column.
Cell: TypeAlias = tuple[int, int]
#: Methods whose trials meet what moves.
MOVING = ('ours',)
_COLUMNS = ('field_success', 'success', 'success_spl', 'collisions', 'hidden_neurons', 'fidelity')


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
    for world in (arguments.world, *(name for _, name in arguments.change)):
        _check_not_the_world(world, report_file, field_file)
    seeds = range(arguments.seed0, arguments.seed0 + arguments.seeds)
    curves, lost = _curves(experiment, seeds, arguments.jobs)
    result = report(experiment, curves, arguments.world, arguments.demo_bag, lost)
    text = json.dumps(result, indent=1, allow_nan=False)
    if report_file is not None:
        report_file.write((text + '\n').encode())
    if field_file is not None:
        field_file.write(npz_bytes(curves[0].field))
    print(text if arguments.json == '-' else '\n'.join(_table(result)))
    return 1 if lost else 0


def _curves(
    experiment: Experiment, seeds: Sequence[int], n_jobs: int,
) -> tuple[list[LearningCurve], list[int]]:
    """Return what the seeds came to, and those that were killed whatever was done."""
    try:
        return run_all([(experiment, seed) for seed in seeds], n_jobs, 'evaluate'), []
    except LostError as error:
        lost = [seeds[index] for index in error.lost]
        if not error.curves:
            raise UserError(f'{error}: not one seed is finished, try --jobs 1') from error
        print(f'experience evaluate: {error}: the report is without the seeds '
              f'{", ".join(map(str, lost))}, try --jobs 1', file=sys.stderr)
        return error.curves, lost
    except NoWayError as error:
        how = (f'--teacher {experiment.teacher}' if experiment.demo_steps is None
               else f'--demo-steps {experiment.demo_steps}')
        where = '' if error.start is None else (
            f' (--demo-start {_text(experiment.grid, error.start)})')
        raise UserError(f'{how}: {error}{where}') from error


def _table(report_: dict[str, Any]) -> list[str]:
    """Return a report as a table for people: a line for each number of trials, and change."""
    entries = [(entry['trials'], 0, str(entry['trials']), entry) for entry in report_['after']]
    entries += [(entry['trials'], 1, f'{entry["trials"]}, now {entry["world"]}', entry)
                for entry in report_['at_changes']]
    columns = (*_COLUMNS, 'mover_contacts') if report_['config']['n_movers'] else _COLUMNS
    rows = [['trials', *columns]]
    rows += [[printable(when), *(_cell_text(entry[name]) for name in columns)]
             for _, _, when, entry in sorted(entries, key=lambda entry: entry[:2])]
    return table_lines(rows, range(len(rows[0])))


def _cell_text(summary: dict[str, Any]) -> str:
    if summary['median'] is None:
        return '-'
    if summary['low'] == summary['high']:
        return f'{summary["median"]:.4g}'
    return f'{summary["median"]:.4g} [{summary["low"]:.3g}, {summary["high"]:.3g}]'


def _outputs(arguments: argparse.Namespace) -> tuple[Output | None, Output | None]:
    """Return where the report and the field go; that they can is looked at before any work."""
    names = (None if arguments.json == '-' else arguments.json, '--json'), (
        arguments.save_field, '--save-field')
    paths = [Path(name).resolve() for name, _ in names if name]
    if len(paths) == 2 and paths[0] == paths[1] and not paths[0].is_char_device():
        raise UserError(f'--json and --save-field both name {names[0][0]}, name two files')
    report_file, field_file = (
        None if name is None else Output(name, option) for name, option in names)
    return report_file, field_file


def _check_not_the_world(world: str, *outputs: Output | None) -> None:
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


def _experiment(arguments: argparse.Namespace) -> Experiment:
    _check_method(arguments)
    parameters, world = _parameters(arguments), _world(arguments)
    _check_reading(arguments)
    goal, starts, demonstrations = _places(arguments, world, parameters)
    script, changes = read_script(arguments.movers, world, arguments.trials)
    if changes and arguments.change:
        raise UserError(f'--change: {arguments.movers} changes the world at trials too, name all '
                        f'changes in one place')
    experiment = Experiment(
        world.grid, world.occupancy, goal, starts, arguments.trials,
        arguments.starts == 'spread', arguments.teacher, arguments.method, parameters,
        demonstrations, arguments.start_radius, arguments.demo_steps,
        _judged_after(arguments.trials, arguments.judge_every),
        read_changes(arguments.change, world.grid, arguments.trials,
                     partial(_load, arguments)) or changes,
        arguments.sight, script)
    _check_places(experiment)
    check_changes(experiment)
    return experiment


def _check_method(arguments: argparse.Namespace) -> None:
    """Refuse a method that is none, and two ways to show the way at once."""
    if arguments.method not in METHODS:
        raise UserError(f'--method {arguments.method}: there is no such method, there are: '
                        f'{", ".join(METHODS)}')
    if arguments.movers is not None and arguments.method not in MOVING:
        raise UserError(f'--method {arguments.method}: does not know things that move, with '
                        f'--movers there are: {", ".join(MOVING)}')
    if arguments.demo_steps is not None and arguments.teacher != 'shortest':
        raise UserError(f'--teacher {arguments.teacher}: --demo-steps shows a random way instead '
                        f'of a teacher, leave out one of them')


def _load(arguments: argparse.Namespace, name: str) -> World:
    """Read a world, its cells as large as they are asked for; WorldError says what is wrong."""
    radius = ROBOT_RADIUS if arguments.robot_radius is None else arguments.robot_radius
    return load_world(find_world(name), robot_radius=radius, resolution=arguments.resolution)


def _world(arguments: argparse.Namespace) -> World:
    """Return the world; print what is to be known of it."""
    try:
        world = _load(arguments, arguments.world)
    except WorldError as error:
        raise UserError(f'--world {error}') from error
    for note in world.notes:
        _say(f'--world {note}')
    if world.drawn is not None:
        _say(f'--world {arguments.world}: {world.size}, for a robot of radius '
             f'{world.robot_radius:g} m (--robot-radius, --resolution)')
    return world


def _say(text: str) -> None:
    print(f'experience evaluate: {printable(text)}', file=sys.stderr)


def _places(
    arguments: argparse.Namespace, world: World, parameters: Parameters,
) -> tuple[Cell, list[Cell], tuple[Demonstration, ...]]:
    """Return the goal, the starts and what was demonstrated; UserError if one is missing."""
    grid = world.grid
    starts = [_cell(grid, point, '--demo-start') for point in arguments.demo_start]
    if not arguments.demo_bag:
        if not arguments.goal or not starts:
            raise UserError('--goal X,Y and --demo-start X,Y are needed (or --demo-bag BAG)')
        free = world.occupancy == FREE
        goal = _free_cell(grid, free, _cell(grid, arguments.goal, '--goal'), '--goal')
        ways = np.isfinite(GridWorld(world.occupancy, parameters).cost_to(goal))
        ways[goal] = False
        return goal, [start if free[start] else _free_cell(grid, ways, start, '--demo-start')
                      for start in starts], ()
    demonstration = _demonstration(arguments, grid)
    start, goal = ((int(row), int(col)) for row, col in demonstration.cells[[0, -1]])
    if arguments.goal and _cell(grid, arguments.goal, '--goal') != goal:
        raise UserError(f'--goal: the drive in {arguments.demo_bag} ends elsewhere, at '
                        f'{_text(grid, goal)}; leave --goal out')
    return goal, starts or [start], (demonstration,)


def _free_cell(grid: Grid, free: npt.NDArray[np.bool_], cell: Cell, option: str) -> Cell:
    """Return the nearest of some free cells, and say so if it is another one."""
    nearest = nearest_cell(free, cell)
    if nearest is None:
        raise UserError(f'{option} {_text(grid, cell)}: that cell is blocked, and there is no '
                        f'free one' + (' with a way to the goal' if option != '--goal' else ''))
    if nearest != cell:
        away = math.dist(nearest, cell) * grid.resolution
        _say(f'{option} {_text(grid, cell)}: that cell is blocked; taken is the nearest free one, '
             f'{_text(grid, nearest)}, {away:.2g} m away')
    return nearest


def _judged_after(n_trials: int, every: int) -> tuple[int, ...]:
    return (*range(0, n_trials, every), n_trials)


def _cell(grid: Grid, point: tuple[float, float], option: str) -> Cell:
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


def _text(grid: Grid, cell: Cell) -> str:
    x, y = grid.world_from_cell(*cell)
    return f'{x:g},{y:g}'


def _check_places(experiment: Experiment) -> None:
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
    for option in () if arguments.demo_bag else (*READING, 'frame'):
        if getattr(arguments, option) is not None:
            raise UserError(f'--{option.replace("_", "-")}: says how a bag is to be read, name it '
                            f'with --demo-bag')


def _demonstration(arguments: argparse.Namespace, grid: Grid) -> Demonstration:
    bag = str(named_path(Path(arguments.demo_bag)))
    if not Path(bag).exists():
        raise UserError(f'--demo-bag {bag}: there is no such bag, check the path')
    workspace = Workspace(replace(grid, frame_id=arguments.frame or grid.frame_id),
                          any_frame=arguments.frame is None)
    try:
        drive = open_drive(bag, workspace, reading_of(arguments))
        demonstration, report, notes = demonstration_from_drive(
            drive, speed_max=arguments.max_speed or SPEED_MAX)
    except OutsideDriveError as error:
        raise UserError(f'--demo-bag {error}; it was driven in another world') from error
    said = [f'--demo-bag {bag}: {report}', *guessed(drive, arguments), *notes]
    print('; '.join(said), file=sys.stderr)
    return demonstration
