"""The neighbourhood of a real robot: from its newest scan or costmap and its poses."""

from bisect import bisect_left
from collections import deque
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import CellBox, Grid
from control_field.local_grid import cells_from_fine, FREE, UNKNOWN
from control_field.poses import Placement
from msgs_bridge.messages.neighbourhoods import Neighbourhood, occupancy_from_map
from msgs_bridge.messages.poses import (
    check_frame, FRAME_OWNERS, Pose, pose_from_odometry, seconds_from_stamp)
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.local_grid_from_costmap import neighbourhood_from_costmap
from msgs_bridge.sensing.local_grid_from_scan import bounded, neighbourhood_from_scan
from msgs_bridge.sensing.scan import scan_from_message
from neighbourhood_node.settings import NeighbourhoodSettings

#: Poses that are remembered: scans come later than the odometry of their time.
_N_POSES: Final = 400

Cells = npt.NDArray[np.int8]


class PoseHistory:
    """The last poses, by their stamps."""

    def __init__(self) -> None:
        """Start with none."""
        self._poses: deque[Pose] = deque(maxlen=_N_POSES)

    def add(self, pose: Pose) -> None:
        """Take in a pose; one that goes back in time begins anew."""
        if self._poses and pose.stamp < self._poses[-1].stamp:
            self._poses.clear()
        self._poses.append(pose)

    def nearest(self, stamp: float) -> Pose | None:
        """Return the pose whose stamp is nearest; None before the first."""
        if not self._poses:
            return None
        index = bisect_left(self._poses, stamp, key=lambda pose: pose.stamp)
        near = [self._poses[i] for i in (index - 1, index) if 0 <= i < len(self._poses)]
        return min(near, key=lambda pose: abs(pose.stamp - stamp))


