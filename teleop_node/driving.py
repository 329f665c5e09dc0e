"""
Hold to move: which command to send, from which keys came when.

A terminal tells of presses only, never of releases, so that a key counts as held for `hold_time`
after it last came. While a key is held the terminal repeats it, but first after a delay of its
own (0.25 to 0.66 s): a robot that must stop 0.3 s after the last key may therefore pause once
after a press, until the repeats come. Safety goes before smoothness here; `xset r rate 220 30`,
or a longer `hold_time`, makes it smooth.
"""

from collections.abc import Mapping
import math
from typing import Final

from control_field.robot.limits import clamp, STANDSTILL, Velocity

#: How long the standstill is told after the last key, [s]: one message may be lost.
LINGER: Final = 0.3

#: Forward and turning, in shares of the speeds: the letters of teleop_twist_keyboard.
MOVES: Final[Mapping[str, tuple[int, int]]] = {
    'u': (1, 1), 'i': (1, 0), 'o': (1, -1),
    'j': (0, 1), 'k': (0, 0), 'l': (0, -1),
    'm': (-1, -1), ',': (-1, 0), '.': (-1, 1)}

#: The key of `MOVES` that stops.
STANDING: Final = 'k'

#: What a key makes of speed and turning rate.
FACTORS: Final[Mapping[str, tuple[float, float]]] = {
    'q': (1.1, 1.1), 'z': (0.9, 0.9), 'w': (1.1, 1.0), 'x': (0.9, 1.0), 'e': (1.0, 1.1),
    'c': (1.0, 0.9)}

#: The least speeds the keys lead to, [m/s] and [rad/s].
SLOWEST: Final = (0.01, 0.05)


def changed_speeds(key: str, speeds: Velocity, greatest: Velocity) -> Velocity:
    """Return the speeds after a key that makes faster or slower, within what is allowed."""
    v, w = (clamp(speed * factor, least, most) for speed, factor, least, most in zip(
        speeds, FACTORS[key], SLOWEST, greatest, strict=True))
    return v, w


class Driving:
    """
    What to command.

    Parameters
    ----------
    speeds : tuple of float, [m/s] and [rad/s]
        Forward and turning, of a key that is held.
    hold_time : float, [s]
        How long a key counts as held.

    """

    def __init__(self, speeds: Velocity, hold_time: float) -> None:
        """Start silent."""
        self.speeds = speeds
        self.hold_time = hold_time
        self._move = (0, 0)
        self._pressed = self._stopped = -math.inf

    def press(self, key: str, now: float) -> None:
        """Hold one of the keys of `MOVES`."""
        self._move = MOVES[key]
        self._pressed = self._stopped = now

    def stop(self, now: float) -> None:
        """Let go of whatever is held, and tell the robot so."""
        self._move = (0, 0)
        self._pressed, self._stopped = -math.inf, now

    def velocity(self, now: float) -> Velocity:
        """Return the velocity that is asked for at a time."""
        if now - self._pressed >= self.hold_time:
            return STANDSTILL
        return self._move[0] * self.speeds[0], self._move[1] * self.speeds[1]

    def command(self, now: float) -> Velocity | None:
        """
        Return what to send at a time; None where there is nothing to say.

        Silence lets others drive: during a trial the robot then follows its field again.
        """
        held = 0.0 if math.isinf(self._pressed) else self.hold_time
        if now - self._stopped >= held + LINGER:
            return None
        return self.velocity(now)


class RateLimiter:
    """
    Lets commands pass: every change at once, the same again at a rate.

    Parameters
    ----------
    period : float, [s]
        Between the same commands.

    """

    def __init__(self, period: float) -> None:
        """Start with nothing sent."""
        self.period = period
        self._last: Velocity | None = None
        self._due = -math.inf

    def limit(self, command: Velocity | None, now: float) -> Velocity | None:
        """Return the command if it is to be sent now; None otherwise."""
        changed, self._last = command != self._last, command
        if command is None or not (changed or now >= self._due):
            return None
        # In step with the last one, so that the rate holds on average.
        self._due = now + self.period if changed else max(self._due, now - self.period) + (
            self.period)
        return command
