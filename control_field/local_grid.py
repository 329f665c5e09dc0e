"""
What the robot sees: its neighbourhood, and which steps that local grid allows.

A neighbourhood is a square int8 array, rows by columns, row 0 at the lowest y, the robot's cell in
the middle; decisions go by the 3x3 in its middle. A *mask* packs the eight cells around the
robot's into one byte: bit h is the neighbour in heading h.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import N_HEADINGS, STEP_COL, STEP_ROW

#: Cell states, the values of nav_msgs/OccupancyGrid.
FREE: Final = 0
BLOCKED: Final = 100
UNKNOWN: Final = -1
#: Mask of all eight neighbours.
ALL: Final = 0xFF
#: Greatest number of cells along a side of a neighbourhood.
MAX_SIDE: Final = 61
#: Finer cells that a side of a cell may be divided into: odd, so that one lies in the middle.
SUBDIVISIONS: Final = (1, 3, 5)


def masks_from_neighbourhood(neighbourhood: npt.NDArray[np.int8]) -> tuple[int, int]:
    """
    Pack a neighbourhood into two bytes.

    Parameters
    ----------
    neighbourhood : ndarray of int8, shape (3, 3)
        0 free, -1 unknown, anything else blocked.

    Returns
    -------
    blocked, unknown : int
        Bit h is the neighbour in heading h.

    Raises
    ------
    ValueError
        If the shape is another.

    """
    if neighbourhood.shape != (3, 3):
        raise ValueError(f'a neighbourhood is 3x3, not {neighbourhood.shape}')
    blocked = unknown = 0
    for heading in range(N_HEADINGS):
        state = neighbourhood[1 + STEP_ROW[heading], 1 + STEP_COL[heading]]
        if state == UNKNOWN:
            unknown |= 1 << heading
        elif state != FREE:
            blocked |= 1 << heading
    return blocked, unknown


def crop_neighbourhood(
    occupancy: npt.NDArray[np.int8], row: int, col: int,
) -> npt.NDArray[np.int8]:
    """
    Cut the 3x3 local grid out of a map; what lies outside the map is blocked.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0, 100 or -1 a cell.
    row, col : int
        The robot's cell.

    Returns
    -------
    ndarray of int8, shape (3, 3)

    """
    neighbourhood = np.full((3, 3), BLOCKED, dtype=np.int8)
    rows, cols = occupancy.shape
    top, left = max(row - 1, 0), max(col - 1, 0)
    bottom, right = min(row + 2, rows), min(col + 2, cols)
    if top < bottom and left < right:
        neighbourhood[top - row + 1:bottom - row + 1, left - col + 1:right - col + 1] = (
            occupancy[top:bottom, left:right])
    return neighbourhood


def middle_of(cells: npt.NDArray[np.int8]) -> npt.NDArray[np.int8]:
    """
    Return the 3x3 in the middle of a neighbourhood.

    Parameters
    ----------
    cells : ndarray of int8, shape (n, n)
        ``n`` odd, 3 at least.

    Returns
    -------
    ndarray of int8, shape (3, 3)
        A view.

    """
    low = len(cells) // 2 - 1
    return cells[low:low + 3, low:low + 3]


def cells_from_fine(fine: npt.NDArray[np.int8], k: int) -> npt.NDArray[np.int8]:
    """
    Return the cells that finer ones make up.

    Parameters
    ----------
    fine : ndarray of int8, shape (..., n * k, m * k)
        0 free, 100 blocked, -1 unknown.
    k : int
        How many finer cells lie along a side of a cell.

    Returns
    -------
    ndarray of int8, shape (..., n, m)
        Blocked where one of the finer cells is; else unknown where one of them is, else free.

    """
    if k == 1:
        return fine
    rows, cols = fine.shape[-2] // k, fine.shape[-1] // k
    parts = fine.reshape(*fine.shape[:-2], rows, k, cols, k)
    low, high = parts.min(axis=(-3, -1)), parts.max(axis=(-3, -1))
    return np.asarray(np.where(high > FREE, high, low), dtype=np.int8)


def is_local_grid_size(n: int) -> bool:
    """Return whether a neighbourhood may have ``n`` cells along a side."""
    return n % 2 == 1 and 3 <= n <= MAX_SIDE
