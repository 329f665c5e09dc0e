"""Changes of the true world: doors that close and open, or another map, at a trial or a time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE
from world_maps.movers import Disc
from world_maps.window import occupy
from world_maps.world import World


@dataclass(frozen=True, eq=False)
class Change:
    """
    Pixels of a world that become others.

    Parameters
    ----------
    cells : ndarray of bool, shape (n_rows, n_cols)
        Which pixels it is about.
    states : ndarray of int8, shape (n_rows, n_cols)
        What these become: 0 free, 100 blocked.
    at_trial : int, optional
        It comes before this trial, when the one before (0: the demonstration) has ended.
    at_time : float, optional, [s]
        Instead: it comes at this time.
    name : str
        For messages.

    """

    cells: npt.NDArray[np.bool_]
    states: npt.NDArray[np.int8]
    at_trial: int | None = None
    at_time: float | None = None
    name: str = ''

    def is_due(self, seconds: float, last_trial: int) -> bool:
        """Return whether it comes by a time, after a trial that has ended (-1: none has)."""
        if self.at_trial is not None:
            return last_trial >= self.at_trial - 1
        return self.at_time is not None and seconds >= self.at_time - 1e-9

    def of(self, occupancy: npt.NDArray[np.int8]) -> npt.NDArray[np.int8]:
        """Return what it makes of the pixels of a world."""
        return np.where(self.cells, self.states, occupancy).astype(np.int8)


def cells_within(grid: Grid, low: tuple[float, float], high: tuple[float, float],
                 ) -> npt.NDArray[np.bool_]:
    """Return the cells whose centres lie in a rectangle between two corners (x, y), [m]."""
    x = grid.origin_x + (np.arange(grid.n_cols) + 0.5) * grid.resolution
    y = grid.origin_y + (np.arange(grid.n_rows) + 0.5) * grid.resolution
    return np.logical_and.outer((y >= low[1]) & (y <= high[1]), (x >= low[0]) & (x <= high[0]))


def in_cells(change: Change, world: World) -> Change:
    """
    Return a change of pixels as one of the cells of a world.

    Parameters
    ----------
    change : Change
    world : World
        Before it.

    """
    if world.drawn is None:
        return change
    after = world.with_pixels(change.of(world.drawn.occupancy)).occupancy
    return replace(change, cells=after != world.occupancy, states=after)


class ChangingWorld:
    """
    A world as time passes and trials end.

    Parameters
    ----------
    world : World
        As it is at first.
    changes : sequence of Change
        In the order in which they are made where several are due.

    """

    def __init__(self, world: World, changes: Sequence[Change] = ()) -> None:
        self.first, self.changes = world, tuple(changes)
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self.world, self._coming = self.first, list(self.changes)

    def update(self, seconds: float, last_trial: int, robot: Disc | None = None) -> list[Change]:
        """
        Make the changes that are due.

        Parameters
        ----------
        seconds : float
            Time since the beginning.
        last_trial : int
            The last trial that has ended, 0 for a demonstration, -1 for none.
        robot : Disc, optional
            No pixel closes into which it reaches: that waits until it has left.

        Returns
        -------
        list of Change
            Which were made now, whole or in part.

        """
        made, coming = [], []
        for change in self._coming:
            if not change.is_due(seconds, last_trial):
                coming.append(change)
                continue
            waits = self._under(robot) & change.cells & (change.states == BLOCKED)
            before = self.world.pixels.occupancy
            occupancy = replace(change, cells=change.cells & ~waits).of(before)
            if (occupancy != before).any():
                self.world = self.world.with_pixels(occupancy)
                made.append(change)
            if (waits & (occupancy == FREE)).any():
                coming.append(replace(change, cells=waits))
        self._coming = coming
        return made

    def _under(self, robot: Disc | None) -> npt.NDArray[np.bool_]:
        grid = self.world.pixels.grid
        cells = np.zeros(grid.shape, dtype=np.int8)
        if robot is not None:
            occupy(cells, robot, (grid.origin_x, grid.origin_y), grid.resolution)
        return np.asarray(cells == BLOCKED)
