"""Where goals and starts are put on a map that names none."""

import numpy as np
import numpy.typing as npt

from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation.teachers import NoWayError

Cell = tuple[int, int]
_N_ATTEMPTS = 100


def choose_places(occupancy: npt.NDArray[np.int8], rng: np.random.Generator,
                  ) -> tuple[Cell, Cell]:
    """
    Draw a goal in the largest part of the free space, and a start in the farther half of it.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, anything else blocked.
    rng : numpy.random.Generator

    Returns
    -------
    goal, start : tuple of int
        ``(row, col)``

    Raises
    ------
    NoWayError
        If the world has no two free cells with a way between them.

    """
    world = GridWorld(occupancy, Parameters())
    free = np.argwhere(world.truth == 0)
    best: tuple[int, Cell, npt.NDArray[np.float64]] | None = None
    for index in rng.permutation(len(free))[:_N_ATTEMPTS]:
        goal = (int(free[index, 0]), int(free[index, 1]))
        cost = world.cost_to(goal)
        n = int(np.isfinite(cost).sum())
        if best is None or n > best[0]:
            best = n, goal, cost
        if 2 * n > len(free):
            break
    if best is None or best[0] < 2:
        raise NoWayError('the world has no two free cells with a way between them')
    n, goal, cost = best
    order = np.argsort(cost, axis=None, kind='stable')[:n]
    row, col = divmod(int(order[int(rng.integers(n // 2, n))]), cost.shape[1])
    return goal, (row, col)


def nearest_cell(cells: npt.NDArray[np.bool_], cell: Cell) -> Cell | None:
    """Return the marked cell that is nearest to one, the first of several; None of none."""
    marked = np.argwhere(cells)
    if not len(marked):
        return None
    row, col = marked[((marked - np.array(cell)) ** 2).sum(axis=1).argmin()]
    return int(row), int(col)
