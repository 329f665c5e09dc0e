"""Repair of sinks and pruning of idle prototypes; compiled, as `kernels` says."""

from typing import NamedTuple

import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.interpolation import (
    Attraction, Centres, divisors, heading_of, mean_vector, spread, Sums, View, Window)
from control_field.kernels.steps import (
    _BLOCKED, best_step, BoolMap, CellMap, FloatMap, Ground, IntMap, Preference, step_allowed,
    StepRules)


class Flow(NamedTuple):
    """
    A field while it is made: what its headings come from, and what they are.

    Parameters
    ----------
    sums : Sums
    attraction : Attraction
    centre : ndarray of int8, shape (n_rows, n_cols)
        Heading of the prototype centred in a cell, -1 for none.
    headings : ndarray of int8, shape (n_rows, n_cols)

    """

    sums: Sums
    attraction: Attraction
    centre: CellMap
    headings: CellMap


def through(ground: Ground, cost: FloatMap, row: int, col: int, heading: int) -> float:
    """Return the cost to go by way of a step, inf where it is occupied."""
    if heading < 0 or not step_allowed(ground.known, row, col, heading, ground.rules):
        return np.inf
    r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
    total: float = STEP_LENGTH[heading] * ground.factor[r, c] + cost[r, c]
    return total


