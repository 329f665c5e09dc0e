"""Whether what arrives on `odom` are poses that a drive can be learnt from."""

import math
from typing import Final

from nav_msgs.msg import Odometry

from learner_node.frames import with_remedy
from msgs_bridge.poses import check_frame, Pose, pose_from_odometry
from msgs_bridge.serialized import message_from_cdr

#: Sound odometry is looked at so often at most, [s]; a robot may say it a thousand times a second.
_PERIOD: Final = 0.02


class OdometryCheck:
    """
    Reads odometry now and then, and every one as long as it is not sound.

    Parameters
    ----------
    frame_id : str
        Of the workspace.

    Attributes
    ----------
    problem : str
        Why the last that was read is no pose of the workspace; empty if it is one.

    """

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self.problem = ''
        self._read_at = -math.inf

    def is_due(self, now: float) -> bool:
        """Tell whether the next one is to be read."""
        return bool(self.problem) or now - self._read_at >= _PERIOD

    def read(self, cdr: bytes, now: float) -> Pose:
        """
        Read an odometry.

        Raises
        ------
        ValueError, RuntimeError
            If it is no pose of the workspace.

        """
        self._read_at = now
        try:
            pose = pose_from_odometry(message_from_cdr(cdr, Odometry))
            check_frame(pose.frame_id, self._frame_id, 'odom')
        except (ValueError, RuntimeError) as error:
            self.problem = with_remedy(str(error))
            raise
        self.problem = ''
        return pose
