"""Trials on a grid, without a robot; compiled, as `kernels` says."""

import numpy as np

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.decision import (
    decide, Decision, Log, n_rewards, Options, take_in_cells, TrialState, write_decision,
    write_shown)
from control_field.kernels.steps import _BLOCKED, allowed_steps, CellMap
from control_field.kernels.visibility import look, Scanner


def see(truth: CellMap, row: int, col: int) -> int:
    """Return the mask of blocked neighbours in the true map; outside is blocked."""
    mask = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if (r < 0 or c < 0 or r >= truth.shape[0] or c >= truth.shape[1]
                or truth[r, c] == _BLOCKED):
            mask |= 1 << heading
    return mask


def see_and_decide(
    truth: CellMap, row: int, col: int, trial: TrialState, options: Options,
    rng: np.random.Generator, scanner: Scanner,
) -> Decision:
    """Take in all that is to be seen from a cell, and make a decision there."""
    if scanner.rays.shape[0]:
        look(truth, row, col, scanner.rays, scanner.shown)
        take_in_cells(trial, row, col, scanner.shown)
    return decide(row, col, see(truth, row, col), 0, trial, options, rng)


def run_trial(
    truth: CellMap, start: tuple[int, int], trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, log: Log, scanner: Scanner,
) -> tuple[int, int, int, float, int]:
    """
    Run a trial on the grid, without a robot.

    Parameters
    ----------
    truth : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.
    log : Log
        Takes what was decided, and seen.
    scanner : Scanner
        How far the robot sees.

    Returns
    -------
    outcome : int
        0 goal, 1 collision, 2 gave up.
    n_steps, n_rows : int
    length : float, [cells]
    n_reinforcements : int

    """
    row, col = start
    n_rows, n_reinforcements, length = 0, 0, 0.0
    for step in range(step_limit + 1):
        if row == trial.goal[0] and col == trial.goal[1]:
            return 0, step, n_rows, length, n_reinforcements
        if step == step_limit:
            break
        decision = see_and_decide(truth, row, col, trial, options, rng, scanner)
        if scanner.rays.shape[0]:
            write_shown(log, n_rows, scanner)
        n_rows = write_decision(
            log.rows, n_rows, row, col, decision, see(truth, row, col), step)
        n_reinforcements += n_rewards(decision)
        heading = decision.heading
        if heading < 0:
            return 2, step, n_rows, length, n_reinforcements
        if not allowed_steps(truth, row, col, trial.ground.rules) >> heading & 1:
            return 1, step, n_rows, length, n_reinforcements
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        length += np.hypot(float(r - row), float(c - col))
        row, col = r, c
    return 2, step_limit, n_rows, length, n_reinforcements
