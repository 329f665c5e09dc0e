"""Repair of sinks and pruning of idle prototypes; compiled, as `kernels` says."""

import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.interpolation import course_at, heading_of, spread
from control_field.kernels.steps import (
    _BLOCKED, best_step, BoolMap, CellMap, FloatMap, IntMap, step_allowed, StepRules)


def through(
    known: CellMap, cost: FloatMap, factor: FloatMap, row: int, col: int, heading: int,
    rules: StepRules,
) -> float:
    """Return the cost to go by way of a step, inf where it is occupied."""
    if heading < 0 or not step_allowed(known, row, col, heading, rules):
        return np.inf
    r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
    total: float = STEP_LENGTH[heading] * factor[r, c] + cost[r, c]
    return total


def needed(
    row: int, col: int, centre: CellMap, totals: tuple[FloatMap, FloatMap, FloatMap],
    known: CellMap, cost: FloatMap, factor: FloatMap, pull: CellMap, strength: float,
    headings: CellMap, window: float, rules: StepRules,
) -> bool:
    """Tell whether a cell of a window has a worse course than ``headings`` says it had."""
    reach = int(window)
    for r in range(max(0, row - reach), min(known.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(known.shape[1], col + reach + 1)):
            if centre[r, c] >= 0 or known[r, c] == _BLOCKED:
                continue
            x, y = course_at(r, c, totals[0], totals[1], totals[2], pull, strength)
            heading = heading_of(x, y)
            if heading != headings[r, c] and (
                    through(known, cost, factor, r, c, heading, rules)
                    > through(known, cost, factor, r, c, headings[r, c], rules) + 1e-9):
                return True
    return False


def idle_prototypes(
    order: IntMap, cells: IntMap, proto_headings: CellMap, weights: FloatMap,
    totals: tuple[FloatMap, FloatMap, FloatMap], centre: CellMap, known: CellMap, cost: FloatMap,
    factor: FloatMap, pull: CellMap, strength: float, headings: CellMap, window: float,
    power: float, visible: bool, rules: StepRules,
) -> BoolMap:
    """
    Drop the prototypes without which no cell's course is worse, one after the other.

    Parameters
    ----------
    order : ndarray of int64
        Which prototypes to try, in this order. ``totals``, ``centre`` and ``headings`` are changed
        in place.

    Returns
    -------
    ndarray of bool, shape (n,)
        Which prototypes are idle.

    """
    idle = np.zeros(cells.shape[0], dtype=np.bool_)
    reach = int(window)
    for k in range(order.shape[0]):
        i = order[k]
        row, col = cells[i, 0], cells[i, 1]
        centre[row, col] = -1
        spread(totals[0], totals[1], totals[2], known, row, col, proto_headings[i], -weights[i],
               window, power, visible)
        if needed(row, col, centre, totals, known, cost, factor, pull, strength, headings, window,
                  rules):
            centre[row, col] = proto_headings[i]
            spread(totals[0], totals[1], totals[2], known, row, col, proto_headings[i],
                   weights[i], window, power, visible)
            continue
        idle[i] = True
        for r in range(max(0, row - reach), min(known.shape[0], row + reach + 1)):
            for c in range(max(0, col - reach), min(known.shape[1], col + reach + 1)):
                if centre[r, c] < 0:
                    x, y = course_at(r, c, totals[0], totals[1], totals[2], pull, strength)
                    headings[r, c] = heading_of(x, y)
    return idle


def mending_cells(
    known: CellMap, cost: FloatMap, factor: FloatMap, headings: CellMap, state: CellMap,
    fixed: BoolMap, rules: StepRules,
) -> BoolMap:
    """
    Choose the cells whose own course must change for the flow to come home.

    Parameters
    ----------
    state : ndarray of int8
        Of `rollout.flow_basin`.
    fixed : ndarray of bool
        Cells that keep their course (demonstrated, not proven blocked) if another one can mend.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        One cell of every loop, and cells whose own course is occupied, none of those beside one
        that was chosen before: each changes the course of the cells around it too.

    """
    rows, cols = known.shape
    chosen = np.zeros((rows, cols), dtype=np.bool_)
    walked = np.zeros((rows, cols), dtype=np.int64)
    mark = 0
    for row in range(rows):
        for col in range(cols):
            if state[row, col] < 2 or not cost[row, col] < np.inf:
                continue
            heading = headings[row, col]
            if heading < 0 or not step_allowed(known, row, col, heading, rules):
                if not beside(chosen, row, col):
                    chosen[row, col] = True
            elif state[row, col] == 2 and walked[row, col] == 0:
                mark += 1
                mend_loop(
                    known, cost, factor, headings, fixed, walked, chosen, row, col, mark, rules)
    return chosen


def mend_loop(
    known: CellMap, cost: FloatMap, factor: FloatMap, headings: CellMap, fixed: BoolMap,
    walked: IntMap, chosen: BoolMap, row: int, col: int, mark: int, rules: StepRules,
) -> None:
    """
    Walk a flow into its loop; choose the loop's cell of least cost.

    A fixed one comes after the others, for what was shown is kept; a cell that goes the best way
    already comes last, for nothing would change: where a dead end was shown, that is its end.
    """
    while walked[row, col] == 0:
        walked[row, col] = mark
        heading = headings[row, col]
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    if walked[row, col] != mark:
        return
    first_row, first_col = row, col
    best_row, best_col, best = row, col, np.inf
    while True:
        at = cost[row, col] + (1e9 if fixed[row, col] else 0.0)
        if best_step(known, cost, factor, row, col, -1, rules) == headings[row, col]:
            at += 1e12
        if at < best:
            best_row, best_col, best = row, col, at
        heading = headings[row, col]
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
        if row == first_row and col == first_col:
            break
    chosen[best_row, best_col] = True


def beside(chosen: BoolMap, row: int, col: int) -> bool:
    """Tell whether a chosen cell lies next to this one."""
    for r in range(max(0, row - 1), min(chosen.shape[0], row + 2)):
        for c in range(max(0, col - 1), min(chosen.shape[1], col + 2)):
            if chosen[r, c]:
                return True
    return False
