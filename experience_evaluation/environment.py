"""What is true around the robot while a trial runs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from control_field.kernels import compiled
from control_field.learning.grid_world import GridWorld
from control_field.learning.moving_world import MovingWorld
from control_field.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Environment:
    """
    The true world of some trials; methods are tried in it, and told nothing of it.

    Parameters
    ----------
    world : GridWorld
        The true map and the rules of a step.
    goal : tuple of int
        ``(row, col)``
    home : ndarray of bool, shape (n_rows, n_cols), optional
        Cells that the robot may be in although no way leads from them to the goal now, as one did
        before the world changed.

    """

    world: GridWorld
    goal: tuple[int, int]
    home: npt.NDArray[np.bool_] | None = None

    @cached_property
    def shortest(self) -> npt.NDArray[np.float64]:
        """Return the true least cost from every cell to the goal, [cells]; inf without a way."""
        if self.world.truth[self.goal] != 0:
            return np.full(self.world.truth.shape, np.inf)
        return self.world.cost_to(self.goal)

    @cached_property
    def reachable(self) -> npt.NDArray[np.bool_]:
        """Return the free cells with a way to the goal, shape (n_rows, n_cols)."""
        return np.isfinite(self.shortest)

    @cached_property
    def startable(self) -> npt.NDArray[np.bool_]:
        """Return the cells that a trial may start from, shape (n_rows, n_cols)."""
        cells = self.reachable.copy()
        if self.home is not None:
            cells |= self.home & (self.world.truth == 0)
        cells[self.goal] = False
        return cells

    @cached_property
    def allowed(self) -> npt.NDArray[np.int64]:
        """Return the mask of the steps that the true world allows, shape (n_places,)."""
        truth, rules = self.world.truth, self.world.rules
        return np.array([compiled.allowed_steps(truth, *cell, rules)
                         for cell in np.ndindex(truth.shape)], dtype=np.int64)

    @property
    def n_mover_contacts(self) -> int:
        """Return how often something that moves ran into the robot, in all trials so far."""
        return self.world.n_mover_contacts if isinstance(self.world, MovingWorld) else 0

    def world_with(self, parameters: Parameters) -> GridWorld:
        """Return the true world for a robot with other parameters."""
        if parameters == self.world.parameters:
            return self.world
        return self.world.with_parameters(parameters)
