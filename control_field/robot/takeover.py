"""Who holds the robot: which commands are the controller's own, and whether a person drives."""

import math
from typing import Final

from control_field.robot.limits import Velocity

#: Speeds below these move nobody, [m/s] and [rad/s]: a stick that does not quite come back.
_REST: Final = (1e-3, 1e-3)


def moves(velocity: Velocity) -> bool:
    """Return whether a command is one to drive, and not one to stand."""
    return abs(velocity[0]) > _REST[0] or abs(velocity[1]) > _REST[1]


class TakeoverDetector:
    """
    Whether somebody else commands the robot.

    Many programs send standstill all the time, whether anybody touches a key or not. That takes
    nothing over; but who has moved the robot and then sends standstill holds it, for as long as
    the commands follow each other within the timeout. Each topic has a person of its own: one who
    only sends standstill there does not hold what was moved through another topic.

    Parameters
    ----------
    timeout : float
        How long after the last command of somebody else the person is taken to have let go, [s].

    Attributes
    ----------
    topic : str
        On which the person commands, or commanded last.

    """

    def __init__(self, timeout: float) -> None:
        """Start with nobody."""
        self.timeout = timeout
        self.topic = ''
        self._last: dict[str, float] = {}

    def on_external_command(self, now: float, is_driving: bool = True, topic: str = '') -> None:
        """
        Take in a command that is not the controller's own.

        Parameters
        ----------
        now : float, [s]
        is_driving : bool
            Whether it is one to drive; False for standstill.
        topic : str
            Where it came.

        """
        if is_driving or self.holds(topic, now):
            self._last[topic], self.topic = now, topic

    def let_go(self) -> None:
        """Forget who drove: the robot has been handed over."""
        self._last.clear()

    def is_taken_over(self, now: float) -> bool:
        """Return whether a person still drives, or holds the robot."""
        return any(self.holds(topic, now) for topic in self._last)

    def holds(self, topic: str, now: float) -> bool:
        """Return whether the person on a topic holds the robot."""
        return now - self._last.get(topic, -math.inf) < self.timeout


class OwnCommands:
    """
    Which commands that come back on `cmd_vel` are the controller's own.

    A middleware hands a publisher's messages back in the order they were sent, so one that
    comes back must be among those that are still out; what was sent before it was lost on the
    way. Commands are compared by value, and by stamp where they have one.

    Parameters
    ----------
    limit : int
        How many may be out.

    """

    def __init__(self, limit: int = 64) -> None:
        """Start with nothing sent."""
        self.limit = limit
        self._out: list[tuple[float, ...]] = []

    def sent(self, *command: float) -> None:
        """Note a command that is about to be published."""
        self._out.append(command)
        if len(self._out) > self.limit:
            del self._out[0]

    def is_own(self, *command: float) -> bool:
        """Return whether a command that arrived is an own one that is still out."""
        return command in self._out

    def forget(self, *command: float) -> None:
        """Forget a command that has come back, and those that were sent before it."""
        del self._out[:self._out.index(command) + 1]
