"""Where the robot is, where a demonstration began, and setting a simulated robot somewhere."""

from collections.abc import Sequence
from dataclasses import replace
import math
import time
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from msgs_bridge.messages.poses import initialpose_from_pose, Pose, pose_from_odometry
from msgs_bridge.node import qos
from msgs_bridge.teaching.answers import Answer
from msgs_bridge.teaching.timeouts import Timeouts

#: How near its place a robot that was set there is, [m], and how long that may take, [s].
_NEAR: Final = 0.05
_SET_BACK_TIME: Final = 3.0
_NO_ODOMETRY: Final = 'no odometry has arrived yet: is the simulator there?'
#: What the places are like that the learner names.
_HELPS: Final = 'The robot has not seen this place yet, or finds no way from it'
#: Where the learner names no place to teach from.
NOWHERE: Final = (
    'there is no place where one more drive would help: nothing was shown yet (press s to start), '
    'or the robot gets to the goal from everywhere it has seen')


class RobotPlacement:
    """
    Where the robot is, as odometry tells it, and where a simulated one is set.

    Parameters
    ----------
    node : Node
        That hears odometry.
    timeouts : Timeouts
    lockstep : bool
        Whether every odometry is read.

    """

    def __init__(self, node: Any, timeouts: Timeouts, lockstep: bool) -> None:
        """Subscribe."""
        self.odometry: Odometry | None = None
        self._timeouts = timeouts
        self._pose: Pose | None = None
        self._began: Pose | None = None
        self._first: Pose | None = None
        self._offered: list[Sequence[float]] = []
        self._n_offered = 0
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
        self._first = self._first or self._pose
        while self._arrivals:
            self._arrivals.pop().set_result(True)

    async def mark_start(self) -> None:
        """Note that a demonstration begins here; odometry may be found later than the learner."""
        if self._pose is None:
            await self._next_pose()
        self._began = self._pose

    async def _next_pose(self) -> None:
        """Wait for the next odometry, but not for ever."""
        arrival = self._timeouts.future()
        self._arrivals.append(arrival)
        await self._timeouts.within(arrival, _SET_BACK_TIME)

    async def set_back(self) -> Answer:
        """Set a simulated robot back to where the demonstration began, if that was seen."""
        began = self._began
        if began is None:
            return Answer(True, '')
        return await self.set_to(began.x, began.y, began.yaw)

    async def set_to_start(self, start: Sequence[float]) -> Answer:
        """
        Set a simulated robot to where trials start: x, y, yaw, [m, rad].

        Before anything was learnt that is where the last demonstration began, or where the robot
        was first seen.
        """
        known = self._began or self._first
        if start:
            return await self.set_to(*start)
        if known is None:
            return Answer(False, _NO_ODOMETRY, 'no_robot')
        return await self.set_to(known.x, known.y, known.yaw)

    async def set_to_place(self, x: float, y: float) -> Answer:
        """Set a simulated robot to a place, [m], looking where it looks now."""
        return await self.set_to(x, y, self._pose.yaw if self._pose else 0.0)

    async def set_to_next(self, places: Sequence[Sequence[float]]) -> Answer:
        """Set a simulated robot to the next of some places, (x, y) [m]."""
        if not places:
            return Answer(False, NOWHERE, 'nowhere')
        if places != self._offered:
            self._offered, self._n_offered = list(places), 0
        x, y = places[self._n_offered % len(places)][:2]
        self._n_offered += 1
        answer = await self.set_to_place(x, y)
        more = f'press h again for the next of {len(places)} places' if len(places) > 1 else ''
        if not answer.success:
            return answer._replace(message='; '.join(filter(None, (answer.message, more))))
        start = 'Press s to start it' + (f', or {more}' if more else '')
        return Answer(True, f'{answer.message}. {_HELPS}: a drive from here to the goal helps '
                            f'most. {start}')

    async def set_to(self, x: float, y: float, yaw: float) -> Answer:
        """Set a simulated robot to a place, [m, rad], and wait until odometry shows it there."""
        if self._pose is None:
            return Answer(False, _NO_ODOMETRY, 'no_robot')
        deadline = time.monotonic() + _SET_BACK_TIME
        # What is published before a simulator was found is lost.
        await self._timeouts.until(lambda: self._places.get_subscription_count() > 0, deadline)
        self._places.publish(initialpose_from_pose(
            replace(self._pose, x=x, y=y, yaw=yaw, v=0.0, w=0.0)))
        while time.monotonic() < deadline:
            await self._next_pose()
            if math.hypot(self._pose.x - x, self._pose.y - y) < _NEAR:
                return Answer(True, f'the robot stands at ({x:.2f}, {y:.2f}) m')
        return Answer(False, f'the robot was not set to ({x:.2f}, {y:.2f}) m: is something there?',
                      'not_set')


def where_to_teach(places: Sequence[Sequence[float]]) -> Answer:
    """Say to which places a real robot may be driven, (x, y) [m]."""
    if not places:
        return Answer(False, NOWHERE, 'nowhere')
    named = ', '.join(f'({x:.2f}, {y:.2f})' for x, y in places)
    return Answer(True, f'one more drive to the goal helps most from one of these places, best '
                        f'first, (x, y) in metres: {named}. Drive the robot there, then press s',
                  'drive_there')
