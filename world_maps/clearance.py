"""How much room there is around a disc, between the blocked pixels and walls of a world."""

import math
from typing import Final

import numpy as np

from control_field.local_grid import FREE
from world_maps.world import World

#: Distances beyond this are not told apart, [m]: a step of the simulation is shorter.
_HORIZON: Final = 0.05


class Clearance:
    """
    The room around a disc.

    Parameters
    ----------
    world : World
        What stands where; around the workspace are walls.
    radius : float, [m]
        Of the disc.

    """

    def __init__(self, world: World, radius: float) -> None:
        """Keep the blocked pixels as bytes, which are fast to search."""
        pixels = world.pixels
        self.radius = radius
        self._reach = radius + _HORIZON
        self._side = pixels.grid.resolution
        self._low, self._high = pixels.extent[:2], pixels.extent[2:]
        self._rows = [row.tobytes() for row in (pixels.occupancy != FREE).astype(np.uint8)]

    def at(self, x: float, y: float) -> float:
        """
        Return the distance from the disc's edge to what is next to it.

        Parameters
        ----------
        x, y : float, [m]
            Centre of the disc.

        Returns
        -------
        float, [m]
            Negative where the disc overlaps a blocked pixel or a wall, 0 where it touches one,
            never above 0.05.

        """
        best = min(x - self._low[0], self._high[0] - x, y - self._low[1], self._high[1] - y,
                   self._reach)
        first, last = self._span(y, self._low[1], len(self._rows))
        left, right = self._span(x, self._low[0], len(self._rows[0]))
        for row in range(first, last):
            col = self._rows[row].find(1, left, right)
            while col >= 0:
                best = min(best, self._distance(x, y, row, col))
                col = self._rows[row].find(1, col + 1, right)
        return best - self.radius

    def _span(self, value: float, low: float, count: int) -> tuple[int, int]:
        """Return the half-open range of rows or columns within reach of a coordinate."""
        first = math.floor((value - self._reach - low) / self._side)
        last = math.floor((value + self._reach - low) / self._side) + 1
        return min(max(first, 0), count), min(max(last, 0), count)

    def _distance(self, x: float, y: float, row: int, col: int) -> float:
        """Return the distance of a point from a pixel, 0 inside it, [m]."""
        x_low = self._low[0] + col * self._side
        y_low = self._low[1] + row * self._side
        return math.hypot(max(x_low - x, 0.0, x - x_low - self._side),
                          max(y_low - y, 0.0, y - y_low - self._side))
