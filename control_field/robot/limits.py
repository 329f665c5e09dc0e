"""What a robot's body can do: how fast, how suddenly, and how wide it is."""

from dataclasses import dataclass
import math
from typing import Final

from control_field.robot.footprint import Footprint

#: Forward speed [m/s] and turning rate [rad/s].
Velocity = tuple[float, float]

STANDSTILL: Velocity = (0.0, 0.0)
#: Distance kept from what is blocked, beyond the body, [m].
MARGIN: Final = 0.001


@dataclass(frozen=True, slots=True)
class Limits:
    """
    Limits of a differential-drive robot; the defaults are a TurtleBot3 Burger's.

    Parameters
    ----------
    v_max : float
        Greatest forward and backward speed, [m/s].
    w_max : float
        Greatest turning rate, [rad/s].
    a_max : float
        Greatest change of speed, [m/s^2].
    alpha_max : float
        Greatest change of turning rate, [rad/s^2].
    radius : float
        Radius of the body, [m].
    footprint : Footprint, optional
        Its outline, where it is no disc: then the radius says nothing of where it may drive.

    Raises
    ------
    ValueError
        If a limit is not a positive number (the radius may be 0); the message names it.

    """

    v_max: float = 0.22
    w_max: float = 2.84
    a_max: float = 2.5
    alpha_max: float = 3.2
    radius: float = 0.105
    footprint: Footprint | None = None

    def __post_init__(self) -> None:
        """Refuse what is no limit."""
        for name in ('v_max', 'w_max', 'a_max', 'alpha_max'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f'{name} is {value}, must be above 0')
        if not (math.isfinite(self.radius) and self.radius >= 0.0):
            raise ValueError(f'radius is {self.radius} m, must be 0 or more')


def clamp(value: float, low: float, high: float) -> float:
    """Return the number of ``[low, high]`` nearest to ``value``."""
    return low if value < low else high if value > high else value


def nearest_to_rest(first: Velocity, second: Velocity) -> Velocity:
    """Return of speed and turning rate the smaller of two; 0 where they differ in direction."""
    v, w = (math.copysign(min(abs(a), abs(b)), a) if a * b > 0.0 else 0.0
            for a, b in zip(first, second, strict=True))
    return v, w


def within_speed(wanted: Velocity, limits: Limits) -> Velocity:
    """Return the velocity nearest to ``wanted`` that the robot can drive at all."""
    return (clamp(wanted[0], -limits.v_max, limits.v_max),
            clamp(wanted[1], -limits.w_max, limits.w_max))


def within_acceleration(
    wanted: Velocity, previous: Velocity, dt: float, limits: Limits,
) -> Velocity:
    """
    Return the velocity nearest to ``wanted`` that can be reached from ``previous`` in time.

    Parameters
    ----------
    wanted, previous : tuple of float, [m/s] and [rad/s]
    dt : float
        Time since ``previous`` was commanded, [s], not negative.

    """
    dv, dw = limits.a_max * dt, limits.alpha_max * dt
    return (clamp(wanted[0], previous[0] - dv, previous[0] + dv),
            clamp(wanted[1], previous[1] - dw, previous[1] + dw))
