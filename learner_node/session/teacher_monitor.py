"""Whether the person who shows the way is still there, as far as that can be told."""

import math
from typing import Final

#: A heartbeat so long before a demonstration belongs to it, and after so long without one it is
#: looked whether the robot is driven by somebody else, [s].
_RECENT: Final = 1.0
#: What is a move of the robot and not the noise of its odometry, [m] and [rad].
_STEP: Final = 0.05
_TURN: Final = 0.1


class TeacherMonitor:
    """
    Watches over a demonstration that was begun where `teleop_heartbeat` is heard.

    The person has left when the heartbeat has fallen silent, the robot stands and no commands
    come: keys that go on without a terminal drive nothing, while many a program for a gamepad
    commands standstill as long as it lives. A person of whom no heartbeat was ever heard is not
    missed.
    """

    def __init__(self) -> None:
        """Start with nobody heard."""
        self._heard = self._driven = -math.inf
        self._is_known = False
        self._place: tuple[float, float, float] | None = None

    def begin(self, now: float) -> None:
        """Begin to watch, because a demonstration begins."""
        self._is_known = now - self._heard <= _RECENT
        self._place, self._driven = None, now

    def on_heartbeat(self, now: float) -> None:
        """Note that somebody is there."""
        self._heard, self._is_known = now, True

    def on_suspended(self, seconds: float, now: float) -> None:
        """Count the time during which this process was suspended as nobody's absence."""
        self._heard = min(self._heard + seconds, now)
        self._driven = min(self._driven + seconds, now)

    def asks_for_poses(self, now: float) -> bool:
        """Return True if it matters whether the robot moves."""
        return self._is_known and now - self._heard > _RECENT

    def on_pose(self, x: float, y: float, yaw: float, now: float) -> None:
        """Note where the robot is."""
        if self._place is None or self._is_far(self._place, x, y, yaw):
            self._place, self._driven = (x, y, yaw), now

    def on_command(self, now: float) -> None:
        """Note that somebody commands the robot, if only to stand."""
        self._driven = now

    @staticmethod
    def _is_far(place: tuple[float, float, float], x: float, y: float, yaw: float) -> bool:
        return math.hypot(x - place[0], y - place[1]) > _STEP or (
            abs(math.remainder(yaw - place[2], math.tau)) > _TURN)

    def has_left(self, now: float, timeout: float) -> bool:
        """Return True if nobody was there or drove the robot for longer than a time, [s]."""
        return self._is_known and now - max(self._heard, self._driven) > timeout
