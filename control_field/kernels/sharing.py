"""
Which trials go the same way as another one, so that its end is theirs.

Compiled, as `kernels` says. A trial that begins with the flow is, from the next cell on, the trial
from there, but for what it has seen on its way: that has to be looked at.
"""

from typing import Final, NamedTuple

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.decision import Options, TrialState
from control_field.kernels.queues import Places
from control_field.kernels.steps import (
    _BLOCKED, _UNKNOWN, BoolMap, CellMap, FloatMap, IntMap, step_allowed)
from control_field.kernels.visibility import look, Scanner

#: Outcome of a trial that came to choose by lot: it has to be run with a generator of its own.
BY_LOT: Final = 3
#: No outcome yet.
OPEN: Final = -1


class Beforehand(NamedTuple):
    """
    What is known before any trial on a field is run.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map. This and the next three are what a trial begins with.
    factor, cost : ndarray of float64, shape (n_rows, n_cols)
    q : ndarray of float64, shape (n_rows, n_cols, 8)
    lengths : ndarray of float64, shape (n_rows, n_cols), [cells]
        Of the flow home in the true map; inf where it does not come home.
    n_steps : ndarray of int32, shape (n_rows, n_cols)
        Its steps; -1 where it does not.
    leads_home : ndarray of bool, shape (n_rows, n_cols)
        Whether the flow reaches the goal on the remembered map.
    reachable : ndarray of bool, shape (n_rows, n_cols)
        Whether a way leads to the goal in truth.
    is_truthful : bool
        Whether nothing that is free is remembered as occupied, or doubted.

    """

    known: CellMap
    factor: FloatMap
    cost: FloatMap
    q: FloatMap
    lengths: FloatMap
    n_steps: IntMap
    leads_home: BoolMap
    reachable: BoolMap
    is_truthful: bool


class Ends(NamedTuple):
    """
    What became of the trials, by the place they start from.

    Parameters
    ----------
    outcome : ndarray of int8, shape (n_places,)
        As `trials.run_trial` returns it; `OPEN` and `BY_LOT` besides.
    n_steps, n_reinforcements : ndarray of int64, shape (n_places,)
    length : ndarray of float64, shape (n_places,), [cells]

    """

    outcome: CellMap
    n_steps: Places
    n_reinforcements: Places
    length: FloatMap


class Work(NamedTuple):
    """
    What judging works in.

    Parameters
    ----------
    path : ndarray of int64, shape (step_limit,)
        Places in which the present trial has made a decision.
    below, above : ndarray of int64, shape (n_places,)
        Places on the way down to where a trial has to be run, and up from there.
    crossed : ndarray of int64, shape (n_places,)
        Number of the last trial that relied on a cell not to be occupied, as its flow crosses it.
    shown : ndarray of int8, shape (n, n)
        What is in sight at the start of the present trial.
    n_trials : ndarray of int64, shape (1,)
        How many were run.

    """

    path: Places
    below: Places
    above: Places
    crossed: Places
    shown: CellMap
    n_trials: Places


