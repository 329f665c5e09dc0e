"""The workspace that a drive of others is read for: one that was described, or one that fits."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import ImplausibleDriveError
from control_field.drives.plausibility import DriveLimits, SPEED_MAX, whole_drive
from control_field.grid import fitted_workspace, Grid, TooLargeError
from control_field.local_grid import SUBDIVISIONS
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import RawMessages
from episode_store.rosbag2.topic_tables import pose_table, PoseTable

#: Local grids move by whole cells, but for this share of one.
_ALIGNED = 0.05


@dataclass(frozen=True)
class Workspace:
    """
    Which workspace is wanted.

    Parameters
    ----------
    grid : Grid
        It; of one that fits itself any grid of its lattice.
    is_fitted : bool
        Whether it fits itself to the drive.
    any_frame : bool
        Whether its frame is that of the drive's odometry, whatever that is called.
    any_lattice : bool
        Whether local grids that were recorded say what its cells are.
    speed_max : float, [m/s]
        A robot that drives faster is none.

    """

    grid: Grid
    is_fitted: bool = False
    any_frame: bool = False
    any_lattice: bool = False
    speed_max: float = SPEED_MAX

    @property
    def frame_id(self) -> str:
        """Return the frame that poses are to be in; empty: whichever they are in."""
        return '' if self.any_frame else self.grid.frame_id

    def frame_of(self, frame_id: str) -> str:
        """Return the workspace's frame, for a drive in some frame."""
        return frame_id if self.any_frame else self.grid.frame_id.lstrip('/')

    def framed(self, frame_id: str) -> Grid:
        """Return the grid for a drive in some frame."""
        return replace(self.grid, frame_id=frame_id) if self.any_frame else self.grid

    def fitted(self, poses: RawMessages, local_grids: RawMessages | None, frame_id: str) -> Grid:
        """
        Return the smallest workspace that fits itself to a drive.

        Parameters
        ----------
        poses, local_grids : RawMessages
            Those that were recorded.
        frame_id : str

        Raises
        ------
        BagError
            If none is large enough; the message says which resolution would do.

        """
        lattice = replace(self.grid, frame_id=frame_id)
        if self.any_lattice and local_grids is not None:
            lattice = lattice_of(local_grids, frame_id) or lattice
        table = pose_table(poses, frame_id)
        kept, is_whole = self._kept(table)
        if not len(kept):
            return fitted_workspace(lattice, np.zeros((1, 2)))
        try:
            return fitted_workspace(lattice, table.xy[kept])
        except TooLargeError as error:
            if is_whole:
                raise BagError(f'{error} (--resolution)') from None
            # What is wrong with the drive is said where it is read.
            return fitted_workspace(lattice, table.xy[kept[:1]])

    def _kept(self, table: PoseTable) -> tuple[npt.NDArray[np.int64], bool]:
        """Return which poses of a drive are learnt, or all of one that is not whole."""
        try:
            limits = DriveLimits(self.grid.resolution, self.speed_max)
            return whole_drive(table.stamps, table.xy, limits, table.motion).kept, True
        except ImplausibleDriveError:
            return np.arange(len(table.stamps)), False


def lattice_of(local_grids: RawMessages, frame_id: str) -> Grid | None:
    """
    Return the lattice of the cells that local grids show, as a grid of the first one's cell.

    Whether their cells are those of the workspace, or a third or a fifth of them, shows in the
    steps by which they move.

    Parameters
    ----------
    local_grids : RawMessages
        OccupancyGrid messages around the robot's cell.
    frame_id : str
        The frame they must be in.

    Returns
    -------
    Grid or None
        None if no message makes sense.

    """
    columns = read_columns(local_grids, dict.fromkeys(
        ('resolution', 'width', 'height', 'x', 'y'), 1))
    frames = [i for i, frame in enumerate(columns.texts('frame_id'))
              if frame.lstrip('/') == frame_id.lstrip('/')]
    values = columns.values
    corners = np.stack([values['x'], values['y']], axis=1)
    sound = np.isin(columns.layout, frames) & np.isfinite(corners).all(axis=1)
    sound &= (values['resolution'] > 0.0) & (values['width'] == values['height'])
    if not sound.any():
        return None
    first = int(sound.argmax())
    # Their sides are float32.
    side, n = round(float(values['resolution'][first]), 6), int(values['width'][first])
    steps = (corners[sound] - corners[first]) / max(side, 1e-6)
    moved = bool(np.abs(steps).max() > 0.5)
    divided = max(k for k in SUBDIVISIONS if k == 1 or (moved and n > k and n % k == 0 and (
        np.abs(steps / k - np.round(steps / k)).max() < _ALIGNED)))
    low = corners[first] + 0.5 * (n - divided) * side
    return Grid(1, 1, round(divided * side, 6), float(low[0]), float(low[1]), frame_id)
