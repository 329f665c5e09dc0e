"""Make the 3x3 local grids of a drive from its laser scans, as a running node would have."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import UNKNOWN
from control_field.poses import Placement
from control_field.words import counted
from episode_store.external.drive_poses import DrivePoses
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr import LASER_SCAN, struct_from_cdr
from msgs_bridge.messages.cdr_write import neighbourhood_to_cdr
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.local_grid_from_scan import Body, bounded, neighbourhood_from_scan
from msgs_bridge.sensing.scan import Scan, scan_from_message

#: Age from which a scan tells nothing any more, [s]; that of `neighbourhood_node`.
_TIMEOUT: Final = 0.5
_OCCUPANCY: Final = 'nav_msgs/msg/OccupancyGrid'


@dataclass(frozen=True, eq=False)
class Scans:
    """
    The laser scans of a drive, by stamp.

    Parameters
    ----------
    topic, frame_id : str
        Where they came from, and the frame of the laser.
    scans : list of Scan
    stamps : ndarray, shape (n,), [s]
    n_refused : int
        Messages that were left out.
    refusal : str
        Why the first of them was.

    """

    topic: str
    frame_id: str
    scans: list[Scan]
    stamps: npt.NDArray[np.float64]
    n_refused: int
    refusal: str


def read_scans(
    messages: RawMessages, zero_is_no_return: bool = False, is_stamped: bool = True,
) -> Scans:
    """
    Read LaserScan messages; those that make no sense, or of another frame, are left out.

    Parameters
    ----------
    messages : RawMessages
    zero_is_no_return : bool
        Whether 0 stands for nothing in range.
    is_stamped : bool
        Whether their stamps count, rather than the times at which they were recorded.

    """
    found: list[Scan] = []
    frame_id, refusal, n_refused = '', '', 0
    for message, log_time in zip(messages, messages.log_times.tolist(), strict=True):
        try:
            values = struct_from_cdr(LASER_SCAN, message)
            if not is_stamped:
                values['sec'], values['nanosec'] = divmod(log_time, 1_000_000_000)
            frame_id = frame_id or values['frame_id']
            if values['frame_id'] != frame_id:
                raise ValueError(f'frame is {values["frame_id"][:80]!r}, the first was in '
                                 f'{frame_id!r}')
            msg = SimpleNamespace(**values, header=SimpleNamespace(stamp=SimpleNamespace(
                sec=values['sec'], nanosec=values['nanosec'])))
            found.append(scan_from_message(msg, zero_is_no_return, messages.topic))
        except ValueError as error:
            n_refused, refusal = n_refused + 1, refusal or str(error)
    found.sort(key=lambda scan: scan.stamp)
    return Scans(messages.topic, frame_id.lstrip('/'), found,
                 np.array([scan.stamp for scan in found]), n_refused, refusal)


def local_grids_from_scans(
    scans: Scans, poses: DrivePoses, mount: Mount, grid: Grid, body: Body, topic: str,
) -> RawMessages:
    """
    Make the local grid at every pose whose cell or newest scan is another than the one before.

    Parameters
    ----------
    scans : Scans
    poses : DrivePoses
        In the frame of ``grid``.
    mount : Mount
        Where the laser sits on the robot.
    grid : Grid
    body : Body
    topic : str
        What they are called.

    Returns
    -------
    RawMessages
        3x3 OccupancyGrids, stamped as the poses; unknown where there is no scan of that time.

    """
    order = np.argsort(poses.stamps_ns, kind='stable')
    stamps_ns, motions = poses.stamps_ns[order], poses.motions.at(order)
    stamps = stamps_ns // 1_000_000_000 + (stamps_ns % 1_000_000_000) * 1e-9
    where = motions.between(stamps, scans.stamps)
    xyyaw = np.column_stack([where.shift[:, :2], where.yaw]).tolist()
    cells = grid.cells_from_world(motions.shift[:, :2]).tolist()
    newest = _newest(scans.stamps, stamps)
    made: list[bytes] = []
    times: list[int] = []
    last = None
    for place, (row, col) in enumerate(cells):
        key = row, col, int(newest[place])
        if key == last or not grid.contains(row, col):
            continue
        last, k = key, key[2]
        seen = bounded(np.full((3, 3), UNKNOWN, dtype=np.int8), (row, col), grid) if k < 0 else (
            neighbourhood_from_scan(
                scans.scans[k], Placement(*xyyaw[k]), mount, (row, col), grid, body))
        made.append(neighbourhood_to_cdr(int(stamps_ns[place]), seen, (row, col), grid))
        times.append(int(poses.log_times[order[place]]))
    return RawMessages.of(topic, _OCCUPANCY, made, times)


def _newest(
    scans: npt.NDArray[np.float64], poses: npt.NDArray[np.float64],
) -> npt.NDArray[np.int64]:
    """Return the scan that was newest at each pose; -1 where it is too old, or there is none."""
    index = np.searchsorted(scans, poses + 1e-9, side='right') - 1
    age = poses - scans[np.maximum(index, 0)]
    return np.where((index >= 0) & (age <= _TIMEOUT), index, -1).astype(np.int64)


def described(scans: Scans, mount: Mount, base: str) -> str:
    """Say in a sentence what a local grid was made from."""
    tilt = ', upside down' if mount.rotation[2, 2] < 0.0 else ''
    refused = f', {counted(scans.n_refused, "scan")} refused, the first: {scans.refusal}' if (
        scans.n_refused) else ''
    laser = scans.frame_id or 'its laser'
    return (f'local grid is made from {counted(len(scans.scans), "scan")} on {scans.topic} '
            f'({laser} at ({mount.x:.2f}, {mount.y:.2f}) m of {base or "the robot"}, turned by '
            f'{mount.yaw:.2f} rad{tilt}){refused}')
