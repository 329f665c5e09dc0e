"""Drives: what the poses and local grids of a bag show, if a robot can have driven so."""

from collections.abc import Mapping
from dataclasses import replace
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import BreakKind, ImplausibleDriveError
from control_field.drives.demonstration import (
    demonstration_from_poses, DemonstrationReport, seen_from, TooShortError)
from control_field.drives.workspace import OutsideWorkspaceError
from control_field.grid import Grid
from control_field.records import Demonstration
from control_field.words import counted
from episode_store.header import find_topic
from episode_store.rosbag2.reader import Bag
from episode_store.rosbag2.topic_tables import (
    local_grid_table, LocalGridTable, pose_table, PoseTable)
from episode_store.wide_local_grids import in_order

#: What lies on one side of these breaks is a drive of its own, if a person says so.
_CAN_BE_CUT: Final = (BreakKind.LEAP, BreakKind.UNSAID, BreakKind.TURNED, BreakKind.HOLE)

#: So few messages, and so short, [s], are no part of a drive; so far, [m], is driving meanwhile.
_FEW, _SOON, _SET_OFF = 3, 0.5, 0.05

#: A drive that is shorter is none in cells of any size, [m].
_SMALLEST: Final = 0.05

#: What a difference of stamps may be off, [0.01 s].
_ROUNDED: Final = 1e-4

#: A demonstration, what was dropped of it, and sentences on what was passed over.
Drive = tuple[Demonstration, DemonstrationReport, tuple[str, ...]]


class NoPoseError(ValueError):
    """
    A drive has no pose in it.

    Parameters
    ----------
    refusal : str
        Why the first message is none; empty if there is no message.
    frame : str
        The frame that it is in, if that is another one than the workspace's.

    """

    def __init__(self, refusal: str, frame: str) -> None:
        super().__init__('it has no pose in it' + (f': {refusal}' if refusal else ''))
        self.frame = frame


class LeadsNowhereError(ValueError):
    """
    A drive ends in the cell where it began.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    xy : ndarray, shape (n, 2), [m]

    """

    def __init__(
        self, stamps: npt.NDArray[np.float64], xy: npt.NDArray[np.float64],
    ) -> None:
        """Find where it is farthest away, in seconds from the first pose."""
        super().__init__('nothing to learn from this drive: it ends in the cell where it began, '
                         'so that it leads nowhere; end the drive at the goal')
        farthest = int(np.hypot(*(xy - xy[int(stamps.argmin())]).T).argmax())
        self.farthest = float(stamps[farthest] - stamps.min())


def read_drive(
    bag: Bag, names: Mapping[str, str], grid: Grid, number: int, speed_max: float,
    fitted: bool = False,
) -> Drive:
    """
    Turn the messages of a drive, whoever recorded it, into a demonstration.

    Parameters
    ----------
    bag : Bag
    names : mapping of str to str
        Topics by role, see `header.find_topic`.
    grid : Grid
    number : int
        Of the episode.
    speed_max : float, [m/s]
        The robot is no faster.
    fitted : bool
        Whether the workspace fits itself: the cells of the demonstration are those of ``grid``,
        and go on outside it.

    Raises
    ------
    BagError
        If it is not known which topic plays a role.
    NoPoseError
        If there is no pose.
    ValueError
        If no robot can have driven so, or nothing is left to learn.

    """
    odometry, neighbourhoods = (bag.messages(find_topic(bag.topics, role, names))
                                for role in ('odom', 'neighbourhood'))
    poses = pose_table(odometry, grid.frame_id)
    local_grids = local_grid_table(neighbourhoods, grid, fitted)
    notes = tuple(f'{counted(table.n_refused, "message")} refused, the first: {table.refusal}'
                  for table in (poses, local_grids) if table.n_refused)
    if not len(poses.stamps):
        raise NoPoseError(poses.refusal, poses.other_frame)
    _check_ends(poses)
    seen = in_order(local_grids.stamps)
    record, report = demonstration_from_poses(
        grid, poses.stamps, poses.xy, local_grids.stamps[seen], local_grids.blocked[seen],
        local_grids.unknown[seen], number, speed_max, local_grids.cells[seen], poses.motion,
        fitted)
    if record.cells[0].tolist() == record.cells[-1].tolist():
        # With the loop cut out no way to a goal is left.
        raise LeadsNowhereError(poses.stamps, poses.xy)
    return replace(record, local_grids=_wide(local_grids, grid, poses)), report, notes


