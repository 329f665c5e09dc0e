"""One trial, decision by decision (Case 1); plain Python or compiled, as `kernels` says."""

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.rollout import flow_reaches
from control_field.kernels.steps import (
    _BLOCKED, allowed_steps, best_step, CellMap, FloatMap, IntMap, least_chosen, next_highest,
    rehearse_locally, remember_local_grid, StepRules, window_values)
from control_field.records import Kind

#: ``(rehearsed, window, power, oscillation_limit, n_backups)``
Options = tuple[bool, float, float, int, int]

_FIELD, _BLOCKED_KIND, _AVOID = int(Kind.FIELD), int(Kind.BLOCKED), int(Kind.AVOID)
_EXPLORE, _DETOUR = int(Kind.EXPLORE), int(Kind.DETOUR)


def backup(
    q: FloatMap, known: CellMap, row: int, col: int, action: int, reward: float, next_row: int,
    next_col: int, alpha: float, discount: float, rules: StepRules,
) -> None:
    """Apply eq. 6 once, in place; the maximum is over what the remembered map allows."""
    allowed = allowed_steps(known, next_row, next_col, rules)
    ahead = 0.0
    first = True
    for heading in range(8):
        if allowed >> heading & 1 and (first or q[next_row, next_col, heading] > ahead):
            ahead = q[next_row, next_col, heading]
            first = False
    q[row, col, action] += alpha * (reward + discount * ahead - q[row, col, action])


def choose(
    row: int, col: int, course: int, allowed: int, headings: CellMap, known: CellMap, q: FloatMap,
    cost: FloatMap, factor: FloatMap, counts: IntMap, entered: IntMap, goal: tuple[int, int],
    options: Options, rules: StepRules, rng: np.random.Generator,
) -> tuple[int, int]:
    """
    Choose the heading of a step, once the local grid is in the remembered map.

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


def decide(
    row: int, col: int, blocked: int, unknown: int, headings: CellMap, known: CellMap,
    q: FloatMap, cost: FloatMap, factor: FloatMap, counts: IntMap, entered: IntMap,
    punished: npt.NDArray[np.uint8], goal: tuple[int, int], learning: tuple[float, float],
    options: Options, rules: StepRules, rng: np.random.Generator,
) -> tuple[int, int, int, int]:
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
    occupied : int
        The course that was blocked and earned -1; -1 if none was.
    reward : int
        What the step itself earned: +1 for an avoidance, once for a cell and course in a trial, so
        that circling at a wall does not pay.

    """
    remember_local_grid(known, row, col, blocked, unknown)
    entered[row, col] += 1
    course = int(headings[row, col])
    allowed = allowed_steps(known, row, col, rules)
    occupied = -1
    if course >= 0 and not allowed >> course & 1:
        occupied = course
        backup(q, known, row, col, course, -1.0, row, col, learning[0], learning[1], rules)
    if allowed == 0:
        return -1, _AVOID, occupied, 0
    heading, kind = choose(row, col, course, allowed, headings, known, q, cost, factor, counts,
                           entered, goal, options, rules, rng)
    if heading < 0:
        return -1, kind, occupied, 0
    counts[row, col, heading] += 1
    reward = 0
    if occupied >= 0 and not punished[row, col] >> occupied & 1:
        punished[row, col] |= 1 << occupied
        reward = 1
    if reward != 0:
        backup(q, known, row, col, heading, float(reward), row + STEP_ROW[heading],
               col + STEP_COL[heading], learning[0], learning[1], rules)
    return heading, kind, occupied, reward


def see(truth: CellMap, row: int, col: int) -> int:
    """Return the mask of blocked neighbours in the true map; outside is blocked."""
    mask = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if (r < 0 or c < 0 or r >= truth.shape[0] or c >= truth.shape[1]
                or truth[r, c] == _BLOCKED):
            mask |= 1 << heading
    return mask


def run_trial(
    truth: CellMap, row: int, col: int, headings: CellMap, known: CellMap, q: FloatMap,
    cost: FloatMap, factor: FloatMap, goal: tuple[int, int], learning: tuple[float, float],
    options: Options, rules: StepRules, step_limit: int, rng: np.random.Generator, log: IntMap,
) -> tuple[int, int, int, float, int]:
    """
    Run a trial on the grid, without a robot; the arrays are changed in place.

    Parameters
    ----------
    log : ndarray of int32, shape (k, 9)
        Filled with ``row, col, action, next_row, next_col, reward, kind, blocked, step``; what
        does not fit is not logged.

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
        heading, kind, occupied, reward = decide(
            row, col, blocked, 0, headings, known, q, cost, factor, counts, entered, punished,
            goal, learning, options, rules, rng)
        if occupied >= 0:
            n_reinforcements += 1
            n_rows = write_row(log, n_rows, row, col, occupied, row, col, -1, _BLOCKED_KIND,
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


def write_row(
    log: IntMap, n: int, row: int, col: int, action: int, next_row: int, next_col: int,
    reward: int, kind: int, blocked: int, step: int,
) -> int:
    """Append a row to a log if it fits; return the number of rows."""
    if n >= log.shape[0]:
        return n
    log[n, 0], log[n, 1], log[n, 2] = row, col, action
    log[n, 3], log[n, 4], log[n, 5] = next_row, next_col, reward
    log[n, 6], log[n, 7], log[n, 8] = kind, blocked, step
    return n + 1
