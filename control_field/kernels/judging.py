"""
What becomes of a trial from each of many cells; compiled, as `kernels` says.

Nothing is learnt between them, so a trial need not be run to its end where that is known: where
the flow comes home in truth, and where a trial goes the same way as another one from its next cell
on. What comes out is what `trials.run_trial` comes to from each start.
"""

import numpy as np

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.decision import (
    _EXPLORE, _FIELD, n_rewards, note_change, Options, TrialState)
from control_field.kernels.last_resort import CERTAIN, search_anew
from control_field.kernels.queues import Places
from control_field.kernels.rollout import comes_home
from control_field.kernels.sharing import (
    Beforehand, begins_with_flow, BY_LOT, Ends, next_place, note_crossed, OPEN, share, Work)
from control_field.kernels.steps import allowed_steps, CellMap
from control_field.kernels.trials import see_and_decide
from control_field.kernels.visibility import Scanner


def judge(
    truth: CellMap, starts: Places, trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, scanner: Scanner, before: Beforehand, ends: Ends, work: Work,
) -> None:
    """
    Write into ``ends`` what becomes of a trial from each start, and from others on their ways.

    Parameters
    ----------
    truth : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.
    starts : ndarray of int64, shape (n,)
        Places, row by row; free ones.
    trial : TrialState
        As a trial begins, and again when this returns; what it keeps, it must keep.
    rng : numpy.random.Generator
        For nothing: where it is asked for anything, the trial ends `BY_LOT`.

    """
    for start in starts:
        n, place = 0, start
        while ends.outcome[place] == OPEN:
            work.below[n] = place
            n += 1
            if not begins_with_flow(truth, place, trial, options, scanner, before):
                break
            place = next_place(trial.headings, place)
        for i in range(n - 1, -1, -1):
            if ends.outcome[work.below[i]] == OPEN:
                run_from(truth, work.below[i], trial, options, step_limit, rng, scanner, before,
                         ends, work)


