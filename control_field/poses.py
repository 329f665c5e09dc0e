"""Where a robot is, or shall be: places in the plane."""

from dataclasses import dataclass
import math
from typing import Final, NamedTuple

#: How far from its start a placed robot may stand, [m] and [rad].
PLACE_TOLERANCE: Final = 0.02
#: A heading may be off by so much from one pose to the next, [rad]; robots turn so fast, [rad/s].
TURN_JUMP: Final = 0.35
TURN_MAX: Final = 4.5


def possible_turn(dt: float, w_max: float = TURN_MAX) -> float:
    """Return by how much a heading may seem to turn within a time, [s], at most pi, [rad]."""
    return min(TURN_JUMP + max(TURN_MAX, w_max) * dt, math.pi)


@dataclass(frozen=True)
class StartPose:
    """Where a trial starts: ``x``, ``y`` in metres, ``yaw`` in radians."""

    x: float
    y: float
    yaw: float = 0.0

    def is_near(self, x: float, y: float, yaw: float) -> bool:
        """Return whether a robot stands here."""
        return (math.hypot(x - self.x, y - self.y) <= PLACE_TOLERANCE
                and abs(math.remainder(yaw - self.yaw, math.tau)) <= PLACE_TOLERANCE)


class Placement(NamedTuple):
    """Where something is: x, y [m] and yaw [rad]."""

    x: float
    y: float
    yaw: float

    def compose(self, offset: 'Placement') -> 'Placement':
        """Return where something is that has this offset from here."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Placement(self.x + c * offset.x - s * offset.y,
                         self.y + s * offset.x + c * offset.y, self.yaw + offset.yaw)

    def seen_from(self, place: 'Placement') -> 'Placement':
        """Return the offset that this has from another place."""
        c, s, dx, dy = math.cos(place.yaw), math.sin(place.yaw), self.x - place.x, self.y - place.y
        return Placement(c * dx + s * dy, c * dy - s * dx, self.yaw - place.yaw)