class NeighbourhoodMaker:
    """
    Makes a neighbourhood of every odometry, from the newest scan or costmap.

    Parameters
    ----------
    settings : NeighbourhoodSettings

    """

    def __init__(self, settings: NeighbourhoodSettings) -> None:
        """Start with no scan and no costmap."""
        self.settings = settings
        self.grid = settings.grid
        self._poses = PoseHistory()
        self._stamp = 0.0
        self._read: Any = None
        #: Where the laser sits, as `/tf_static` says; None if it does not.
        self.found: Mount | None = None
        #: What was wrong with the newest scan or costmap; empty if nothing was.
        self.refusal = ''
        #: The cells made last, and of what: cell, pose at the scan, settings.
        self._made: tuple[tuple[object, ...], Cells] | None = None

    @property
    def laser(self) -> Mount:
        """Return the laser's mount: of the parameters, else of `/tf_static`, else the middle."""
        given = self.settings.laser
        return self.found if self.found is not None and given == Mount() else given

    @property
    def has_seen(self) -> bool:
        """Return whether a scan or a costmap has ever counted."""
        return self._read is not None

    def follow(self, cells: Grid) -> bool:
        """
        Take over cells that others have, where none are set; return whether they are others.

        Parameters
        ----------
        cells : Grid
            Any grid of their lattice.

        """
        if (not self.settings.follows or cells.frame_id != self.grid.frame_id
                or cells.offset_to(self.grid) is not None):
            return False
        self.grid, self._made = cells.lattice, None
        return True

    def update(self, msg: Any) -> None:
        """
        Take in a scan or a costmap.

        Raises
        ------
        ValueError
            If it cannot be used; the one before it stays, until it is stale.

        """
        if self.settings.source == 'scan':
            read: Any = scan_from_message(msg, self.settings.zero_is_no_return)
            stamp = read.stamp
        else:
            check_frame(msg.header.frame_id, self.grid.frame_id, 'costmap')
            read, stamp = occupancy_from_map(msg, 'costmap'), seconds_from_stamp(msg.header.stamp)
        self._read, self._stamp, self._made, self.refusal = read, stamp, None, ''

    def neighbourhood(self, msg: Any) -> Neighbourhood:
        """
        Return the neighbourhood at an odometry message.

        Raises
        ------
        ValueError
            If the odometry is not to be trusted, in another frame, or outside the workspace
            where that has bounds.

        """
        pose = pose_from_odometry(msg)
        check_frame(pose.frame_id, self.grid.frame_id, 'odom', FRAME_OWNERS)
        self._poses.add(pose)
        cell = self.grid.cell_from_world(pose.x, pose.y)
        if self.settings.is_bounded and not self.grid.contains(*cell):
            raise ValueError(f'odom: the robot is outside the workspace of {self.grid.n_rows} x '
                             f'{self.grid.n_cols} cells, at ({pose.x:.2f}, {pose.y:.2f}) m')
        cells, k = self._cells(cell, pose), self.settings.sight_subdivision
        if k == 1:
            return Neighbourhood(pose.stamp, *cell, cells, self.grid.frame_id)
        return Neighbourhood(
            pose.stamp, *cell, cells_from_fine(cells, k), self.grid.frame_id, cells)

    def problem(self, now: float) -> str:
        """Return why nothing is known at a time, empty if something is."""
        source = self.settings.source
        if source == 'scan' and self.laser.problem:
            return f'as /tf_static says, {self.laser.problem}'
        if self._read is None and self.refusal:
            return f'{source} arrives but does not count: {self.refusal}'
        if self._read is None:
            return f'no {source} has arrived yet'
        age = now - self._stamp
        if abs(age) <= self.settings.timeout:
            return ''
        since = f'; what arrives since does not count: {self.refusal}' if self.refusal else ''
        return (f'{source} is {abs(age):.2f} s {"older" if age > 0 else "newer"} than odometry, '
                f'must be at most {self.settings.timeout:g} s: everything is unknown{since}')

    def _cells(self, cell: tuple[int, int], pose: Pose) -> Cells:
        if self.problem(pose.stamp):
            n, k = self.settings.sight_cells, self.settings.sight_subdivision
            nothing = bounded(np.full((n, n), UNKNOWN, dtype=np.int8), *self._window(cell))
            return nothing.repeat(k, axis=0).repeat(k, axis=1)
        # A scan may come before the odometry of its time: then its pose is known better later.
        then = self._poses.nearest(self._stamp) if self.settings.source == 'scan' else None
        made_of = cell, then, self.settings, self.laser
        if self._made is None or self._made[0] != made_of:
            self._made = made_of, without_robot(self._look(cell, then))
        return self._made[1]

    def _window(self, cell: tuple[int, int]) -> tuple[tuple[int, int], Grid]:
        """Return a cell and its workspace; without bounds one that ends where the sight does."""
        if self.settings.is_bounded:
            return cell, self.grid
        reach = self.settings.sight_cells // 2
        return (reach, reach), self.grid.window(CellBox(*cell, *cell).widened(reach))

    def _look(self, cell: tuple[int, int], then: Pose | None) -> Cells:
        settings = self.settings
        cell, grid = self._window(cell)
        if then is None:
            costmap, values = self._read
            return neighbourhood_from_costmap(
                costmap, values, cell, grid, lethal=settings.lethal_threshold,
                radius=settings.robot_radius, seen_share=settings.seen_share,
                extent=settings.extent)
        return neighbourhood_from_scan(
            self._read, Placement(then.x, then.y, then.yaw), self.laser, cell, grid,
            settings.body, settings.extent)


def without_robot(cells: Cells) -> Cells:
    """
    Return a neighbourhood whose middle is not blocked, as the robot stands there.

    Walls beside it and inflation reach into that cell at this width. A blocked middle would say
    that something has come in, and keep the robot standing. Of finer cells it is the one in the
    middle that is not blocked.
    """
    middle = len(cells) // 2
    if cells[middle, middle] not in (FREE, UNKNOWN):
        cells = cells.copy()
        cells[middle, middle] = FREE
    return cells
