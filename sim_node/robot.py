"""A differential-drive robot: exact arcs, wheels that slip, and a body that stops at obstacles."""

from dataclasses import dataclass
import math
from typing import Final, NamedTuple, Protocol

import numpy as np

#: The least distance looked ahead for obstacles, [m]. Between two looks a disc can pass a
#: corner by at most this squared over eight radii: about a micrometre.
_LOOK: Final = 1e-3
_BISECTIONS: Final = 24


class Room(Protocol):
    """How much room there is around the robot."""

    def at(self, x: float, y: float) -> float:
        """Return the distance from the robot's edge to what is next to it, [m]."""


class Placement(NamedTuple):
    """Where a robot is: x, y [m] and yaw [rad], in (-pi, pi]."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Body:
    """
    What the robot is able to do; the defaults are a TurtleBot3 Burger's.

    Parameters
    ----------
    radius : float, [m]
        Of the disc that the robot is.
    v_max : float, [m/s]
    w_max : float, [rad/s]
    wheel_separation : float, [m]
    a_max : float, [m/s^2]
        0 for no limit.
    alpha_max : float, [rad/s^2]
        0 for no limit.

    """

    radius: float = 0.105
    v_max: float = 0.22
    w_max: float = 2.84
    wheel_separation: float = 0.160
    a_max: float = 0.0
    alpha_max: float = 0.0


@dataclass(frozen=True)
class Wheels:
    """
    How far odometry is from the truth.

    Parameters
    ----------
    slip : float, 0 to 0.5
        Share of a wheel's travel that is lost, on average; each wheel and tick draws its own
        between 0 and twice that.
    heading_drift : float, [rad/m]
        Turn that the wheels do not notice, per metre driven.
    noise_std : float, 0 to 1
        Standard deviation of what each wheel's encoder reads, as a share of its travel.

    """

    slip: float = 0.0
    heading_drift: float = 0.0
    noise_std: float = 0.0

    @property
    def are_exact(self) -> bool:
        """Return whether odometry is the truth."""
        return self.slip == self.heading_drift == self.noise_std == 0.0


def arc(start: Placement, v: float, w: float, seconds: float) -> Placement:
    """
    Drive along a circle, in closed form.

    Parameters
    ----------
    start : Placement
    v : float, [m/s]
    w : float, [rad/s]
        Counter-clockwise; 0 and values close to it are straight lines, without loss of digits.
    seconds : float

    Returns
    -------
    Placement
        The chord has the length ``v t sin(a) / a`` with ``a = w t / 2``, and points along
        ``yaw + a``.

    """
    half = 0.5 * w * seconds
    if abs(half) < 1e-4:
        ratio = 1.0 - half * half / 6.0  # the next term of the series is below 1e-18
    else:
        ratio = math.sin(half) / half
    chord = v * seconds * ratio
    return Placement(start.x + chord * math.cos(start.yaw + half),
                     start.y + chord * math.sin(start.yaw + half),
                     math.remainder(start.yaw + 2.0 * half, math.tau))


def time_to_contact(
    start: Placement, v: float, w: float, seconds: float, clearance: Room,
) -> tuple[float, bool]:
    """
    Return how long a disc can drive along an arc before it touches something.

    The room around the disc is safe to drive through (nothing is nearer), so the arc is walked in
    steps of that room, and the contact is found by bisection. A disc that already overlaps
    something may move as long as that does not get worse.

    Returns
    -------
    free : float, [s]
        0 to ``seconds``.
    touches : bool
        Whether something stopped it.

    """
    if v == 0.0:
        return seconds, False
    room, free = clearance.at(start.x, start.y), 0.0
    while free < seconds:
        step = max(room, _LOOK)
        ahead = free + step / abs(v) if step < abs(v) * (seconds - free) else seconds
        limit, room = min(room, 0.0), _room(start, v, w, ahead, clearance)
        if room < limit:
            return _bisect(start, v, w, free, ahead, limit, clearance), True
        free = ahead
    return seconds, False


def _room(start: Placement, v: float, w: float, seconds: float, clearance: Room) -> float:
    there = arc(start, v, w, seconds)
    return clearance.at(there.x, there.y)


def _bisect(
    start: Placement, v: float, w: float, free: float, blocked: float, limit: float,
    clearance: Room,
) -> float:
    """Return the last time at which there is room enough; it is proven for ``free``."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (free + blocked)
        if _room(start, v, w, middle, clearance) < limit:
            blocked = middle
        else:
            free = middle
    return free


