"""Bags of other recorders: how they are read, kept as demonstrations, or only looked into."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
import math
from pathlib import Path
import re
import shlex
import sys
from tempfile import TemporaryDirectory
from typing import Any

from control_field.grid import cell_side, default_lattice, Grid
from control_field.parameters import Parameters
from episode_store.errors import OtherFrameError, OutsideDriveError
from episode_store.external.drive import ExternalDrive, ReadOptions
from episode_store.external.import_drive import check_drive, import_demonstration
from episode_store.external.span import Span
from episode_store.external.workspace import Workspace
from episode_store.header import EpisodeHeader
from episode_store.lock import changing
from episode_store.making import NewBags
from episode_store.rosbag2.bag_files import storage_files
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.metadata import NAME
from episode_store.task_folder import (
    episode_from_path, EpisodeFolder, EpisodeKind, is_named_like_own, TaskFolder)
from episode_store.workspaces import check_workspaces
from experience_cli.arguments import READING, ROBOT_RADIUS, TOPICS, WORKSPACE
from experience_cli.bag_argument import (
    episodes_from_paths, find_readable_bag, is_external)
from experience_cli.bag_summary import grid_text
from experience_cli.errors import UserError
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.local_grid_from_scan import Body


def wanted_option(arguments: argparse.Namespace) -> str:
    """Return the first option that is only for bags of other recorders; empty if none is given."""
    options = (*READING, *WORKSPACE, 'like', 'into', 'max_speed')
    return next((_option(name) for name in options
                 if getattr(arguments, name, None) is not None), '')


def _option(name: str) -> str:
    """Return the option that an argument comes from."""
    return f'--{name.replace("_", "-").replace("cell-radius", "robot-radius")}'


def _radius(arguments: argparse.Namespace) -> float | None:
    """Return the robot's radius, [m], if it is given; a command may ask for it anyway."""
    given: float | None = getattr(arguments, 'cell_radius', None)
    return given or getattr(arguments, 'robot_radius', None)


def reading_of(arguments: argparse.Namespace) -> ReadOptions:
    """
    Return how a bag is to be read.

    Raises
    ------
    UserError
        If a number is none.

    """
    names = {role: getattr(arguments, option) for role, option in TOPICS.items()}
    values: dict[str, Any] = {
        'names': {role: name for role, name in names.items() if name is not None},
        'base_frame': arguments.base_frame or '',
        'zero_is_no_return': bool(arguments.zero_is_no_return)}
    if arguments.laser is not None:
        if not all(map(math.isfinite, arguments.laser)):
            raise UserError('--laser: must be six finite numbers')
        x, y, z, roll, pitch, yaw = arguments.laser
        values['mount'] = Mount(x, y, yaw, z, roll, pitch)
    if body_radius := arguments.body_radius or _radius(arguments):
        values['body'] = Body(body_radius)
    first, last = getattr(arguments, 'from'), arguments.to
    if first is not None or last is not None:
        values['span'] = _span(0.0 if first is None else first, math.inf if last is None else last)
    return ReadOptions(**values)


def _span(first: float, last: float) -> Span:
    if not 0.0 <= first < last:
        raise UserError(f'--from {first:g} --to {last:g}: --from must be 0 or more, --to after it')
    return Span(first, last)


def guessed(drive: ExternalDrive, arguments: argparse.Namespace) -> list[str]:
    """Return a note on the topic that was taken for odom by its type alone, if it was."""
    odom = drive.read_from
    is_named = arguments.odom_topic is not None or odom.rpartition('/')[2] in ('odom', 'tf')
    is_named |= any(note.startswith('odom is ') for note in drive.notes)
    return [] if is_named else [f'odom is {odom}, the only one of its type']


def there(path: Path) -> Path:
    """Return a path; UserError if there is nothing."""
    if not path.exists():
        raise UserError(f'there is no bag {path}')
    return path


def check_one_cut(arguments: argparse.Namespace) -> None:
    """Refuse to cut several drives at the same second."""
    for option in ('from', 'to'):
        if len(arguments.bags) > 1 and getattr(arguments, option) is not None:
            raise UserError(f'--{option}: name one bag, the seconds are those of its drive')


