"""
The eight headings of a cell-to-cell step.

Index 0 points along +x (growing column); indices grow counter-clockwise, an eighth of a turn each.
"""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

N_HEADINGS: Final = 8

#: Rows and columns a step moves by; row 0 is the lowest y, so +1 row is +y.
STEP_ROW: Final[npt.NDArray[np.int64]] = np.array([0, 1, 1, 1, 0, -1, -1, -1], dtype=np.int64)
STEP_COL: Final[npt.NDArray[np.int64]] = np.array([1, 1, 0, -1, -1, -1, 0, 1], dtype=np.int64)
#: Length of a step, in cells.
STEP_LENGTH: Final[npt.NDArray[np.float64]] = np.hypot(STEP_ROW, STEP_COL)
#: Unit vectors (x, y), shape (8, 2).
UNIT: Final[npt.NDArray[np.float64]] = (
    np.stack([STEP_COL, STEP_ROW], axis=1) / STEP_LENGTH[:, np.newaxis])

for _table in (STEP_ROW, STEP_COL, STEP_LENGTH, UNIT):
    _table.setflags(write=False)


def heading_from_vector(vx: float, vy: float) -> int:
    """
    Return the heading nearest to a direction.

    Parameters
    ----------
    vx, vy : float
        Direction; its length does not matter. A direction exactly between two headings takes the
        counter-clockwise one.

    Returns
    -------
    int
        0 to 7, or -1 for the zero vector and for anything not finite.

    """
    if not (math.isfinite(vx) and math.isfinite(vy)) or (vx == 0.0 and vy == 0.0):
        return -1
    return int(math.floor(math.atan2(vy, vx) / (math.pi / 4) + 0.5)) % N_HEADINGS


def headings_from_vectors(
    vx: npt.NDArray[np.floating], vy: npt.NDArray[np.floating],
) -> npt.NDArray[np.int8]:
    """
    Return the nearest heading of every direction; -1 where there is none.

    Parameters
    ----------
    vx, vy : ndarray, the same shape
        Directions.

    Returns
    -------
    ndarray of int8, the shape of ``vx``

    """
    vx = np.asarray(vx, dtype=np.float64)
    vy = np.asarray(vy, dtype=np.float64)
    defined = np.isfinite(vx) & np.isfinite(vy) & ((vx != 0.0) | (vy != 0.0))
    with np.errstate(invalid='ignore'):
        turns = np.floor(np.arctan2(vy, vx) / (math.pi / 4) + 0.5)
    index = np.where(defined, turns, 0.0).astype(np.int64) % N_HEADINGS
    return np.where(defined, index, -1).astype(np.int8)


def heading_from_step(d_row: int, d_col: int) -> int:
    """
    Return the heading of a step to one of the eight neighbours.

    Raises
    ------
    ValueError
        If ``(d_row, d_col)`` is not such a step.

    """
    for heading in range(N_HEADINGS):
        if STEP_ROW[heading] == d_row and STEP_COL[heading] == d_col:
            return heading
    raise ValueError(f'({d_row}, {d_col}) is not a step to a neighbouring cell')
