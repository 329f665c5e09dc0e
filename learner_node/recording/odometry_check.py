"""Whether a drive can be learnt from the poses on `odom`."""

import math
from typing import Final

from nav_msgs.msg import Odometry

from control_field.drives.breaks import place_text
from control_field.drives.workspace import EDGE
from control_field.grid import Grid
from msgs_bridge.messages.frame_hints import remedy_for_frame
from msgs_bridge.messages.poses import check_frame, Pose, pose_from_odometry
from msgs_bridge.messages.serialized import message_from_cdr

#: Sound odometry is looked at so often at most, [s]; a robot may say it a thousand times a second.
_PERIOD: Final = 0.02


class OdometryCheck:
    """
    Reads odometry now and then, and every one as long as it is not sound.

    Parameters
    ----------
    frame_id : str
        Of the workspace.
    grid : Grid or None
        The workspace, if it is set: outside of it nothing can be learnt.

    Attributes
    ----------
    place : tuple of float or None, [m]
        Where the robot was last, ``(x, y)``.
    problem : str
        Why nothing can be learnt from the last that was read; empty if something can.

    """

    def __init__(self, frame_id: str, grid: Grid | None = None) -> None:
        self._frame_id, self._grid = frame_id, grid
        self.place: tuple[float, float] | None = None
        self.problem = ''
        self._read_at = -math.inf

    def is_due(self, now: float) -> bool:
        """Return True if the next odometry is to be read."""
        return bool(self.problem) or now - self._read_at >= _PERIOD

    def read(self, cdr: bytes, now: float) -> Pose:
        """
        Read an odometry.

        Raises
        ------
        ValueError, RuntimeError
            If it is no pose in the frame of the workspace.

        """
        self._read_at, frame = now, ''
        try:
            pose = pose_from_odometry(message_from_cdr(cdr, Odometry))
            frame = pose.frame_id
            check_frame(frame, self._frame_id, 'odom')
        except (ValueError, RuntimeError) as error:
            self.problem = (f'odometry arrives but does not count: {error}'
                            f'{remedy_for_frame(frame)}')
            raise
        self.place, self.problem = (pose.x, pose.y), self._outside(pose.x, pose.y)
        return pose

    def _outside(self, x: float, y: float) -> str:
        """Say that a place, [m], lies where nothing can be learnt, and what to do about it."""
        grid = self._grid
        if grid is None:
            return ''
        edge = EDGE * grid.resolution
        is_inside = (
            -edge <= x - grid.origin_x <= grid.n_cols * grid.resolution + edge
            and -edge <= y - grid.origin_y <= grid.n_rows * grid.resolution + edge)
        return '' if is_inside else (
            f'the robot is at {place_text((x, y))} m, outside the workspace of {grid}: drive it '
            f'inside, or start learner_node with other origin_x, origin_y, rows or cols, or '
            f'without them: then the workspace fits itself')
