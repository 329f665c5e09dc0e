"""Bags that others recorded, as demonstrations: for `experience learn`."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
import math
from pathlib import Path
from typing import Any, Final

from experience_cli.errors import UserError
from experience_cli.reading import add_reading_options, guessed, READING, reading_of

#: Options that describe the workspace, and what they are where nothing is said.
_WORKSPACE: Final[dict[str, Any]] = {
    'rows': 20, 'cols': 20, 'resolution': 0.25, 'origin': (0.0, 0.0), 'frame': 'odom'}


def add_options(parser: argparse.ArgumentParser, keeping: bool = False) -> None:
    """Add the options that say how a bag of another recorder is to be read, and kept."""
    group = parser.add_argument_group(
        'bags of other recorders', 'Drives that were recorded by `ros2 bag record`, `rosbag '
        'record` or the like, MCAP, sqlite3 or ROS 1; each is one demonstration.')
    add_reading_options(group)
    group.add_argument('--rows', type=int, metavar='N', help='of the workspace (20)')
    group.add_argument('--cols', type=int, metavar='N', help='of the workspace (20)')
    group.add_argument('--resolution', type=float, metavar='M', help='side of a cell (0.25 m)')
    group.add_argument('--origin', type=float, nargs=2, metavar=('X', 'Y'),
                       help='lower left corner of the workspace (0 0)')
    group.add_argument('--frame', metavar='NAME',
                       help='of the workspace; /tf takes the poses there, if it can (odom)')
    group.add_argument('--max-speed', type=speed, metavar='M/S',
                       help='a drive that is faster is no robot: not learnt (3 m/s, or of --like)')
    group.add_argument('--like', type=Path, metavar='BAG',
                       help='workspace and parameters are those of this bag, or task')
    if keeping:
        group.add_argument('--into', type=Path, metavar='TASK_FOLDER',
                           help='keep each as the next demonstration of a task, and relearn that')
        group.add_argument('--new-task', action='store_true',
                           help='begin a task also where its name is nearly that of another one')


def is_wanted(arguments: argparse.Namespace) -> bool:
    """Tell whether the bags are said to be those of other recorders."""
    return bool(wanted_option(arguments))


def wanted_option(arguments: argparse.Namespace) -> str:
    """Return the first option that says so, as it is written; empty for none."""
    options = (*READING, *_WORKSPACE, 'like', 'into', 'max_speed')
    return next((f'--{option.replace("_", "-")}' for option in options
                 if getattr(arguments, option, None) is not None), '')


def learn_external(arguments: argparse.Namespace) -> Any:
    """
    Learn the bags one after the other, without keeping them; return the learner.

    Raises
    ------
    UserError, BagError
        If an argument is wrong, or a bag cannot be read or teaches nothing.

    """
    from control_field.learning.learner import Learner
    from control_field.words import counted, sentences
    from episode_store.external.drive import open_drive
    from episode_store.external.take_over import learnt_from
    from episode_store.relearn import goal_moved

    _check_one_cut(arguments)
    header = _header(arguments, None)
    learner = Learner(header.grid, header.parameters)
    for number, path in enumerate(arguments.bags, start=1):
        with _remedy_named():
            drive = open_drive(_there(path), header.grid, reading_of(arguments))
            demonstration, report, notes = learnt_from(
                drive, header.grid, number, header.speed_max)
        before = learner.refresh
        certificate = learner.add_demonstration(demonstration).certificate
        if not arguments.quiet:
            print(sentences([
                f'{path} is learnt: {counted(report.n_steps, "step")}',
                goal_moved(before, learner.refresh), *report.sentences(),
                *guessed(drive, arguments), *notes, certificate.sentence()]))
        if arguments.verbose and not arguments.quiet:
            print(f'    in numbers: {report.numbers()}; {certificate.numbers()}')
    return learner


def import_all(arguments: argparse.Namespace) -> Path:
    """
    Keep the bags as demonstrations of a task; return the task's folder.

    Raises
    ------
    UserError, BagError
        If an argument is wrong, or a bag cannot be read, teaches nothing or cannot be kept.

    """
    for drive, episode in take_over(arguments):
        if not arguments.quiet:
            print('; '.join([f'{drive.path} is kept as {episode.path}',
                             *guessed(drive, arguments), *drive.notes]))
    return Path(arguments.into.absolute())


def take_over(arguments: argparse.Namespace) -> list[tuple[Any, Any]]:
    """
    Keep the bags as demonstrations of a task; return each as `ExternalDrive` and `EpisodeFolder`.

    Raises
    ------
    UserError, BagError
        See `import_all`.

    """
    from dataclasses import replace

    from episode_store.external.take_over import check_drive, import_demonstration
    from episode_store.making import NewBags
    from episode_store.task_folder import changing, TaskFolder

    _check_no_bag(arguments.into)
    _check_one_cut(arguments)
    folder = arguments.into.absolute()
    task = TaskFolder(folder.parent, folder.name)
    if not arguments.new_task:
        _check_is_meant(task, arguments.into)
    with changing(task.path, make=True):
        header = _header(arguments, task)
        # All of them before the first is kept: half of them is not what was asked for.
        reading = reading_of(arguments)
        with _remedy_named():
            drives = [check_drive(_there(path), header.grid, reading, header.speed_max)
                      for path in arguments.bags]
        with NewBags(task) as bags:
            for drive in drives:
                import_demonstration(drive, bags, replace(header, task=task.task))
            return list(zip(drives, bags.keep(), strict=True))


def _check_is_meant(task: Any, into: Path) -> None:
    """Refuse a new task whose name is nearly that of an old one beside it."""
    from episode_store.task_names import check_is_meant

    try:
        check_is_meant(task, f'--into {into.parent}/{{}}, or --new-task if a new one is meant')
    except ValueError as error:
        raise UserError(f'--into {into}: {error}') from None


@contextmanager
def _remedy_named() -> Iterator[None]:
    """Where poses are in another frame, or outside, say which options take that."""
    from episode_store.episode import OutsideDriveError
    from episode_store.rosbag2.errors import BagError
    from msgs_bridge.messages.frame_hints import other_frame

    try:
        yield
    except OutsideDriveError as error:
        raise BagError(f'{error}{_options_that_fit(error.fitting)}') from None
    except BagError as error:
        frame = other_frame(str(error))
        if not frame:
            raise
        raise BagError(
            f'{error}; if that is the right one, learn it with --frame {frame}') from None


def _options_that_fit(grid: Any) -> str:
    """Say with which options a drive that leaves the workspace can be learnt."""
    if grid is None:
        return ''
    return (f'; learn it in a workspace of its own, with --rows {grid.n_rows} --cols '
            f'{grid.n_cols} --resolution {grid.resolution:g} --origin {grid.origin_x:g} '
            f'{grid.origin_y:g} --frame {grid.frame_id} (and without --like or an --into that has '
            f'another)')


def _check_no_bag(folder: Path) -> None:
    """Refuse to keep bags in a bag, or where the task around would take the folder for one."""
    from episode_store.rosbag2.bag_files import storage_files
    from episode_store.rosbag2.errors import BagError
    from episode_store.rosbag2.metadata import NAME
    from episode_store.task_folder import episode_from_path

    where = folder.absolute()
    for path in (where, where.parent):
        with suppress(BagError):
            episode_from_path(path)
            raise UserError(f'--into {folder}: {path.name} is a bag, name the folder of a task, '
                            f'such as {path.parent}')
    held = [where / NAME, *storage_files(where)] if where.is_dir() else []
    for file in held:
        if file.exists():
            raise UserError(f'--into {folder}: it is a bag, {file.name} is in it; name the folder '
                            f'of a task')


def _check_one_cut(arguments: argparse.Namespace) -> None:
    """Refuse to cut several drives at the same second."""
    for option in ('from', 'to'):
        if len(arguments.bags) > 1 and getattr(arguments, option) is not None:
            raise UserError(f'--{option}: name one bag, the seconds are those of its drive')


def _there(path: Path) -> Path:
    if not path.exists():
        raise UserError(f'there is no bag {path}')
    return path


def _header(arguments: argparse.Namespace, task: Any) -> Any:
    """Return the header of a demonstration in the workspace that the arguments describe."""
    from control_field.drives.plausibility import SPEED_MAX
    from control_field.parameters import Parameters
    from episode_store.header import EpisodeHeader
    from episode_store.task_folder import EpisodeKind
    from episode_store.workspace import common_header
    from experience_cli.bag_selection import episodes_from_paths

    of_task = None if task is None else common_header(task.episodes())
    found = of_task if arguments.like is None else common_header(
        episodes_from_paths([arguments.like]))
    if found is None:
        # A field that it is to be compared with.
        other = None if _is_described(arguments) else getattr(arguments, 'field', None)
        grid, parameters = (_grid(arguments), Parameters()) if other is None else (
            other.field.grid, other.parameters)
        return EpisodeHeader(EpisodeKind.DEMO, '', grid, parameters,
                             speed_max=arguments.max_speed or SPEED_MAX)
    given = [f'--{name}' for name in _WORKSPACE if getattr(arguments, name) is not None]
    if given and found.grid != _grid(arguments):
        raise UserError(f'{given[0]}: the workspace is that of {arguments.like or task.path}, '
                        f'{found.grid}; leave the option out')
    if of_task is not None:
        of_task.check_grid(found.grid, task.path)
    return EpisodeHeader(EpisodeKind.DEMO, '', found.grid, found.parameters,
                         speed_max=arguments.max_speed or found.speed_max)


def _is_described(arguments: argparse.Namespace) -> bool:
    """Tell whether the options describe a workspace."""
    return any(getattr(arguments, name) is not None for name in _WORKSPACE)


def speed(text: str) -> float:
    """Read a speed in metres a second."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f'{text!r} is no speed, must be above 0 m/s')
    return value


def _grid(arguments: argparse.Namespace) -> Any:
    from control_field.grid import Grid

    values = {name: default if getattr(arguments, name) is None else getattr(arguments, name)
              for name, default in _WORKSPACE.items()}
    x, y = values['origin']
    try:
        return Grid(values['rows'], values['cols'], values['resolution'], x, y, values['frame'])
    except ValueError as error:
        raise UserError(f'the workspace makes no sense: {error}') from None