def _wide(
    local_grids: LocalGridTable, grid: Grid, poses: PoseTable,
) -> npt.NDArray[np.void]:
    """Return the wide local grids by stamp that were seen from where the robot was."""
    wide = local_grids.local_grids[in_order(local_grids.local_grids['stamp'])]
    order = np.argsort(poses.stamps, kind='stable')
    there = seen_from(wide['stamp'], np.stack([wide['row'], wide['col']], axis=1),
                      poses.stamps[order], grid.cells_from_world(poses.xy[order]))
    return np.asarray(wide[there])


def _check_ends(poses: PoseTable) -> None:
    """Refuse a drive that began or went on where no message is a pose: frames that change, NaN."""
    if sets_off(poses.stamps, poses.xy):
        check_end('begins', 'first', *poses.before, poses.refusal)
    check_end('ends', 'last', *poses.after, poses.refusal)


def sets_off(
    stamps: npt.NDArray[np.floating[Any]], xy: npt.NDArray[np.float64],
) -> bool:
    """Return whether a drive begins in motion, by its stamps [s] and places [m], in order."""
    soon = stamps - stamps[0] <= _SOON
    return bool(np.hypot(*(xy[soon] - xy[0]).T).max() > _SET_OFF)


def check_end(what: str, which: str, n: int, seconds: float, refusal: str) -> None:
    """
    Refuse a drive whose ``n`` first or last messages, in some seconds [s], are no poses.

    Raises
    ------
    ValueError

    """
    if n > _FEW and seconds > _SOON:
        raise ValueError(
            f'nobody knows where this drive {what}: its {which} {n} messages ({seconds:.1f} s) '
            f'are refused, such as: {refusal}. Let every pose be a sound one, in one frame, and '
            f'show the way again')


def remedy_for_own(error: ValueError, bag: str) -> str:
    """Say what to do about a drive of a bag of ours beyond what its refusal says."""
    if isinstance(error, OutsideWorkspaceError) and error.fitting is not None:
        return ('. Drive within the workspace, or let it fit itself (leave rows, cols, origin_x '
                'and origin_y out) and show the way again')
    if isinstance(error, LeadsNowhereError):
        return (f', or cut it to the way there with `experience trim {bag} --to '
                f'{error.farthest:.2f}`, where it is farthest away')
    return _remedy_by_cutting(error, 0.0, f'`experience trim {bag} --to {{:.2f}}`')


def remedy_for_external(error: ValueError, begins: float) -> str:
    """
    Say what to do about a drive of another recorder beyond what its refusal says.

    Parameters
    ----------
    error : ValueError
    begins : float, [s]
        Where in the recording the part that was read begins.

    """
    if isinstance(error, LeadsNowhereError):
        return (f', or read only the way there: it is farthest away at '
                f'{begins + error.farthest:.2f} s (--to {begins + error.farthest:.2f})')
    if isinstance(error, TooShortError) and error.reach > _SMALLEST:
        side = math.floor(100.0 * error.reach / _FEW) / 100.0
        return (f', or say that the robot is smaller (--robot-radius) or how small the cells are '
                f'to be, such as --resolution {side:g}')
    return _remedy_by_cutting(error, begins, '--to {:.2f}')


def _remedy_by_cutting(error: ValueError, begins: float, command: str) -> str:
    """Say how a person keeps what lies on one side of a break."""
    if not isinstance(error, ImplausibleDriveError) or len(error.breaks) > 1:
        return ''
    [found] = error.breaks
    if found.kind not in _CAN_BE_CUT:
        return ''
    before = begins + max(np.floor((found.at - found.seconds) * 100.0 + _ROUNDED) / 100.0, 0.0)
    after = begins + np.ceil(found.at * 100.0 - _ROUNDED) / 100.0
    return (f', or keep what is before it ({command.format(before)}) or after it (--from '
            f'{after:.2f})')
