"""
How likely a 3x3 local grid is from a cell: beside the remembered map and the last local grid.

Both are relative, 1 where nothing contradicts, and heavy-tailed: whatever is wrong counts no
further than that something has moved. So an obstacle that is new is learnt and does not carry the
robot's place away.
"""

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.local_grid import UNKNOWN

Floats = npt.NDArray[np.float64]
Cells = npt.NDArray[np.int8]
Indices = npt.NDArray[np.intp]

#: How likely a cell of the local grid is not what the map says, or not what the last local grid
#: said.
MAP_ERROR, LOCAL_GRID_ERROR = 0.1, 0.03
#: How likely everything is different: evidence counts no further than that.
UPHEAVAL: Final = 1e-3
#: Row and column of the nine cells of a local grid, from the middle one.
OFFSETS: Final = np.array([(i, j) for i in range(-1, 2) for j in range(-1, 2)])


def likelihood(remembered: Cells, cells: Cells, rows: Indices, cols: Indices) -> Floats:
    """
    Return how well a local grid fits a map around cells.

    Parameters
    ----------
    remembered : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked, -1 unseen, at least 3 x 3; cells on its rim or beyond it count as the
        nearest ones that have neighbours all around.
    cells : ndarray of int8, shape (3, 3)
        The local grid, in the same numbers.
    rows, cols : ndarray of int, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        `UPHEAVAL` to 1.

    """
    shape = remembered.shape
    r = np.clip(rows, 1, shape[0] - 2)[:, None] + OFFSETS[:, 0]
    c = np.clip(cols, 1, shape[1] - 2)[:, None] + OFFSETS[:, 1]
    there, here = remembered[r, c], cells.ravel()
    wrong = ((there != here) & (there != UNKNOWN) & (here != UNKNOWN)).sum(axis=1)
    fit: Floats = np.maximum(MAP_ERROR ** wrong, UPHEAVAL)
    return fit


def continuity(last: Cells, cells: Cells, rows_come: Indices, cols_come: Indices) -> Floats:
    """
    Return how well two local grids fit together, if the robot has come so many cells in between.

    Parameters
    ----------
    last, cells : ndarray of int8, shape (3, 3)
        Two local grids, one after the other.
    rows_come, cols_come : ndarray of int, shape (n,)
        Farther than two cells nothing of the last local grid is left to compare.

    Returns
    -------
    ndarray, shape (n,)
        `UPHEAVAL` to 1.

    """
    table = _continuities(last.tobytes(), cells.tobytes())
    return table[np.clip(rows_come, -3, 3) + 3, np.clip(cols_come, -3, 3) + 3]


@lru_cache(maxsize=4096)
def _continuities(last_bytes: bytes, cells_bytes: bytes) -> Floats:
    """Return the fit of two local grids for all steps, -3 to 3 rows and columns: shape (7, 7)."""
    last, cells = (np.frombuffer(local_grid, np.int8).reshape(3, 3)
                   for local_grid in (last_bytes, cells_bytes))
    fit = np.ones((7, 7))
    for i in range(-2, 3):
        for j in range(-2, 3):
            before = last[max(i, 0):3 + min(i, 0), max(j, 0):3 + min(j, 0)]
            after = cells[max(-i, 0):3 + min(-i, 0), max(-j, 0):3 + min(-j, 0)]
            wrong = ((before != after) & (before != UNKNOWN) & (after != UNKNOWN)).sum()
            fit[i + 3, j + 3] = max(LOCAL_GRID_ERROR ** int(wrong), UPHEAVAL)
    return fit