@contextmanager
def remedy_named(arguments: argparse.Namespace) -> Iterator[None]:
    """Add what would help to an error about a frame or a workspace."""
    try:
        yield
    except OutsideDriveError as error:
        raise BagError(f'{error}; without --rows, --cols, --origin and --like it is learnt in '
                       f'one that fits it') from None
    except OtherFrameError as error:
        # Without --frame it is that of the task, or of the bag before.
        remedy = ('all bags of a task are of one frame: learn it alone, or keep it in a task of '
                  'its own' if arguments.frame is None else 'if that is the right one, learn it '
                  f'with --frame {error.frame}')
        raise BagError(f'{error}; {remedy}') from None


def demo_header(
    arguments: argparse.Namespace, task: TaskFolder | None,
) -> tuple[EpisodeHeader, Workspace]:
    """
    Return the header of a demonstration, and the workspace that the arguments ask for.

    Parameters
    ----------
    arguments : Namespace
    task : TaskFolder or None
        Whose next demonstration it becomes.

    """
    of_task = None if task is None else _common_header(task.episodes())
    found = of_task if arguments.like is None else _common_header(
        episodes_from_paths([arguments.like]))
    if found is None:
        # A field that it is to be compared with.
        other = None if _is_described(arguments) else getattr(arguments, 'field', None)
        workspace, parameters = (_workspace(arguments), Parameters()) if other is None else (
            Workspace(other.field.grid), other.parameters)
        found = EpisodeHeader(EpisodeKind.DEMO, '', workspace.grid, parameters)
    else:
        _check_same(arguments, found, str(arguments.like or (task and task.path)))
        workspace = Workspace(found.grid, found.fitted)
        if task is not None and of_task is not None and not workspace.is_fitted:
            of_task.check_grid(found.grid, task.path)
    speed_max = arguments.max_speed or found.speed_max
    header = EpisodeHeader(EpisodeKind.DEMO, '', found.grid, found.parameters,
                           speed_max=speed_max, fitted=workspace.is_fitted)
    return header, replace(workspace, speed_max=speed_max)


def _check_same(arguments: argparse.Namespace, found: EpisodeHeader, whose: str) -> None:
    """Refuse options that describe another workspace than the one there is."""
    grid = found.grid
    there = {'resolution': grid.resolution, 'frame': grid.frame_id} if found.fitted else {
        'rows': grid.n_rows, 'cols': grid.n_cols, 'resolution': grid.resolution,
        'origin': [grid.origin_x, grid.origin_y], 'frame': grid.frame_id}
    for name in WORKSPACE:
        given = getattr(arguments, name, None)
        if given is not None and given != there.get(name):
            fits = ', which fits itself to its drives' if found.fitted else ''
            raise UserError(f'{_option(name)}: the workspace is that of {whose}, {grid}{fits}; '
                            f'leave the option out')


def _common_header(folders: list[EpisodeFolder]) -> EpisodeHeader | None:
    """Return the header of the last of some bags of one workspace; None if none holds anything."""
    return next(reversed(check_workspaces(folders)), None)


def _is_described(arguments: argparse.Namespace) -> bool:
    """Return whether the options describe a workspace."""
    return any(getattr(arguments, name, None) is not None for name in WORKSPACE)


def _workspace(arguments: argparse.Namespace) -> Workspace:
    """Return the workspace that the options describe, or one that fits itself to the drive."""
    if (arguments.rows is None) != (arguments.cols is None):
        given, other = ('rows', 'cols') if arguments.cols is None else ('cols', 'rows')
        raise UserError(f'--{given}: give --{other} as well, or neither: the workspace then fits '
                        f'the drive')
    if arguments.origin is not None and arguments.rows is None:
        raise UserError('--origin: give --rows and --cols as well, or none of them: the workspace '
                        'then fits the drive')
    radius, side = _radius(arguments), arguments.resolution
    any_lattice = radius is None and side is None
    if side is None:
        side = cell_side(radius or ROBOT_RADIUS)
    frame, (x, y) = arguments.frame or 'odom', arguments.origin or (0.0, 0.0)
    try:
        grid = default_lattice(side, frame) if arguments.rows is None else Grid(
            arguments.rows, arguments.cols, side, x, y, frame)
    except ValueError as error:
        raise UserError(f'the workspace makes no sense: {error}') from None
    return Workspace(grid, arguments.rows is None, arguments.frame is None, any_lattice)


