"""From where a field leads home, in NumPy alone: for who shows fields and must not compile."""

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors, N_HEADINGS, STEP_COL, STEP_ROW
from control_field.kernels.steps import StepRules
from control_field.local_grid import BLOCKED, UNKNOWN
from control_field.records import ControlField

Mask = npt.NDArray[np.bool_]


def leads_home(field: ControlField, rules: StepRules) -> Mask:
    """
    Follow a field from every cell at once: what `kernels.rollout.flow_basin` finds.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        True where following it on its own remembered map reaches the goal.

    """
    headings = headings_from_vectors(field.vx, field.vy)
    occupied = (field.known == BLOCKED) | (rules.unknown_is_blocked & (field.known == UNKNOWN))
    after = _cells_after(headings, _steps_allowed(headings, field.known, occupied, rules))
    goal = field.goal[0] * field.grid.n_cols + field.goal[1]
    after[goal] = goal
    # Each round looks twice as far ahead.
    for _ in range(len(after).bit_length()):
        after = after[after]
    reached: Mask = (after == goal).reshape(field.known.shape) & ~occupied
    return reached


def _steps_allowed(
    headings: npt.NDArray[np.int8], known: npt.NDArray[np.int8], occupied: Mask, rules: StepRules,
) -> Mask:
    """Return where the map allows the step of the heading: `kernels.steps.step_allowed`."""
    free = ~np.pad(occupied, 1, constant_values=True)
    clear = free & ~np.pad(known > 0, 1, constant_values=True)
    allowed = np.zeros(headings.shape, dtype=np.bool_)
    for heading in range(N_HEADINGS):
        row, col = int(STEP_ROW[heading]), int(STEP_COL[heading])
        may = _beside(free, row, col)
        if heading % 2:
            may = may & (rules.moves != 4)
            if not rules.corner_cutting:
                may = may & _beside(clear, row, 0) & _beside(clear, 0, col)
        allowed |= (headings == heading) & may
    return allowed


def _beside(padded: Mask, row: int, col: int) -> Mask:
    """Return what is so many rows and columns farther, of a mask with a margin of one."""
    n_rows, n_cols = padded.shape
    return padded[1 + row:n_rows - 1 + row, 1 + col:n_cols - 1 + col]


def _cells_after(headings: npt.NDArray[np.int8], allowed: Mask) -> npt.NDArray[np.int64]:
    """Return the cell that each one leads to, by number; itself where no step is allowed."""
    steps = np.asarray(STEP_ROW) * headings.shape[1] + np.asarray(STEP_COL)
    here = np.arange(headings.size, dtype=np.int64)
    return np.where(allowed.ravel(), here + steps[headings.ravel()], here)