def needed(
    row: int, col: int, flow: Flow, ground: Ground, cost: FloatMap, reach: int,
) -> bool:
    """Return True if a cell of a window has a worse heading than ``flow.headings`` says it had."""
    known = ground.known
    for r in range(max(0, row - reach), min(known.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(known.shape[1], col + reach + 1)):
            if flow.centre[r, c] >= 0 or known[r, c] == _BLOCKED:
                continue
            x, y = mean_vector(r, c, flow.sums, flow.attraction)
            heading, before = heading_of(x, y), flow.headings[r, c]
            if heading != before and (through(ground, cost, r, c, heading)
                                      > through(ground, cost, r, c, before) + 1e-9):
                return True
    return False


def idle_prototypes(
    order: IntMap, centres: Centres, flow: Flow, ground: Ground, cost: FloatMap, window: Window,
) -> BoolMap:
    """
    Drop the prototypes without which no cell's heading is worse, one after the other.

    Parameters
    ----------
    order : ndarray of int64
        Which prototypes to try, in this order.
    flow : Flow
        Changed in place.

    Returns
    -------
    ndarray of bool, shape (n,)
        Which prototypes are idle.

    """
    idle = np.zeros(centres.cells.shape[0], dtype=np.bool_)
    wanted = np.ones(ground.known.shape, dtype=np.bool_)
    view, reach = View(ground.known, divisors(window), wanted, window.visible), int(window.radius)
    for k in range(order.shape[0]):
        i = order[k]
        row, col, heading = centres.cells[i, 0], centres.cells[i, 1], centres.headings[i]
        flow.centre[row, col] = -1
        spread(flow.sums, view, row, col, heading, -centres.weights[i])
        if needed(row, col, flow, ground, cost, reach):
            flow.centre[row, col] = heading
            spread(flow.sums, view, row, col, heading, centres.weights[i])
        else:
            idle[i] = True
            update_headings(row, col, flow, reach)
    return idle


def update_headings(row: int, col: int, flow: Flow, reach: int) -> None:
    """Note the headings that the cells of a window have by now."""
    rows, cols = flow.headings.shape
    for r in range(max(0, row - reach), min(rows, row + reach + 1)):
        for c in range(max(0, col - reach), min(cols, col + reach + 1)):
            if flow.centre[r, c] < 0:
                x, y = mean_vector(r, c, flow.sums, flow.attraction)
                flow.headings[r, c] = heading_of(x, y)


def kept_steps(known: CellMap, headings: CellMap, rules: StepRules) -> CellMap:
    """Return the steps that the map does not bar, -1 for the others; none leave a wall."""
    kept = headings.copy()
    for row in range(known.shape[0]):
        for col in range(known.shape[1]):
            if headings[row, col] >= 0 and (known[row, col] == _BLOCKED or not step_allowed(
                    known, row, col, headings[row, col], rules)):
                kept[row, col] = -1
    return kept


def prefer_practised(
    ground: Ground, cost: FloatMap, action: CellMap, ratio: float, advantage: float,
    preference: Preference,
) -> None:
    """
    Prefer, in place, the steps that were taken, where no way is known that is clearly shorter.

    Parameters
    ----------
    action : ndarray of int8, shape (n_rows, n_cols)
        What was done, -1 for nothing.
    ratio : float
        To the cost of the best way on: what costs more than this is not preferred.
    advantage : float
        Share of its length that such a step is spared.
    preference : Preference

    """
    for row in range(action.shape[0]):
        for col in range(action.shape[1]):
            heading = action[row, col]
            if heading >= 0 and (
                    through(ground, cost, row, col, heading) <= ratio * cost[row, col]):
                preference.headings[row, col] = heading
                preference.spared[row, col] = advantage


def worth_keeping(
    ground: Ground, cost: FloatMap, action: CellMap, preference: Preference, slack: float,
) -> CellMap:
    """
    Return the steps that were taken and cost hardly more than the best way on; -1 for the others.

    Parameters
    ----------
    action : ndarray of int8, shape (n_rows, n_cols)
        What was done, -1 for nothing.
    slack : float, [cells]
        What such a step may cost more; a preferred one is spared what it is spared in ``cost``.

    """
    kept = np.full(action.shape, -1, dtype=np.int8)
    for row in range(action.shape[0]):
        for col in range(action.shape[1]):
            heading = action[row, col]
            if heading < 0 or not cost[row, col] < np.inf:
                continue
            total = through(ground, cost, row, col, heading)
            if total < np.inf and preference.headings[row, col] == heading:
                total -= preference.spared[row, col] * STEP_LENGTH[heading] * ground.factor[
                    row + STEP_ROW[heading], col + STEP_COL[heading]]
            if total <= cost[row, col] + slack:
                kept[row, col] = heading
    return kept


def mending_cells(
    ground: Ground, cost: FloatMap, headings: CellMap, state: CellMap, fixed: BoolMap,
) -> BoolMap:
    """
    Choose the cells whose own heading must change for the flow to come home.

    Parameters
    ----------
    state : ndarray of int8
        Of `rollout.flow_basin`.
    fixed : ndarray of bool
        Cells that keep their heading (demonstrated, not proven blocked) if another one can mend.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        One cell of every loop, and cells whose own heading is blocked, none of those beside one
        that was chosen before: each changes the heading of the cells around it too.

    """
    rows, cols = cost.shape
    chosen = np.zeros((rows, cols), dtype=np.bool_)
    walked = np.zeros((rows, cols), dtype=np.int64)
    mark = 0
    for row in range(rows):
        for col in range(cols):
            if state[row, col] < 2 or not cost[row, col] < np.inf:
                continue
            heading = headings[row, col]
            if heading < 0 or not step_allowed(ground.known, row, col, heading, ground.rules):
                if not beside(chosen, row, col):
                    chosen[row, col] = True
            elif state[row, col] == 2 and walked[row, col] == 0:
                mark += 1
                r, c = enter_loop(headings, walked, row, col, mark)
                if walked[r, c] == mark:
                    r, c = cheapest_of_loop(ground, cost, headings, fixed, r, c)
                    chosen[r, c] = True
    return chosen


def enter_loop(
    headings: CellMap, walked: IntMap, row: int, col: int, mark: int,
) -> tuple[int, int]:
    """Walk a flow, marking its cells, until it comes to one that is marked; return that one."""
    while walked[row, col] == 0:
        walked[row, col] = mark
        heading = headings[row, col]
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    return row, col


def cheapest_of_loop(
    ground: Ground, cost: FloatMap, headings: CellMap, fixed: BoolMap, row: int, col: int,
) -> tuple[int, int]:
    """
    Return the cell of least cost to go of the loop that leads through a cell.

    A fixed one comes after the others, for what was demonstrated is kept; a cell that goes the
    best way already comes last, for nothing would change: at a dead end that was demonstrated,
    that is its end.
    """
    first_row, first_col = row, col
    best_row, best_col, best = row, col, np.inf
    while True:
        at = cost[row, col] + (1e9 if fixed[row, col] else 0.0)
        if best_step(ground, cost, row, col, -1) == headings[row, col]:
            at += 1e12
        if at < best:
            best_row, best_col, best = row, col, at
        heading = headings[row, col]
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
        if row == first_row and col == first_col:
            return best_row, best_col


def beside(chosen: BoolMap, row: int, col: int) -> bool:
    """Return whether a chosen cell lies next to this one."""
    for r in range(max(0, row - 1), min(chosen.shape[0], row + 2)):
        for c in range(max(0, col - 1), min(chosen.shape[1], col + 2)):
            if chosen[r, c]:
                return True
    return False
