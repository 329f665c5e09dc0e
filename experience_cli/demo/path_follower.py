"""A scripted driver: follows a line as a person would, looking ahead. ROS-free."""

from collections.abc import Sequence
from itertools import pairwise
import math
from typing import Final

from control_field.grid import Grid

#: How far ahead the driver looks, how near the end is near enough, [m].
LOOK_AHEAD: Final = 0.12
NEAR: Final = 0.01
#: Turning rate for a radian off the heading, [1/s], and the greatest one, [rad/s].
_GAIN: Final = 4.0
_MAX_TURN_RATE: Final = 1.5
_SLOWING: Final = 1.5

Point = tuple[float, float]


def points_from_cells(grid: Grid, cells: Sequence[tuple[int, int]]) -> list[Point]:
    """Return the centres ``(x, y)`` of cells ``(row, col)``, [m]."""
    return [grid.world_from_cell(row, col) for row, col in cells]


def cells_along(corners: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the cells ``(row, col)`` of a way that leads straight from corner to corner."""
    cells = list(corners[:1])
    for row, col in corners[1:]:
        while cells[-1] != (row, col):
            last_row, last_col = cells[-1]
            cells.append((last_row + (row > last_row) - (row < last_row),
                          last_col + (col > last_col) - (col < last_col)))
    return cells


class Driver:
    """
    Drives along a line of points.

    Parameters
    ----------
    points : sequence of (x, y), [m]
        At least two, none equal to the one before.
    speed : float
        [m/s]

    """

    def __init__(self, points: Sequence[Point], speed: float = 0.2) -> None:
        self._points = list(points)
        self._lengths = [math.dist(*ends) for ends in pairwise(points)]
        self._speed = speed
        self._at = 0.0

    @property
    def length(self) -> float:
        """Return the length of the line, [m]."""
        return sum(self._lengths)

    @property
    def travelled(self) -> float:
        """Return how far along the line the robot has come, [m]."""
        return self._at

    def command(self, x: float, y: float, yaw: float) -> tuple[float, float] | None:
        """Return speed and turning rate for a pose, [m/s, rad/s]; None at the end of the line."""
        self._advance(x, y)
        left = math.hypot(self._points[-1][0] - x, self._points[-1][1] - y)
        if self.length - self._at <= NEAR:
            return None
        target = self._point(self._at + LOOK_AHEAD)
        off = math.remainder(math.atan2(target[1] - y, target[0] - x) - yaw, math.tau)
        turn = max(-_MAX_TURN_RATE, min(_MAX_TURN_RATE, _GAIN * off))
        return min(self._speed, _SLOWING * left) * max(math.cos(off), 0.0), turn

    def _advance(self, x: float, y: float) -> None:
        """Move on to the nearest point a little further along the line."""
        step = LOOK_AHEAD / 8
        while self._at < self.length:
            ahead = min(self._at + step, self.length)
            if math.dist(self._point(ahead), (x, y)) > math.dist(self._point(self._at), (x, y)):
                return
            self._at = ahead

    def _point(self, distance: float) -> Point:
        """Return the point so far along the line, [m]; beyond its end, on its continuation."""
        last = len(self._lengths) - 1
        for i, length in enumerate(self._lengths):
            if distance <= length or i == last:
                share = distance / length
                (ax, ay), (bx, by) = self._points[i], self._points[i + 1]
                return ax + share * (bx - ax), ay + share * (by - ay)
            distance -= length
        raise AssertionError('a line has at least one piece')