def towards(value: float, target: float, step: float) -> float:
    """Return ``target``, or what can be reached of it from ``value`` (a step of 0: no limit)."""
    if step == 0.0:
        return target
    return min(max(target, value - step), value + step)


class Robot:
    """
    A robot, where it is and where it believes to be.

    Parameters
    ----------
    body : Body
    wheels : Wheels
    start : Placement
        Where it stands, which it knows.

    """

    def __init__(self, body: Body, wheels: Wheels, start: Placement) -> None:
        """Stand still."""
        self.body = body
        self.wheels = wheels
        self.place(start)

    def place(self, where: Placement) -> None:
        """Put the robot somewhere else; its odometry is told so."""
        yaw = math.remainder(where.yaw, math.tau)
        where = Placement(float(where.x), float(where.y), yaw)
        self.truth = where
        self.odometry = where
        self.speed = self.turn_rate = 0.0
        self._distance = self._turned = 0.0

    def drive(
        self, v: float, w: float, seconds: float, clearance: Room,
        rng: np.random.Generator,
    ) -> bool:
        """
        Follow a command for one tick, at most as fast as the body allows.

        Parameters
        ----------
        v, w : float, [m/s], [rad/s]
            Finite.
        seconds : float
            The tick.
        clearance : Room
            Around a disc of the body's radius.
        rng : numpy.random.Generator
            For slip and noise; not used where the wheels are exact.

        Returns
        -------
        bool
            Whether an obstacle or a wall stopped the robot: it then stands where it touched it.

        """
        v, w = self._within_limits(v, w, seconds)
        (true_v, true_w), (seen_v, seen_w) = self._through_wheels(v, w, rng)
        free, touches = time_to_contact(self.truth, true_v, true_w, seconds, clearance)
        self.truth = arc(self.truth, true_v, true_w, free)
        self.odometry = arc(self.odometry, seen_v, seen_w, free)
        self.speed, self.turn_rate = (0.0, 0.0) if touches else (seen_v, seen_w)
        self._distance += abs(seen_v) * free
        self._turned += abs(seen_w) * free
        return touches

    @property
    def variances(self) -> tuple[float, float]:
        """Return the variances of the odometry's place [m^2] and yaw [rad^2]."""
        loss = self.wheels.slip + self.wheels.noise_std
        yaw = loss * self._turned + abs(self.wheels.heading_drift) * self._distance
        place = loss * self._distance + 0.5 * yaw * self._distance
        return 1e-6 + place * place, 1e-6 + yaw * yaw

    def _within_limits(self, v: float, w: float, seconds: float) -> tuple[float, float]:
        body = self.body
        v = min(max(v, -body.v_max), body.v_max)
        w = min(max(w, -body.w_max), body.w_max)
        return (towards(self.speed, v, body.a_max * seconds),
                towards(self.turn_rate, w, body.alpha_max * seconds))

    def _through_wheels(
        self, v: float, w: float, rng: np.random.Generator,
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return what the robot does, and what its encoders say it does."""
        wheels = self.wheels
        if wheels.are_exact:
            return (v, w), (v, w)
        side = 0.5 * self.body.wheel_separation
        rims = (v - side * w, v + side * w)
        lost = rng.random(2) * (2.0 * wheels.slip)
        read = rng.standard_normal(2) * wheels.noise_std
        left, right = (rim * (1.0 - part) for rim, part in zip(rims, lost.tolist(), strict=True))
        true_v = 0.5 * (left + right)
        true_w = (right - left) / (2.0 * side) + wheels.heading_drift * abs(true_v)
        left, right = (rim * (1.0 + part) for rim, part in zip(rims, read.tolist(), strict=True))
        return (true_v, true_w), (0.5 * (left + right), (right - left) / (2.0 * side))
