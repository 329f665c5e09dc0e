"""
What the robot sees: its 3x3 neighbourhood, and which steps that local grid allows.

A neighbourhood is an int8 array of shape (3, 3), rows by columns, row 0 at the lowest y, the
robot's cell in the middle. A *mask* packs the eight cells around it into one byte: bit h is the
neighbour in heading h.
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