def import_all(arguments: argparse.Namespace) -> list[tuple[ExternalDrive, EpisodeFolder]]:
    """
    Keep the bags as demonstrations of the task ``into``; return each, and what it is kept as.

    Raises
    ------
    UserError, BagError
        If an argument is wrong, or a bag cannot be read, teaches nothing or cannot be kept.

    """
    _check_no_bag(arguments.into)
    check_one_cut(arguments)
    folder = arguments.into.absolute()
    task = TaskFolder(folder.parent, folder.name)
    if not arguments.new_task:
        _check_is_meant(task, arguments.into)
    with changing(task.path, make=True):
        header, workspace = demo_header(arguments, task)
        # All of them before the first is kept: half of them is not what was asked for.
        reading, drives = reading_of(arguments), list[ExternalDrive]()
        with remedy_named(arguments):
            for path in arguments.bags:
                drives.append(_checked(arguments, there(path), workspace, reading))
                # All of a task are of one frame.
                workspace = replace(workspace, grid=drives[-1].grid, any_frame=False,
                                    any_lattice=False, is_fitted=drives[-1].is_fitted)
        with NewBags(task) as bags:
            for drive in drives:
                import_demonstration(drive, bags, replace(header, task=task.task))
            return list(zip(drives, bags.keep(), strict=True))


def _checked(
    arguments: argparse.Namespace, path: Path, workspace: Workspace, reading: ReadOptions,
) -> ExternalDrive:
    """Check a drive; let the workspace that a task has grow, unless one was asked for."""
    try:
        return check_drive(path, workspace, reading, workspace.speed_max)
    except OutsideDriveError:
        if arguments.like is not None or _is_described(arguments):
            raise
    drive = check_drive(path, replace(workspace, is_fitted=True), reading, workspace.speed_max)
    note = (f'it leaves the workspace there was, {grid_text(workspace.grid)}, which fits itself '
            f'from now on')
    return replace(drive, notes=(*drive.notes, note))


def _check_is_meant(task: TaskFolder, into: Path) -> None:
    """Refuse a new task whose name is nearly that of an old one beside it."""
    try:
        task.check_is_meant(f'--into {into.parent}/{{}}, or --new-task if a new one is meant')
    except ValueError as error:
        raise UserError(f'--into {into}: {error}') from None


def _check_no_bag(folder: Path) -> None:
    """Refuse to keep bags in a bag, or where the task around would take the folder for one."""
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


@contextmanager
def bag_of(arguments: argparse.Namespace) -> Iterator[EpisodeFolder]:
    """
    Give the bag that a person names, which may be one of another recorder.

    Raises
    ------
    UserError, BagError
        If there is none, it cannot be read, or, of another recorder, teaches nothing.

    """
    path = Path(arguments.bag)
    if is_borrowed(arguments, path):
        with borrowed(arguments, path) as episode:
            yield episode
    else:
        yield find_readable_bag(arguments.bag, arguments.bags)


def is_borrowed(arguments: argparse.Namespace, path: Path) -> bool:
    """
    Return whether a bag is to be read as one of another recorder.

    Raises
    ------
    UserError
        If options say so of what is no path of a bag.

    """
    option = wanted_option(arguments)
    if option and not path.exists():
        raise UserError(f'{option}: says how a bag of another recorder is to be read, and there '
                        f'is no file or folder {path}')
    return bool(option) or is_external(path)


@contextmanager
def borrowed(arguments: argparse.Namespace, path: Path) -> Iterator[EpisodeFolder]:
    """Take a bag of another recorder over into a folder that is gone in the end; say from what."""
    with taken_over(arguments, [path]) as [(drive, episode)]:
        topics = ', '.join(f'{topic} ({n})' for topic, n in sorted(drive.recorded.items()))
        whose = (f'{path} is a bag of another recorder, read as `experience learn '
                 f'{shlex.quote(str(path))}` does')
        said = '; '.join([whose, *drive.notes, f'its topics: {topics}'])
        print(f'experience {arguments.command}: {said}', file=sys.stderr)
        yield episode


@contextmanager
def taken_over(
    arguments: argparse.Namespace, paths: list[Path],
) -> Iterator[list[tuple[ExternalDrive, EpisodeFolder]]]:
    """Keep bags of other recorders as a task in a folder that is gone in the end."""
    name = re.sub(r'[^A-Za-z0-9_-]+', '_', paths[0].resolve().stem)[:60]
    if is_named_like_own(Path(name)):  # which is no name of a task
        name = f'bag_{name}'
    with TemporaryDirectory() as folder:
        values = vars(arguments) | {'bags': paths, 'into': Path(folder) / name, 'new_task': True}
        yield import_all(argparse.Namespace(**values))
