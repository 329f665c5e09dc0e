"""Drives that other recorders recorded, taken over as demonstrations of a task."""

from collections.abc import Mapping
from dataclasses import replace
import math
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import BreakKind, ImplausibleDriveError
from control_field.drives.plausibility import DriveLimits, SPEED_MAX, whole_drive
from control_field.drives.workspace import OutsideWorkspaceError
from control_field.grid import Grid
from episode_store.drives import Drive, NoPoseError, read_drive, remedy_for_external
from episode_store.errors import OtherFrameError, OutsideDriveError
from episode_store.external.drive import ExternalDrive, open_drive, ReadOptions
from episode_store.external.workspace import Workspace
from episode_store.header import EpisodeHeader
from episode_store.making import NewBags
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag
from episode_store.rosbag2.topic_tables import pose_table, PoseTable
from episode_store.rosbag2.writer import BagWriter

#: A speed that lasts so long, [s], is no leap; a robot may be faster than it was, so many times.
_LASTING, _SPARE = 2.0, 1.25
#: From so many leaps on it is no accident; cells in which they may do no harm, [m].
_MANY: Final = 10
_SIDES: Final = (0.5, 1.0, 2.0)


def demonstration_from_drive(
    drive: ExternalDrive, number: int = 0, speed_max: float = SPEED_MAX,
) -> Drive:
    """
    Return what an external drive teaches in its workspace, what of it was dropped, and notes.

    Parameters
    ----------
    drive : ExternalDrive
    number : int
        Number of the episode it becomes.
    speed_max : float, [m/s]
        A robot that drives faster is none.

    Raises
    ------
    OutsideDriveError
        If it leaves the workspace.
    OtherFrameError
        If its poses are in another frame.
    BagError
        If it cannot be read, no robot can have driven so, or nothing is left to learn.

    """
    try:
        record, report, notes = read_drive(
            drive.bag, drive.topics, drive.grid, number, speed_max)
        return record, report, (*notes, *drive.notes)
    except ValueError as error:
        where = '' if isinstance(error, BagError) else f'{drive.path}: '
        why = _fitting_options(drive, error, speed_max) or (
            f'{error}{remedy_for_external(error, drive.begins)}')
        said = '; '.join([f'{where}{why}', *drive.notes])
        if isinstance(error, OutsideWorkspaceError):
            raise OutsideDriveError(said, error.fitting) from None
        if isinstance(error, NoPoseError) and error.frame:
            raise OtherFrameError(said, error.frame) from None
        raise BagError(said) from None


def _fitting_options(drive: ExternalDrive, error: ValueError, speed_max: float) -> str:
    """Say with which options a drive is whole that leaps as it is; empty if there are none."""
    if not isinstance(error, ImplausibleDriveError) or error.breaks[0].kind not in (
            BreakKind.LEAP, BreakKind.FAST):
        return ''
    poses, cell = _poses(drive), drive.grid.resolution
    fastest = _lasting_speed(poses.stamps, poses.xy)
    bounds = {speed_max, max(speed_max, float(math.ceil(_SPARE * fastest)))}
    larger = _SIDES if len(error.breaks) >= _MANY else ()
    for side in (cell, *(side for side in larger if side > cell)):
        for bound in sorted(bounds):
            if _is_whole(poses, DriveLimits(side, bound)):
                return _with_options(error, fastest, side if side > cell else None,
                                     (speed_max, bound))
    return ''


def _with_options(
    error: ImplausibleDriveError, fastest: float, side: float | None, bounds: tuple[float, float],
) -> str:
    said, options = [], []
    if bounds[1] > bounds[0]:
        said.append(f'it drives {fastest:.1f} m/s for seconds, and no robot is taken to be faster '
                    f'than {bounds[0]:g} m/s')
        options.append(f'--max-speed {bounds[1]:g}')
    if side is not None:
        farthest = max(found.distance for found in error.breaks)
        said.append(f'its places leap by up to {farthest:.2f} m, {len(error.breaks)} times, as a '
                    f'GPS or another localisation does that corrects itself, and are known no '
                    f'better than that')
        options.append(f'--resolution {side:g}')
    return (f'{"; ".join(said)}. If that is so, it is one drive with {" ".join(options)}')


def _is_whole(poses: PoseTable, limits: DriveLimits) -> bool:
    try:
        whole_drive(poses.stamps, poses.xy, limits, poses.motion)
    except ImplausibleDriveError:
        return False
    return True


def _poses(drive: ExternalDrive) -> PoseTable:
    return pose_table(drive.bag.messages(drive.topics['odom']), drive.grid.frame_id)


def _lasting_speed(
    stamps: npt.NDArray[np.float64], xy: npt.NDArray[np.float64],
) -> float:
    """Return the greatest speed of a drive for some seconds, [m/s]."""
    order = np.argsort(stamps, kind='stable')
    seconds = stamps[order] - stamps[order[:1]]
    edges = np.unique(np.searchsorted(seconds, np.arange(0.0, seconds[-1], _LASTING)))
    way = np.hypot(*np.diff(xy[order[edges]], axis=0).T)
    return float((way / np.maximum(np.diff(seconds[edges]), 1e-9)).max(initial=0.0))


def check_drive(
    path: Path | str, workspace: Workspace | Grid, reading: ReadOptions,
    speed_max: float = SPEED_MAX,
) -> ExternalDrive:
    """
    Make sure that an external bag teaches something in a workspace.

    Parameters
    ----------
    path : Path
        The external bag, see `any_reader.open_bag`.
    workspace : Workspace or Grid
    reading : ReadOptions
        How it is to be read.
    speed_max : float, [m/s]
        A robot that drives faster is none.

    Raises
    ------
    BagError
        If it cannot be read, or teaches nothing in that workspace.

    """
    drive = open_drive(path, workspace, reading)
    demonstration_from_drive(drive, speed_max=speed_max)
    return drive


def import_demonstration(drive: ExternalDrive, bags: NewBags, header: EpisodeHeader) -> None:
    """
    Write what matters of an external bag into the next bag of a task.

    What was recorded keeps its bytes; what was made of it (poses from `/tf`, local grid from
    scans) is written as it was made, so that the field stays a function of this bag.

    Parameters
    ----------
    drive : ExternalDrive
        Was checked; its workspace becomes the bag's.
    bags : NewBags
        Those in the making; it is one of the task once they are kept.
    header : EpisodeHeader
        Parameters of the new bag, and its task.

    Raises
    ------
    BagError
        If it cannot be read any more, or not be written.

    """
    values = replace(
        header, grid=drive.grid, fitted=drive.is_fitted, topics=drive.topics, memory='',
        imported_from=drive.path.name, imported_notes=drive.notes).to_mapping()
    _copy(drive.bag, drive.topics, bags.begin(header.kind, values))


def _copy(bag: Bag, topics: Mapping[str, str], writer: BagWriter) -> None:
    """Write the messages of some topics in the order they were recorded."""
    tables = [bag.messages(topic) for topic in sorted(set(topics.values()))]
    times = np.concatenate([table.log_times for table in tables])
    which = np.repeat(np.arange(len(tables)), [len(table) for table in tables])
    rows = np.concatenate([np.arange(len(table)) for table in tables])
    for place in np.argsort(times, kind='stable').tolist():
        table = tables[which[place]]
        writer.write(table.topic, table.type_name, table[int(rows[place])], int(times[place]))