def run_from(
    truth: CellMap, place: int, trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, scanner: Scanner, before: Beforehand, ends: Ends, work: Work,
) -> None:
    """Run the trial from a place; write down its end, and those of the trials that share it."""
    n_cols = truth.shape[1]
    row, col = place // n_cols, place % n_cols
    is_certain = before.is_truthful and before.reachable[row, col]
    outcome, n_decided, most_often = run_one(
        truth, place, False, trial, options, step_limit, rng, scanner, before, ends, work)
    # One more choice wherever another trial has come from must not be one too many.
    if outcome == 0 and is_certain and options.rehearsed and (
            trial.n_doubted[0] == 0 and most_often <= options.oscillation_limit - 2):
        share(truth, place, trial, options, step_limit, scanner, before, ends, work)
    put_back(trial, before, work.path, n_decided, scanner.shown.shape[0] // 2)


def run_alone(
    truth: CellMap, place: int, trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, scanner: Scanner, before: Beforehand, ends: Ends, work: Work,
) -> None:
    """Run the trial from a place with a generator of its own, and write down its end."""
    _, n_decided, _ = run_one(
        truth, place, True, trial, options, step_limit, rng, scanner, before, ends, work)
    put_back(trial, before, work.path, n_decided, scanner.shown.shape[0] // 2)


def run_one(
    truth: CellMap, place: int, by_lot: bool, trial: TrialState, options: Options,
    step_limit: int, rng: np.random.Generator, scanner: Scanner, before: Beforehand, ends: Ends,
    work: Work,
) -> tuple[int, int, int]:
    """Run the trial from a place; return outcome, decisions, and the most for one action."""
    work.n_trials[0] += 1
    search_anew(trial.flood)
    if before.is_truthful and before.reachable[place // truth.shape[1], place % truth.shape[1]]:
        trial.flood.ends[0] = CERTAIN
    outcome, n_steps, n_reinforcements, length, n_decided, most_often = end_of_trial(
        truth, place, by_lot, trial, options, step_limit, rng, scanner, before, work)
    ends.outcome[place], ends.n_steps[place] = outcome, n_steps
    ends.n_reinforcements[place], ends.length[place] = n_reinforcements, length
    return outcome, n_decided, most_often


def end_of_trial(
    truth: CellMap, place: int, by_lot: bool, trial: TrialState, options: Options,
    step_limit: int, rng: np.random.Generator, scanner: Scanner, before: Beforehand, work: Work,
) -> tuple[int, int, int, float, int, int]:
    """
    Run a trial until its end is known.

    Parameters
    ----------
    by_lot : bool
        Whether ``rng`` is its own, to choose by lot with.

    Returns
    -------
    outcome, n_steps, n_reinforcements : int
    length : float, [cells]
    n_decided : int
        Decisions made, in the places of ``work.path``.
    most_often : int
        How often an action was chosen in one cell.

    """
    n_cols, rules = truth.shape[1], trial.ground.rules
    row, col = place // n_cols, place % n_cols
    n_reinforcements, length, most_often, is_worn, last_kind = 0, 0.0, 0, False, -1
    for step in range(step_limit + 1):
        n_left = before.n_steps[row, col]
        if n_left >= 0 and not is_worn and step + n_left <= step_limit and (
                before.is_truthful or not options.rehearsed or comes_home(
                    trial.ground.known, trial.headings, trial.flow, row, col, trial.goal, rules)):
            return (0, step + n_left, n_reinforcements, length + before.lengths[row, col], step,
                    most_often)
        if row == trial.goal[0] and col == trial.goal[1]:
            return 0, step, n_reinforcements, length, step, most_often
        if step == step_limit:
            break
        work.path[step] = row * n_cols + col
        decision = see_and_decide(truth, row, col, trial, options, rng, scanner)
        heading = decision.heading
        n_reinforcements += n_rewards(decision)
        if heading < 0:
            return 2, step, n_reinforcements, length, step + 1, most_often
        if decision.kind == _EXPLORE and not by_lot:
            return BY_LOT, step, n_reinforcements, length, step + 1, most_often
        if not allowed_steps(truth, row, col, rules) >> heading & 1:
            return 1, step, n_reinforcements, length, step + 1, most_often
        if decision.kind == _FIELD and last_kind != _FIELD:
            note_crossed(trial, row, col, work)
        last_kind = decision.kind
        count = trial.counts[row, col, heading]
        most_often = max(most_often, count)
        is_worn = is_worn or (
            heading == trial.headings[row, col] and count >= options.oscillation_limit)
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
        length += STEP_LENGTH[heading]
    return 2, step_limit, n_reinforcements, length, step_limit, most_often


def put_back(
    trial: TrialState, before: Beforehand, path: Places, n_decided: int, reach: int,
) -> None:
    """Make a trial what it was before its first decision, where it has changed anything."""
    rows, n_cols = before.known.shape
    cost, cost_before = trial.cost.reshape(-1), before.cost.reshape(-1)
    for place in path[:n_decided]:
        row, col = place // n_cols, place % n_cols
        trial.entered[row, col], trial.punished[row, col] = 0, 0
        for heading in range(8):
            trial.counts[row, col, heading] = 0
            trial.q[row, col, heading] = before.q[row, col, heading]
        for r in range(max(0, row - reach), min(rows, row + reach + 1)):
            for c in range(max(0, col - reach), min(n_cols, col + reach + 1)):
                if trial.seen[r, c]:
                    put_cell_back(trial, before, r, c)
    search = trial.search
    for place in search.mended[:search.n_mended[0]]:
        cost[place] = cost_before[place]
        search.is_mended[place] = False
    search.n_mended[0] = 0
    if trial.n_doubted[0] > 0:
        for r in range(rows):
            for c in range(n_cols):
                put_cell_back(trial, before, r, c)
                trial.cost[r, c] = before.cost[r, c]
        trial.n_doubted[0] = 0


def put_cell_back(trial: TrialState, before: Beforehand, row: int, col: int) -> None:
    """Make a cell of the map what it was."""
    now, then = trial.ground.known[row, col], before.known[row, col]
    trial.seen[row, col] = False
    trial.ground.factor[row, col] = before.factor[row, col]
    trial.ground.known[row, col] = then
    if now != then and now > 0:
        note_change(trial, row, col, False)
    if now != then and then > 0:
        note_change(trial, row, col, True)
