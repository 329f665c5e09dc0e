"""Equation 7 with windows and pull; plain Python or compiled, as `kernels` says."""

import math

import numpy as np

from control_field.headings import UNIT
from control_field.kernels.steps import (
    _BLOCKED, best_step, CellMap, FloatMap, IntMap, is_occupied, step_allowed, StepRules)


def sees(known: CellMap, row: int, col: int, r: int, c: int) -> bool:
    """Tell whether the straight line between two cell centres crosses no known wall."""
    d_row, d_col = r - row, c - col
    n = 2 * max(abs(d_row), abs(d_col))
    for i in range(1, n):
        at_row = int(math.floor(row + d_row * i / n + 0.5))
        at_col = int(math.floor(col + d_col * i / n + 0.5))
        if known[at_row, at_col] == _BLOCKED:
            return False
    return True


def spread(
    total_x: FloatMap, total_y: FloatMap, total_w: FloatMap, known: CellMap, row: int, col: int,
    heading: int, weight: float, window: float, power: float, visible: bool,
) -> None:
    """Add one prototype's share of eq. 7 to its effective window (take it away: weight < 0)."""
    reach = int(window)
    for r in range(max(0, row - reach), min(known.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(known.shape[1], col + reach + 1)):
            if r == row and c == col:
                continue
            d = math.hypot(r - row, c - col)
            if d > window or (visible and not sees(known, row, col, r, c)):
                continue
            w = weight / d ** power
            total_x[r, c] += w * UNIT[heading, 0]
            total_y[r, c] += w * UNIT[heading, 1]
            total_w[r, c] += w


def add_windows(
    total_x: FloatMap, total_y: FloatMap, total_w: FloatMap, known: CellMap, cells: IntMap,
    headings: CellMap, weights: FloatMap, window: float, power: float, visible: bool,
) -> None:
    """Add the shares of several prototypes."""
    for i in range(cells.shape[0]):
        spread(total_x, total_y, total_w, known, cells[i, 0], cells[i, 1], headings[i],
               weights[i], window, power, visible)


def heading_of(vx: float, vy: float) -> int:
    """Return the heading nearest to a direction, -1 for none; `headings.heading_from_vector`."""
    if vx * vx + vy * vy < 1e-18:
        return -1
    return int(math.floor(math.atan2(vy, vx) / (math.pi / 4) + 0.5)) % 8


def course_at(
    row: int, col: int, total_x: FloatMap, total_y: FloatMap, total_w: FloatMap, pull: CellMap,
    strength: float,
) -> tuple[float, float]:
    """
    Return the averaged vector at a cell that is no centre: eq. 7 with the pull as one more voice.

    ``pull`` holds a heading a cell (-1: none); it speaks with weight ``strength``, like a
    prototype one cell away.
    """
    x, y, w = total_x[row, col], total_y[row, col], total_w[row, col]
    heading = pull[row, col]
    if heading >= 0:
        x += strength * UNIT[heading, 0]
        y += strength * UNIT[heading, 1]
        w += strength
    if w <= 0.0:
        return 0.0, 0.0
    return x / w, y / w


def courses(
    total_x: FloatMap, total_y: FloatMap, total_w: FloatMap, centre: CellMap, pull: CellMap,
    strength: float,
) -> tuple[FloatMap, FloatMap, CellMap]:
    """
    Return the field's vectors and their headings everywhere.

    Parameters
    ----------
    centre : ndarray of int8, shape (n_rows, n_cols)
        Heading of the prototype centred in a cell, -1 for none.

    Returns
    -------
    vx, vy : ndarray, shape (n_rows, n_cols)
        Averaged vectors, not normalised.
    headings : ndarray of int8, shape (n_rows, n_cols)

    """
    rows, cols = centre.shape
    vx, vy = np.zeros((rows, cols)), np.zeros((rows, cols))
    headings = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            heading = centre[row, col]
            if heading >= 0:
                vx[row, col], vy[row, col] = UNIT[heading, 0], UNIT[heading, 1]
                headings[row, col] = heading
                continue
            x, y = course_at(row, col, total_x, total_y, total_w, pull, strength)
            vx[row, col], vy[row, col] = x, y
            headings[row, col] = heading_of(x, y)
    return vx, vy, headings


def pull_from_cost(
    known: CellMap, cost: FloatMap, factor: FloatMap, total_x: FloatMap, total_y: FloatMap,
    rules: StepRules,
) -> CellMap:
    """Return the heading of least cost a cell, ties nearest to eq. 7's course; -1 for none."""
    rows, cols = known.shape
    pull = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            if not is_occupied(known, row, col, rules[1]) and cost[row, col] > 0.0:
                course = heading_of(total_x[row, col], total_y[row, col])
                pull[row, col] = best_step(known, cost, factor, row, col, course, rules)
    return pull


def pull_to_nearest(known: CellMap, cells: IntMap, rules: StepRules) -> CellMap:
    """Return the allowed heading straightest towards the nearest prototype; -1 for none."""
    rows, cols = known.shape
    pull = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            best, to_row, to_col = np.inf, 0, 0
            for i in range(cells.shape[0]):
                d = math.hypot(cells[i, 0] - row, cells[i, 1] - col)
                if d < best:
                    best, to_row, to_col = d, cells[i, 0] - row, cells[i, 1] - col
            if 0.0 < best < np.inf:
                heading = heading_of(float(to_col), float(to_row))
                if step_allowed(known, row, col, heading, rules):
                    pull[row, col] = heading
    return pull
