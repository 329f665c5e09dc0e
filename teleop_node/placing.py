"""Where the robot is, where a demonstration began, and setting a simulated robot somewhere."""

import math
import time
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from msgs_bridge import qos
from msgs_bridge.poses import initialpose_from_pose, Pose, pose_from_odometry
from teleop_node.asking import Asking
from teleop_node.teaching import Answer

#: How near its place a robot that was set there is, [m], and how long that may take, [s].
_NEAR: Final = 0.05
_SET_BACK_TIME: Final = 3.0


class Placing:
    """
    The robot's place, as odometry tells it.

    Parameters
    ----------
    node : Node
        That hears odometry.
    asking : Asking
        Waits.

    """

    def __init__(self, node: Any, asking: Asking, lockstep: bool) -> None:
        """Subscribe."""
        self.odometry: Odometry | None = None
        self._asking = asking
        self._pose: Pose | None = None
        self._began: Pose | None = None
        self._arrivals: list[Any] = []
        self._places = node.create_publisher(PoseWithCovarianceStamped, 'initialpose', qos.POSE)
        node.create_subscription(Odometry, 'odom', self._on_odometry, (
            qos.ODOMETRY_PUB if lockstep else qos.SENSOR))

    def _on_odometry(self, msg: Odometry) -> None:
        self.odometry = msg
        try:
            self._pose = pose_from_odometry(msg)
        except ValueError:
            return  # others say so
        while self._arrivals:
            self._arrivals.pop().set_result(True)

    def demonstration_began(self) -> None:
        """Keep where it began."""
        self._began = self._pose

    async def set_back(self) -> Answer:
        """Set a simulated robot back to where the demonstration began."""
        began = self._began
        if began is None:
            return Answer(True, '')
        self._places.publish(initialpose_from_pose(began))
        deadline = time.monotonic() + _SET_BACK_TIME
        while time.monotonic() < deadline:
            arrival = self._asking.future()
            self._arrivals.append(arrival)
            await self._asking.within(arrival, _SET_BACK_TIME)
            if self._pose is not None and math.hypot(
                    self._pose.x - began.x, self._pose.y - began.y) < _NEAR:
                return Answer(True, '')
        return Answer(False, 'the robot was not set back')
