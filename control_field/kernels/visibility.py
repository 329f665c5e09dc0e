"""
What can be seen from a cell; plain Python or compiled, as `kernels` says.

A ray is the cells that a straight line from the middle of the robot's cell leads through, one
after another; it ends in the first occupied one. What no ray comes to lies behind something.
"""

import numpy as np
import numpy.typing as npt

from control_field.kernels.steps import _BLOCKED, _UNKNOWN, BoolMap, CellMap

#: Rows and columns from the robot's cell, shape (n_rays, n_cells, 2).
Rays = npt.NDArray[np.int16]
#: Lines through each cell on the edge of what is seen. They leave it an odd number of eighths of
#: a cell beside its middle, so that none of them leads through a corner of any cell.
_LINES = (-0.375, -0.125, 0.125, 0.375)


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
    ends = (states == _BLOCKED) & ((rows != middle) | (cols != middle))
    is_open = np.cumsum(ends, axis=1) - ends == 0
    seen = np.full_like(window, _UNKNOWN)
    seen[rows[is_open], cols[is_open]] = states[is_open]
    nine = slice(middle - 1, middle + 2)
    seen[nine, nine] = window[nine, nine]
    return seen


def look(truth: CellMap, row: int, col: int, rays: Rays, seen: CellMap) -> None:
    """
    Write into ``seen`` what `visible_cells` returns; what lies outside of the map is blocked.

    Parameters
    ----------
    truth : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.
    row, col : int
        The robot's cell.
    seen : ndarray of int8, shape (n, n)

    """
    middle = seen.shape[0] // 2
    seen[:] = _UNKNOWN
    for r in range(-1, 2):
        for c in range(-1, 2):
            seen[middle + r, middle + c] = state_at(truth, row + r, col + c)
    for i in range(rays.shape[0]):
        for j in range(rays.shape[1]):
            r, c = int(rays[i, j, 0]), int(rays[i, j, 1])
            if r != 0 or c != 0:
                state = state_at(truth, row + r, col + c)
                seen[middle + r, middle + c] = state
                if state == _BLOCKED:
                    break


def state_at(truth: CellMap, row: int, col: int) -> int:
    """Return the state of a cell; blocked outside of the map."""
    if row < 0 or col < 0 or row >= truth.shape[0] or col >= truth.shape[1]:
        return _BLOCKED
    return int(truth[row, col])


def remember_cells(known: CellMap, seen: BoolMap, row: int, col: int, cells: CellMap) -> int:
    """
    Write a local grid into the remembered map; return how many cells it newly occupied.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.
    seen : ndarray of bool, shape (n_rows, n_cols)
        Takes where something was seen.
    row, col : int
        The robot's cell, which is free: the robot is there.
    cells : ndarray of int8, shape (n, n)
        0 free, 100 blocked, -1 unknown, the robot's cell in the middle; what lies outside of the
        map is left out.

    """
    low, left = row - cells.shape[0] // 2, col - cells.shape[1] // 2
    bottom, top = max(low, 0), min(low + cells.shape[0], known.shape[0])
    first, last = max(left, 0), min(left + cells.shape[1], known.shape[1])
    new = cells[bottom - low:top - low, first - left:last - left]
    old = known[bottom:top, first:last]
    n_occupied = int(((new == _BLOCKED) & (old != _BLOCKED)).sum())
    known[bottom:top, first:last] = np.where(new == _UNKNOWN, old, new)
    seen[bottom:top, first:last] |= new != _UNKNOWN
    known[row, col], seen[row, col] = 0, True
    return n_occupied
