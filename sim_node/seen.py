"""What the simulated robot sees around its cell."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED, cells_from_fine, SUBDIVISIONS, UNKNOWN
from control_field.rays import rays_within, visible_cells
from sim_node.settings import SimSettings
from world_maps.movers import Disc
from world_maps.window import true_window
from world_maps.world import World

Cells = npt.NDArray[np.int8]


class Seen(NamedTuple):
    """
    A local grid: 0 free, 100 blocked, -1 unknown; row 0 at the lowest y.

    Parameters
    ----------
    cells : ndarray of int8, shape (n, n)
    fine : ndarray of int8, shape (n * k, n * k), or None
        The same in finer cells.

    """

    cells: Cells
    fine: Cells | None


def seen_from(
    world: World, discs: Iterable[Disc | None], row: int, col: int, settings: SimSettings,
    tick: int = 0,
) -> Seen:
    """
    Return what is seen from the middle of a cell.

    The cells around the robot's are always seen, as feelers would; what is farther away is unknown
    where something stands before it, or beyond the range.

    Parameters
    ----------
    world : World
    discs : iterable of Disc or None
        What moves.
    row, col : int
        The robot's cell.
    settings : SimSettings
    tick : int
        What is shown wrongly in a tick is the same however often one looks.

    """
    reach = settings.sight_cells // 2
    k = settings.sight_subdivision or (1 if world.drawn is None else SUBDIVISIONS[-1])
    window = true_window(world, discs, row, col, reach, k)
    if reach > 1:
        radius = settings.sight_range / world.grid.resolution * k or np.inf
        nine = slice((reach - 1) * k, (reach + 2) * k)
        seen = visible_cells(window, rays_within(len(window) // 2, radius))
        seen[nine, nine] = window[nine, nine]
        window = seen
    if settings.sight_flips:
        rng = np.random.default_rng([settings.seed, tick])
        wrong = (rng.random(window.shape) < settings.sight_flips) & (window != UNKNOWN)
        window[wrong] = BLOCKED - window[wrong]
    return Seen(cells_from_fine(window, k), window if k > 1 else None)
