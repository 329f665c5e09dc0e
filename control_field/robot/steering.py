"""
Steering: which velocity brings the robot to the next cell's centre.

The way to a cell is a `Segment`. An *exact* segment keeps to the line between its ends and turns
on the spot for anything but small errors: a body of 0.105 m has 2 cm to spare in a corridor of
0.25 m. An open segment heads for its end and turns while driving. Both brake so as to rest at the
end, should nobody know what comes next. How suddenly the robot may change is the collision
monitor's business (`control_field.robot.collision_monitor`).
"""

from dataclasses import dataclass
import math
from typing import Final

from control_field.robot.limits import Limits, Velocity

#: How fast a heading error may be worked off near zero, [1/s].
TURN_GAIN: Final = 4.0
#: How fast a remaining distance may be worked off near zero, [1/s].
DRIVE_GAIN: Final = 6.0
#: Share of the acceleration that slowing down is planned with; the rest covers the answer's delay.
BRAKE_SHARE: Final = 0.8
#: Heading errors at which the robot stands and only turns, [rad].
EXACT_CONE: Final = 0.15
OPEN_CONE: Final = 1.2
#: Look-ahead of the line follower in seconds at full speed; damps it at 0.84.
LOOK_AHEAD: Final = 0.7


@dataclass(frozen=True, slots=True)
class Segment:
    """
    A straight piece of way.

    Parameters
    ----------
    ax, ay, bx, by : float
        Where it begins and ends, [m].
    exact : bool
        Whether to keep to the line and to turn on the spot.

    """

    ax: float
    ay: float
    bx: float
    by: float
    exact: bool

    def remaining(self, x: float, y: float) -> float:
        """Return how far the end lies ahead, along the segment [m]; negative when passed."""
        length = math.hypot(self.bx - self.ax, self.by - self.ay)
        if length == 0.0:
            return 0.0
        return ((self.bx - x) * (self.bx - self.ax) + (self.by - y) * (self.by - self.ay)) / length

    def lateral(self, x: float, y: float) -> float:
        """Return how far a point lies to the left of the segment, [m]."""
        length = math.hypot(self.bx - self.ax, self.by - self.ay)
        if length == 0.0:
            return 0.0
        return ((self.bx - self.ax) * (y - self.ay) - (self.by - self.ay) * (x - self.ax)) / length

    def heading(self) -> float:
        """Return its direction, [rad]."""
        return math.atan2(self.by - self.ay, self.bx - self.ax)


def wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi]."""
    return math.remainder(angle, math.tau)


def approach_speed(remaining: float, top: float, acceleration: float, gain: float) -> float:
    """
    Return the speed from which what remains is still enough to come to rest.

    Proportional near the end, the square root of braking at a constant rate further away.

    Parameters
    ----------
    remaining : float
        Distance or angle that is left; nothing or less gives 0.
    top : float
        Greatest speed.
    acceleration : float
        At which the robot slows down.
    gain : float
        Speed for what remains, near the end, [1/s].

    """
    if remaining <= 0.0:
        return 0.0
    knee = acceleration / (gain * gain)
    if remaining <= knee:
        return min(top, gain * remaining)
    return min(top, math.sqrt(2.0 * acceleration * (remaining - 0.5 * knee)))


def heading_wanted(x: float, y: float, segment: Segment, limits: Limits) -> float:
    """Return the direction to look in: back to the line of an exact segment, else to its end."""
    if not segment.exact:
        return math.atan2(segment.by - y, segment.bx - x)
    return segment.heading() - math.atan(segment.lateral(x, y) / (LOOK_AHEAD * limits.v_max))


def steer(x: float, y: float, yaw: float, segment: Segment, limits: Limits) -> Velocity:
    """
    Return the velocity that follows a segment.

    Parameters
    ----------
    x, y, yaw : float, [m], [rad]
        The robot's pose, finite.
    segment : Segment
        Where it goes.
    limits : Limits
        What it can do.

    Returns
    -------
    v, w : float, [m/s], [rad/s]
        Never backwards, within the speed limits.

    """
    error = wrapped(heading_wanted(x, y, segment, limits) - yaw)
    cone = EXACT_CONE if segment.exact else OPEN_CONE
    turn = approach_speed(abs(error), limits.w_max, BRAKE_SHARE * limits.alpha_max, TURN_GAIN)
    ahead = approach_speed(
        segment.remaining(x, y), limits.v_max, BRAKE_SHARE * limits.a_max, DRIVE_GAIN)
    return min(ahead, limits.v_max * max(0.0, 1.0 - abs(error) / cone)), math.copysign(turn, error)
