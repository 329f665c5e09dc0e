"""Drives that other recorders recorded, taken over as demonstrations of a task."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from control_field.drives.plausibility import SPEED_MAX
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
from episode_store.rosbag2.writer import BagWriter


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
        said = '; '.join([f'{where}{error}{remedy_for_external(error, drive.begins)}',
                          *drive.notes])
        if isinstance(error, OutsideWorkspaceError):
            raise OutsideDriveError(said, error.fitting) from None
        if isinstance(error, NoPoseError) and error.frame:
            raise OtherFrameError(said, error.frame) from None
        raise BagError(said) from None


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
