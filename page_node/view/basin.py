"""From which cells the field leads to the goal, on the map as the robot remembers it."""

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors, STEP_COL, STEP_ROW
from control_field.local_grid import BLOCKED
from control_field.records import ControlField


def cells_that_lead_home(field: ControlField) -> npt.NDArray[np.bool_]:
    """
    Return from which cells the field leads to its goal.

    As in the certificate, cells that were never seen count as free, and a diagonal step needs both
    cells beside it free. Each round doubles the number of steps that are followed.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)

    """
    n_rows, n_cols = field.grid.shape
    ahead = _cells_ahead(field)
    goal = field.goal[0] * n_cols + field.goal[1]
    ahead[goal] = goal
    for _ in range((n_rows * n_cols).bit_length()):
        farther = ahead[ahead]
        if np.array_equal(farther, ahead):
            break
        ahead = farther
    leads: npt.NDArray[np.bool_] = (
        (ahead == goal).reshape(n_rows, n_cols) & (field.known != BLOCKED))
    return leads


def _cells_ahead(field: ControlField) -> npt.NDArray[np.int64]:
    """Return the index of the cell that each leads to; its own where the way ends."""
    n_rows, n_cols = field.grid.shape
    headings = headings_from_vectors(field.vx, field.vy).ravel()
    # A wall around it all: nothing leads out of the workspace.
    known = np.full((n_rows + 2, n_cols + 2), BLOCKED, dtype=np.int8)
    known[1:-1, 1:-1] = field.known
    own = np.arange(n_rows * n_cols)
    rows, cols = np.divmod(own, n_cols)
    d_rows, d_cols = STEP_ROW[headings], STEP_COL[headings]
    is_free = known[rows + 1 + d_rows, cols + 1 + d_cols] != BLOCKED
    is_clear = (known[rows + 1 + d_rows, cols + 1] <= 0) & (
        known[rows + 1, cols + 1 + d_cols] <= 0)
    goes = (headings >= 0) & is_free & (is_clear | (headings % 2 == 0))
    ahead: npt.NDArray[np.int64] = np.where(goes, own + d_rows * n_cols + d_cols, own)
    return ahead
