"""Whether the robot has come to stand where the field does not reach."""

from collections.abc import Callable
import math
from typing import Final

Place = tuple[float, float]

#: A robot that has moved less than so much since the last look stands, [m].
_STILL: Final = 0.01


class RoomWatch:
    """
    Asks for room for the robot where it stands, once for each place.

    Parameters
    ----------
    has_room : callable
        Returns whether the field holds a robot at a place, [m].

    """

    def __init__(self, has_room: Callable[[Place], bool]) -> None:
        """Start with nothing heard of the robot."""
        self._has_room = has_room
        self._last: Place | None = None
        self._asked: Place | None = None

    def look(self, place: Place | None, is_free: bool) -> bool:
        """
        Return True if the field has to grow now; call it about twice a second.

        Parameters
        ----------
        place : tuple of float or None, [m]
            Where the robot is; None if it was not heard of.
        is_free : bool
            Whether nothing is under way that the field belongs to.

        """
        stands, self._last = _is_near(place, self._last), place
        if place is None or not stands or not is_free:
            return False
        if _is_near(place, self._asked) or self._has_room(place):
            return False
        self._asked = place
        return True


def _is_near(one: Place | None, other: Place | None) -> bool:
    return one is not None and other is not None and math.dist(one, other) < _STILL