def next_place(headings: CellMap, place: int) -> int:
    """Return the place that the field leads to from a place where it has a heading."""
    n_cols = headings.shape[1]
    heading = headings[place // n_cols, place % n_cols]
    return int(place + STEP_ROW[heading] * n_cols + STEP_COL[heading])


def begins_with_flow(
    truth: CellMap, place: int, trial: TrialState, options: Options, scanner: Scanner,
    before: Beforehand,
) -> bool:
    """
    Return whether the first decision of a trial is the field's, and sharing its end is thought of.

    What is seen then stays in ``scanner``.
    """
    n_cols = truth.shape[1]
    row, col = place // n_cols, place % n_cols
    if not (options.rehearsed and before.is_truthful and before.leads_home[row, col]
            and before.reachable[row, col] and before.n_steps[row, col] < 0):
        return False
    look(truth, row, col, scanner.rays, scanner.shown)
    if not step_allowed(truth, row, col, trial.headings[row, col], trial.ground.rules):
        return False
    r, c = row, col
    while not (r == trial.goal[0] and c == trial.goal[1]):
        heading = trial.headings[r, c]
        if not is_step_open(scanner.shown, r - row, c - col, heading,
                            trial.ground.rules.corner_cutting):
            return False
        r, c = r + STEP_ROW[heading], c + STEP_COL[heading]
    return True


def shows_blocked(shown: CellMap, row: int, col: int) -> bool:
    """Return whether a local grid shows something occupied in a cell, counted from the robot's."""
    middle = shown.shape[0] // 2
    if not (-middle <= row <= middle and -middle <= col <= middle):
        return False
    return bool(shown[middle + row, middle + col] == _BLOCKED)


def is_step_open(shown: CellMap, row: int, col: int, heading: int, corner_cutting: bool) -> bool:
    """Return whether a local grid shows nothing in the way of a step."""
    r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
    if shows_blocked(shown, r, c):
        return False
    return corner_cutting or not (shows_blocked(shown, r, col) or shows_blocked(shown, row, c))


def note_crossed(trial: TrialState, row: int, col: int, work: Work) -> None:
    """Note the cells that the flow from a cell relies on not to be occupied, unless it is lost."""
    n_cols, goal = trial.headings.shape[1], trial.goal
    for _ in range(work.crossed.shape[0]):
        heading = trial.headings[row, col]
        if (row == goal[0] and col == goal[1]) or heading < 0 or not step_allowed(
                trial.ground.known, row, col, heading, trial.ground.rules):
            return
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        work.crossed[r * n_cols + c] = work.n_trials[0]
        work.crossed[r * n_cols + col] = work.n_trials[0]
        work.crossed[row * n_cols + c] = work.n_trials[0]
        row, col = r, c


def share(
    truth: CellMap, place: int, trial: TrialState, options: Options, step_limit: int,
    scanner: Scanner, before: Beforehand, ends: Ends, work: Work,
) -> None:
    """
    Write down the ends of the trials that come to a place by the flow and then go on as its own.

    They do if what they have seen on their way makes no difference to any decision of that one,
    which has just been run.
    """
    n_cols, n = truth.shape[1], 1
    look(truth, place // n_cols, place % n_cols, scanner.rays, work.shown)
    work.above[0] = place
    while n > 0:
        n -= 1
        there = work.above[n]
        for heading in range(8):
            row = there // n_cols - STEP_ROW[heading]
            col = there % n_cols - STEP_COL[heading]
            if not (0 <= row < truth.shape[0] and 0 <= col < n_cols) or truth[row, col] != 0:
                continue
            here = row * n_cols + col
            if (ends.outcome[here] != OPEN or trial.headings[row, col] != heading
                    or ends.n_steps[there] >= step_limit
                    or not begins_with_flow(truth, here, trial, options, scanner, before)
                    or matters(here, place, trial, scanner, before, work)):
                continue
            ends.outcome[here], ends.n_steps[here] = 0, ends.n_steps[there] + 1
            ends.n_reinforcements[here] = ends.n_reinforcements[there]
            ends.length[here] = ends.length[there] + STEP_LENGTH[heading]
            work.above[n] = here
            n += 1


def matters(
    here: int, place: int, trial: TrialState, scanner: Scanner, before: Beforehand, work: Work,
) -> bool:
    """
    Return whether what is seen from one place may matter to the trial that was run from another.

    Not if it was known, is in sight there too, or is where that trial has not looked for a way
    and no flow that it relied on leads.
    """
    rows, n_cols = before.known.shape
    middle = scanner.shown.shape[0] // 2
    for i in range(scanner.shown.shape[0]):
        for j in range(scanner.shown.shape[0]):
            row, col = here // n_cols + i - middle, here % n_cols + j - middle
            if scanner.shown[i, j] == _UNKNOWN or not (0 <= row < rows and 0 <= col < n_cols):
                continue
            is_blocked = scanner.shown[i, j] == _BLOCKED
            known = before.known[row, col]
            if not (is_blocked and known != _BLOCKED) and not (
                    before.factor[row, col] < 1.0 or 0 < known < _BLOCKED):
                continue
            r, c = row - place // n_cols + middle, col - place % n_cols + middle
            if 0 <= r < scanner.shown.shape[0] and 0 <= c < scanner.shown.shape[0] and (
                    work.shown[r, c] != _UNKNOWN):
                continue
            if was_looked_at(trial, row, col) or (
                    is_blocked and work.crossed[row * n_cols + col] == work.n_trials[0]):
                return True
    return False


def was_looked_at(trial: TrialState, row: int, col: int) -> bool:
    """Return whether rehearsal has looked at a cell, or at one beside it, in this trial."""
    rows, n_cols = trial.headings.shape
    for r in range(max(0, row - 1), min(rows, row + 2)):
        for c in range(max(0, col - 1), min(n_cols, col + 2)):
            if trial.search.is_mended[r * n_cols + c]:
                return True
    return False
