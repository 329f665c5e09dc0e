"""One trial, decision by decision (Case 1); plain Python or compiled, as `kernels` says."""

import numpy as np

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels import (
    _AVOID, _BLOCKED, _BLOCKED_KIND, _DETOUR, _EXPLORE, _FIELD, allowed_steps, best_step,
    flow_reaches, least_chosen, next_highest, rehearse_locally, remember_sight, window_values)


def backup(q, known, row, col, action, reward, next_row, next_col, alpha, discount, rules):
    """Apply eq. 6 once, in place; the maximum is over what the remembered map allows."""
    allowed = allowed_steps(known, next_row, next_col, rules)
    ahead = 0.0
    first = True
    for heading in range(8):
        if allowed >> heading & 1 and (first or q[next_row, next_col, heading] > ahead):
            ahead = q[next_row, next_col, heading]
            first = False
    q[row, col, action] += alpha * (reward + discount * ahead - q[row, col, action])


def choose(row, col, course, allowed, headings, known, q, cost, factor, counts, entered, goal,
           options, rules, rng):
    """
    Choose the heading of a step, once the sight is in the remembered map.

    ``options`` is ``(rehearsed, window, power, oscillation_limit, n_backups)``. Returns
    ``(heading, kind)``; heading -1: no way is left.
    """
    rehearsed, window, power, limit, n_backups = options
    free = course >= 0 and allowed >> course & 1 == 1
    if free and counts[row, col, course] < limit and (
            not rehearsed
            or flow_reaches(known, headings, row, col, goal[0], goal[1], rules) >= 0):
        return course, _FIELD
    if rehearsed:
        rehearse_locally(known, cost, factor, row, col, goal[0], goal[1], n_backups, rules)
        heading = best_step(known, cost, factor, row, col, course, rules)
        if heading >= 0 and counts[row, col, heading] < 4 * limit:
            return heading, _DETOUR if free else _AVOID
        if heading < 0:
            return -1, _AVOID
    elif not free:
        values = window_values(q, row, col, window, power)
        heading = next_highest(values, counts, entered, row, col, course, allowed)
        if counts[row, col, heading] < limit:
            return heading, _AVOID
    return least_chosen(counts, row, col, allowed, rng), _EXPLORE


def decide(row, col, blocked, unknown, headings, known, q, cost, factor, counts, entered,
           punished, goal, learning, options, rules, rng):
    """
    Make one decision and give its rewards (Case 1 and eq. 4 to 6 online).

    All arrays are the trial's own copies and are changed in place. ``learning`` is
    ``(alpha, discount)``.

    Returns
    -------
    heading : int
        Step to take; -1: give up.
    kind : int
        `Kind` of that step.
    barred : int
        The course that was blocked and earned -1; -1 if none was.
    reward : int
        What the step itself earned: +1 for an avoidance, once for a cell and course in a trial, so
        that circling at a wall does not pay.

    """
    remember_sight(known, row, col, blocked, unknown)
    entered[row, col] += 1
    course = int(headings[row, col])
    allowed = allowed_steps(known, row, col, rules)
    barred = -1
    if course >= 0 and not allowed >> course & 1:
        barred = course
        backup(q, known, row, col, course, -1.0, row, col, learning[0], learning[1], rules)
    if allowed == 0:
        return -1, _AVOID, barred, 0
    heading, kind = choose(row, col, course, allowed, headings, known, q, cost, factor, counts,
                           entered, goal, options, rules, rng)
    if heading < 0:
        return -1, kind, barred, 0
    counts[row, col, heading] += 1
    reward = 0
    if barred >= 0 and not punished[row, col] >> barred & 1:
        punished[row, col] |= 1 << barred
        reward = 1
    if reward != 0:
        backup(q, known, row, col, heading, float(reward), row + STEP_ROW[heading],
               col + STEP_COL[heading], learning[0], learning[1], rules)
    return heading, kind, barred, reward


def see(truth, row, col):
    """Return the mask of blocked neighbours in the true map; outside is blocked."""
    mask = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if (r < 0 or c < 0 or r >= truth.shape[0] or c >= truth.shape[1]
                or truth[r, c] == _BLOCKED):
            mask |= 1 << heading
    return mask


def run_trial(truth, row, col, headings, known, q, cost, factor, goal, learning, options, rules,
              step_limit, rng, log):
    """
    Run a trial on the grid, without a robot; the arrays are changed in place.

    Parameters
    ----------
    log : ndarray of int32, shape (k, 9)
        Filled with ``row, col, action, next_row, next_col, reward, kind, blocked, step``; what does
        not fit is not logged.

    Returns
    -------
    outcome : int
        0 goal, 1 collision, 2 gave up.
    n_steps, n_rows : int
    length : float
        In cells.
    n_reinforcements : int

    """
    rows, cols = truth.shape
    counts = np.zeros((rows, cols, 8), dtype=np.int32)
    entered = np.zeros((rows, cols), dtype=np.int32)
    punished = np.zeros((rows, cols), dtype=np.uint8)
    n_rows, n_reinforcements, length = 0, 0, 0.0
    for step in range(step_limit + 1):
        if row == goal[0] and col == goal[1]:
            return 0, step, n_rows, length, n_reinforcements
        if step == step_limit:
            break
        blocked = see(truth, row, col)
        heading, kind, barred, reward = decide(
            row, col, blocked, 0, headings, known, q, cost, factor, counts, entered, punished,
            goal, learning, options, rules, rng)
        if barred >= 0:
            n_reinforcements += 1
            n_rows = write_row(log, n_rows, row, col, barred, row, col, -1, _BLOCKED_KIND,
                               blocked, step)
        if heading < 0:
            return 2, step, n_rows, length, n_reinforcements
        if reward != 0:
            n_reinforcements += 1
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        n_rows = write_row(log, n_rows, row, col, heading, r, c, reward, kind, blocked, step)
        if not allowed_steps(truth, row, col, rules) >> heading & 1:
            return 1, step, n_rows, length, n_reinforcements
        length += np.hypot(float(r - row), float(c - col))
        row, col = r, c
    return 2, step_limit, n_rows, length, n_reinforcements


def write_row(log, n, row, col, action, next_row, next_col, reward, kind, blocked, step):
    """Append a row to a log if it fits; return the number of rows."""
    if n >= log.shape[0]:
        return n
    log[n, 0], log[n, 1], log[n, 2] = row, col, action
    log[n, 3], log[n, 4], log[n, 5] = next_row, next_col, reward
    log[n, 6], log[n, 7], log[n, 8] = kind, blocked, step
    return n + 1
