"""Whether a robot that is driven moves."""

import math
from typing import Final

from msgs_bridge.messages.poses import Pose

#: Slower than this is standing, [m/s] and [rad/s].
_SLOW: Final = 0.005, 0.02
#: A robot that is told to move and does not for so long is stuck, [s].
_PATIENCE: Final = 1.5


class Motion:
    """
    Watches whether the robot moves: since a recording began, and while somebody drives it.

    Attributes
    ----------
    has_moved : bool
        Whether it has moved since `begin`.

    """

    def __init__(self) -> None:
        """Start standing."""
        self.has_moved = False
        self._moved_at = self._driven_at = -math.inf
        self._is_driven = False

    def begin(self, now: float) -> None:
        """Forget that it has moved."""
        self.has_moved, self._moved_at = False, now

    def on_pose(self, pose: Pose, now: float) -> None:
        """Note how fast it is."""
        if abs(pose.v) > _SLOW[0] or abs(pose.w) > _SLOW[1]:
            self.has_moved, self._moved_at = True, now

    def on_driven(self, is_driven: bool, now: float) -> None:
        """Note whether somebody drives."""
        if is_driven and not self._is_driven:
            self._driven_at = now
        self._is_driven = is_driven

    def is_stuck(self, now: float) -> bool:
        """Return True if it is driven for a while and has not moved since."""
        return self._is_driven and now - max(self._driven_at, self._moved_at) > _PATIENCE
