"""Equation 7 with windows and pull, repair and pruning: the learner's loops."""

import math

import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW, UNIT
from control_field.kernels import _BLOCKED, best_step, is_barred, step_allowed


def sees(known, row, col, r, c):
    """Tell whether the straight line between two cell centres crosses no known wall."""
    d_row, d_col = r - row, c - col
    n = 2 * max(abs(d_row), abs(d_col))
    for i in range(1, n):
        at_row = int(math.floor(row + d_row * i / n + 0.5))
        at_col = int(math.floor(col + d_col * i / n + 0.5))
        if known[at_row, at_col] == _BLOCKED:
            return False
    return True


def spread(total_x, total_y, total_w, known, row, col, heading, weight, window, power, visible):
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


def add_windows(total_x, total_y, total_w, known, cells, headings, weights, window, power,
                visible):
    """Add the shares of several prototypes."""
    for i in range(cells.shape[0]):
        spread(total_x, total_y, total_w, known, cells[i, 0], cells[i, 1], headings[i],
               weights[i], window, power, visible)


def heading_of(vx, vy):
    """Return the heading nearest to a direction, -1 for none; `headings.heading_from_vector`."""
    if vx * vx + vy * vy < 1e-18:
        return -1
    return int(math.floor(math.atan2(vy, vx) / (math.pi / 4) + 0.5)) % 8


def course_at(row, col, total_x, total_y, total_w, pull, strength):
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


def courses(total_x, total_y, total_w, centre, pull, strength):
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


def pull_from_cost(known, cost, factor, total_x, total_y, rules):
    """Return the heading of least cost a cell, ties nearest to eq. 7's course; -1 for none."""
    rows, cols = known.shape
    pull = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            if not is_barred(known, row, col, rules[1]) and cost[row, col] > 0.0:
                course = heading_of(total_x[row, col], total_y[row, col])
                pull[row, col] = best_step(known, cost, factor, row, col, course, rules)
    return pull


def through(known, cost, factor, row, col, heading, rules):
    """Return the cost to go by way of a step, inf where it is barred."""
    if heading < 0 or not step_allowed(known, row, col, heading, rules):
        return np.inf
    r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
    return STEP_LENGTH[heading] * factor[r, c] + cost[r, c]


def needed(row, col, centre, totals, known, cost, factor, pull, strength, headings, window, rules):
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


def idle_prototypes(order, cells, proto_headings, weights, totals, centre, known, cost, factor,
                    pull, strength, headings, window, power, visible, rules):
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


def mending_cells(known, cost, headings, state, fixed, rules):
    """
    Choose the cells whose own course must change for the flow to come home.

    Parameters
    ----------
    state : ndarray of int8
        Of `kernels.flow_basin`.
    fixed : ndarray of bool
        Cells that keep their course (demonstrated, not proven blocked) if another one can mend.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        No two of them are neighbours: each changes the course of the cells around it too.

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
                mend_loop(headings, cost, fixed, walked, chosen, row, col, mark)
    return chosen


def mend_loop(headings, cost, fixed, walked, chosen, row, col, mark):
    """Walk a flow into its loop; choose the loop's cell of least cost, a fixed one last."""
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
        if at < best:
            best_row, best_col, best = row, col, at
        heading = headings[row, col]
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
        if row == first_row and col == first_col:
            break
    chosen[best_row, best_col] = True


def beside(chosen, row, col):
    """Tell whether a chosen cell lies next to this one."""
    for r in range(max(0, row - 1), min(chosen.shape[0], row + 2)):
        for c in range(max(0, col - 1), min(chosen.shape[1], col + 2)):
            if chosen[r, c]:
                return True
    return False


def flow_ends(known, headings, state, rules):
    """
    Mark where flows that do not come home end.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        Cells whose course is barred or missing, and one cell a loop.

    """
    rows, cols = known.shape
    ends = np.zeros((rows, cols), dtype=np.bool_)
    walked = np.zeros((rows, cols), dtype=np.int64)
    mark = 0
    for first_row in range(rows):
        for first_col in range(cols):
            row, col = first_row, first_col
            if state[row, col] < 2 or walked[row, col] > 0:
                continue
            mark += 1
            while walked[row, col] == 0:
                walked[row, col] = mark
                heading = headings[row, col]
                if heading < 0 or not step_allowed(known, row, col, heading, rules):
                    ends[row, col] = True
                    break
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
                if walked[row, col] == mark:
                    ends[row, col] = True
    return ends


def pull_to_nearest(known, cells, rules):
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


def n_crossing(headings, state, goal_row, goal_col):
    """
    Count from how many cells the flow home leads through each cell, itself included.

    Parameters
    ----------
    state : ndarray of int8
        Of `kernels.flow_basin`.

    """
    rows, cols = headings.shape
    count = np.zeros((rows, cols))
    n_before = np.zeros((rows, cols), dtype=np.int64)
    for row in range(rows):
        for col in range(cols):
            if state[row, col] == 1 and not (row == goal_row and col == goal_col):
                heading = headings[row, col]
                n_before[row + STEP_ROW[heading], col + STEP_COL[heading]] += 1
    for first_row in range(rows):
        for first_col in range(cols):
            row, col = first_row, first_col
            while state[row, col] == 1 and n_before[row, col] == 0:
                n_before[row, col] = -1
                count[row, col] += 1.0
                if row == goal_row and col == goal_col:
                    break
                heading = headings[row, col]
                r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
                count[r, c] += count[row, col]
                n_before[r, c] -= 1
                row, col = r, c
    return count


def unseen_along(headings, state, known, value, goal_row, goal_col):
    """Return the summed value of the unseen cells that come into sight along each flow home."""
    rows, cols = headings.shape
    total = np.zeros((rows, cols))
    mark = np.zeros((rows, cols), dtype=np.int64)
    for first_row in range(rows):
        for first_col in range(cols):
            if state[first_row, first_col] != 1:
                continue
            row, col = first_row, first_col
            while True:
                for r in range(max(0, row - 1), min(rows, row + 2)):
                    for c in range(max(0, col - 1), min(cols, col + 2)):
                        if known[r, c] == -1 and mark[r, c] != first_row * cols + first_col + 1:
                            mark[r, c] = first_row * cols + first_col + 1
                            total[first_row, first_col] += value[r, c]
                if row == goal_row and col == goal_col:
                    break
                heading = headings[row, col]
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    return total


def flow_lengths(known, headings, goal_row, goal_col, rules):
    """Return the length of every cell's flow to the goal, inf where it does not get there."""
    rows, cols = known.shape
    length = np.full((rows, cols), np.nan)
    length[goal_row, goal_col] = 0.0
    path = np.empty((rows * cols, 2), dtype=np.int64)
    on_path = np.zeros((rows, cols), dtype=np.bool_)
    for first_row in range(rows):
        for first_col in range(cols):
            n, row, col, end = 0, first_row, first_col, np.inf
            while True:
                if on_path[row, col] or is_barred(known, row, col, rules[1]):
                    break
                if not np.isnan(length[row, col]):
                    end = length[row, col]
                    break
                heading = headings[row, col]
                on_path[row, col] = True
                path[n, 0], path[n, 1] = row, col
                n += 1
                if heading < 0 or not step_allowed(known, row, col, heading, rules):
                    break
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
            for i in range(n - 1, -1, -1):
                row, col = path[i, 0], path[i, 1]
                end += STEP_LENGTH[max(headings[row, col], 0)]
                length[row, col] = end
                on_path[row, col] = False
            if np.isnan(length[first_row, first_col]):
                length[first_row, first_col] = np.inf
    return length
