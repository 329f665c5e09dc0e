"""
What can be seen from a cell, by straight lines.

A ray is the cells that a straight line from the middle of the robot's cell leads through, one
after another; it ends in the first occupied one. What no ray comes to lies behind something.
"""

from functools import lru_cache

import numpy as np

from control_field.kernels.steps import CellMap
from control_field.kernels.visibility import Rays
from control_field.local_grid import BLOCKED, middle_of, UNKNOWN

#: Lines through each cell on the edge of what is seen. They leave it an odd number of eighths of
#: a cell beside its middle, so that none of them leads through a corner of any cell.
_LINES = (-0.375, -0.125, 0.125, 0.375)


@lru_cache(maxsize=8)
def rays_within(reach: int, radius: float = np.inf) -> Rays:
    """
    Return the rays to all sides of a cell; those along a side are a quarter turn of each other.

    Parameters
    ----------
    reach : int, [cells]
        From the robot's cell to the edge of what is seen; 0: no rays.
    radius : float, [cells]
        Cells whose middle lies farther away are not seen.

    Returns
    -------
    ndarray of int16, shape (n_rays, n_cells, 2)
        Cells that lie too far away are (0, 0), the robot's own.

    """
    edge = np.arange(-reach, reach + 1)[:, np.newaxis] + np.array(_LINES)
    slopes = edge.reshape(-1, 1, 1) / (reach + 0.5)
    cols = np.arange(reach + 1)[:, np.newaxis]
    # In each column a ray that rises by less than a cell is in one row, or in two.
    rows = np.rint(slopes * (cols + np.array([-0.5, 0.5]))).astype(np.int16)
    one_side = np.stack([rows, np.broadcast_to(cols, rows.shape)], axis=-1).reshape(
        len(slopes), -1, 2)[:, 1:]
    row, col = one_side[..., 0], one_side[..., 1]
    sides = [one_side, np.stack([col, -row], axis=-1), -one_side, np.stack([-col, row], axis=-1)]
    rays = np.concatenate(sides).astype(np.int16) if reach else np.zeros((0, 0, 2), np.int16)
    rays[np.hypot(rays[..., 0], rays[..., 1]) > radius] = 0
    return rays


def visible_cells(window: CellMap, rays: Rays) -> CellMap:
    """
    Return what is seen of the cells around the robot's; the nine in the middle always are.

    Parameters
    ----------
    window : ndarray of int8, shape (n, n)
        Their true states, 0 or 100.
    rays : ndarray of int16
        Of `rays_within`.

    Returns
    -------
    ndarray of int8, shape (n, n)
        0 free, 100 blocked, -1 unknown.

    """
    middle = len(window) // 2
    rows, cols = rays[..., 0] + middle, rays[..., 1] + middle
    states = window[rows, cols]
    ends = (states == BLOCKED) & ((rows != middle) | (cols != middle))
    is_open = np.cumsum(ends, axis=1) - ends == 0
    seen = np.full_like(window, UNKNOWN)
    seen[rows[is_open], cols[is_open]] = states[is_open]
    middle_of(seen)[:] = middle_of(window)
    return seen
