"""The way driven: points far enough apart, of which a page draws as many as it can."""

import math
from typing import Final

Point = tuple[float, float]
#: Between two points, [m], at first; and most of them, after which every second is left out.
_APART: Final = 0.02
_MOST: Final = 4000
#: No robot drives so far between two poses, [m]: it was set there.
_JUMP: Final = 0.5


class Trail:
    """The way of a drive or a trial."""

    def __init__(self) -> None:
        """Start with none."""
        self.points: list[Point] = []
        self._apart = _APART

    def begin(self) -> None:
        """Begin anew."""
        self.points, self._apart = [], _APART

    def add(self, x: float, y: float) -> bool | None:
        """
        Add a place, [m].

        Returns
        -------
        bool or None
            True if it is a new point, None if it is and all others have changed, else False.

        """
        way = math.dist(self.points[-1], (x, y)) if self.points else math.inf
        if way < self._apart:
            return False
        is_changed = bool(self.points) and way > max(_JUMP, 2.0 * self._apart)
        if is_changed:
            self.begin()
        self.points.append((round(x, 3), round(y, 3)))
        if len(self.points) > _MOST:
            self.points, self._apart, is_changed = self.points[::2], 2.0 * self._apart, True
        return None if is_changed else True
