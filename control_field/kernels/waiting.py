"""
Whether a step is worth waiting for: what stands in its way was not there before.

Plain Python over NumPy arrays that numba understands, as `control_field.kernels.steps`: the robot
and the headless world ask the same.
"""

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import CellMap, step_allowed, StepRules


def comes_into_the_way(
    known: CellMap, row: int, col: int, heading: int, blocked: int, rules: StepRules,
) -> bool:
    """
    Return whether something stands in the way of a step where there was room for it before.

    For a diagonal step the two cells beside it count, too. Where a cell of the step was never
    seen free and is blocked now, there is a wall: nobody waits for that to go.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map with what was seen in this trial, before what is seen now.
    row, col : int
        The robot's cell.
    heading : int
        Of the step, 0 to 7.
    blocked : int
        Mask of the cells around it that are seen blocked now.
    rules : StepRules

    """
    if not step_allowed(known, row, col, heading, rules):
        return False
    reach = 1 if heading % 2 == 1 and not rules.corner_cutting else 0
    comes = False
    for turn in range(-reach, reach + 1):
        beside = (heading + turn) % 8
        if blocked >> beside & 1:
            if known[row + STEP_ROW[beside], col + STEP_COL[beside]] != 0:
                return False
            comes = True
    return comes
