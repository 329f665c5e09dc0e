"""One trial, decision by decision (Case 1); plain Python or compiled, as `kernels` says."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.last_resort import (
    doubt_unseen, Flood, is_shut_off, new_flood, search_anew)
from control_field.kernels.local_search import forget_masks, new_search, rehearse_locally, Search
from control_field.kernels.rollout import comes_home, KnownFlow, new_flow, note_closed, note_opened
from control_field.kernels.steps import (
    _BLOCKED, _UNKNOWN, allowed_steps, best_step, BoolMap, CellMap, FloatMap, Ground, IntMap,
    least_chosen, next_highest, StepRules, window_values)
from control_field.kernels.visibility import Scanner
from control_field.records import Kind

#: Columns of a log of decisions.
LOGGED = ('row', 'col', 'action', 'next_row', 'next_col', 'reward', 'kind', 'blocked', 'step')

_FIELD, _BLOCKED_KIND, _AVOID = int(Kind.FIELD), int(Kind.BLOCKED), int(Kind.AVOID)
_EXPLORE, _DETOUR = int(Kind.EXPLORE), int(Kind.DETOUR)
#: Cells that the search for any way at all looks at for every backup of rehearsal.
_LOOKED_AT = 4


class Options(NamedTuple):
    """
    How a trial decides.

    Parameters
    ----------
    rehearsed : bool
        Whether a blocked heading is left by the cost to go, else by the Q-matrix (the paper).
    window : float, [cells]
        Radius of the effective window.
    power : float
        p of eq. 7.
    oscillation_limit : int
        How often an action may be taken in a cell before exploration begins.
    n_backups : int
        Backups that one decision may spend on rehearsing around the robot.
    learning_rate, discount : float
        Of eq. 6.
    doubts : bool
        Whether remembered walls are doubted where no way is left.

    """

    rehearsed: bool
    window: float
    power: float
    oscillation_limit: int
    n_backups: int
    learning_rate: float
    discount: float
    doubts: bool


class TrialState(NamedTuple):
    """
    What a trial decides by; its arrays are its own, and decisions change them in place.

    Parameters
    ----------
    ground : Ground
    headings : ndarray of int8, shape (n_rows, n_cols)
        Of the field, -1 for none.
    goal : tuple of int
        ``(row, col)``
    q : ndarray of float64, shape (n_rows, n_cols, 8)
    cost : ndarray of float64, shape (n_rows, n_cols)
        Cost to go, [cells]; not used unless rehearsed.
    counts : ndarray of int32, shape (n_rows, n_cols, 8)
        How often each action was taken.
    entered : ndarray of int32, shape (n_rows, n_cols)
        How often a decision was made in each cell.
    punished : ndarray of uint8, shape (n_rows, n_cols)
        Mask of the blocked actions whose avoidance has earned its reward.
    seen : ndarray of bool, shape (n_rows, n_cols)
        What was seen in this trial: there the remembered map is not in doubt.
    flood : Flood
        The search whether a way to the goal is left.
    n_doubted : ndarray of int64, shape (1,)
        How many remembered walls were doubted because none was.
    search : Search
        What rehearsal around the robot works in.
    flow : KnownFlow
        Where the flow was found to lead. It keeps something, as ``search`` does, where nobody but
        the decisions changes the map.

    """

    ground: Ground
    headings: CellMap
    goal: tuple[int, int]
    q: FloatMap
    cost: FloatMap
    counts: IntMap
    entered: IntMap
    punished: npt.NDArray[np.uint8]
    seen: BoolMap
    flood: Flood
    n_doubted: npt.NDArray[np.int64]
    search: Search
    flow: KnownFlow


class Transition(NamedTuple):
    """One action and what it led to; a blocked one leads to its own cell."""

    row: int
    col: int
    action: int
    next_row: int
    next_col: int
    reward: float


class Log(NamedTuple):
    """
    What a trial without a robot writes down.

    Parameters
    ----------
    rows : ndarray of int32, shape (k, 9)
        Filled with rows of `LOGGED`; what does not fit is not logged.
    shown : ndarray of int8, shape (k, n, n)
        At the first row of each decision, what was in sight; k may be 0.

    """

    rows: npt.NDArray[np.int32]
    shown: npt.NDArray[np.int8]


class Decision(NamedTuple):
    """
    What to do next.

    Parameters
    ----------
    heading : int
        Step to take; -1: give up.
    kind : int
        `Kind` of that step.
    blocked_heading : int
        The field's heading where it was blocked and earned -1; -1 if it was not.
    reward : int
        What the step itself earned: +1 for an avoidance, once in a trial for a cell and heading,
        so that circling at a wall does not pay.

    """

    heading: int
    kind: int
    blocked_heading: int
    reward: int


def new_trial(
    ground: Ground, headings: CellMap, goal: tuple[int, int], q: FloatMap, cost: FloatMap,
) -> TrialState:
    """Return the state of a trial that has made no decision yet; the arrays become its own."""
    rows, cols = headings.shape
    return TrialState(
        ground, headings, goal, q, cost, np.zeros((rows, cols, 8), dtype=np.int32),
        np.zeros((rows, cols), dtype=np.int32), np.zeros((rows, cols), dtype=np.uint8),
        np.zeros((rows, cols), dtype=np.bool_), new_flood((rows, cols)),
        np.zeros(1, dtype=np.int64), new_search((rows, cols), False),
        new_flow((rows, cols), False))


def backup(
    q: FloatMap, known: CellMap, transition: Transition, learning_rate: float, discount: float,
    rules: StepRules,
) -> None:
    """Apply eq. 6 once, in place; the maximum is over what the remembered map allows."""
    row, col, action, next_row, next_col, reward = transition
    allowed = allowed_steps(known, next_row, next_col, rules)
    ahead = 0.0
    first = True
    for heading in range(8):
        if allowed >> heading & 1 and (first or q[next_row, next_col, heading] > ahead):
            ahead = q[next_row, next_col, heading]
            first = False
    q[row, col, action] += learning_rate * (reward + discount * ahead - q[row, col, action])


def take_in_local_grid(trial: TrialState, row: int, col: int, blocked: int, unknown: int) -> None:
    """Take a 3x3 local grid into the map of a trial; what it shows is not in doubt any more."""
    take_in_cell(trial, row, col, False)
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if 0 <= r < trial.seen.shape[0] and 0 <= c < trial.seen.shape[1] and (
                not unknown >> heading & 1):
            take_in_cell(trial, r, c, blocked >> heading & 1 == 1)


def take_in_cell(trial: TrialState, row: int, col: int, occupied: bool) -> None:
    """
    Take in how a cell is seen.

    What was doubted until now no longer counts as longer, what was worth a look not as shorter.
    """
    known = trial.ground.known
    before = known[row, col]
    if 0 < before < _BLOCKED or trial.ground.factor[row, col] < 1.0:
        trial.ground.factor[row, col] = 1.0
    if before == _BLOCKED and not occupied:
        search_anew(trial.flood)
    known[row, col] = _BLOCKED if occupied else 0
    trial.seen[row, col] = True
    if occupied and before != _BLOCKED:
        note_change(trial, row, col, True)
    elif before > 0 and not occupied:
        note_change(trial, row, col, False)


def note_change(trial: TrialState, row: int, col: int, closed: bool) -> None:
    """Forget what is kept and no longer holds, as a cell is occupied now, or free."""
    if trial.flow.verdict.shape[0]:
        known, rules = trial.ground.known, trial.ground.rules
        forget_masks(trial.search, known.shape, row, col)
        if closed:
            note_closed(known, trial.headings, trial.flow, row, col, rules)
        else:
            note_opened(trial.flow)


def take_in_cells(trial: TrialState, row: int, col: int, cells: CellMap) -> None:
    """Take a wide local grid into the map of a trial, -1 where it shows nothing; compiled."""
    top, left = row - cells.shape[0] // 2, col - cells.shape[1] // 2
    for r in range(max(top, 0), min(top + cells.shape[0], trial.seen.shape[0])):
        for c in range(max(left, 0), min(left + cells.shape[1], trial.seen.shape[1])):
            if cells[r - top, c - left] != _UNKNOWN:
                take_in_cell(trial, r, c, cells[r - top, c - left] == _BLOCKED)
    take_in_cell(trial, row, col, False)


def rehearsed_step(
    row: int, col: int, field_heading: int, trial: TrialState, options: Options,
) -> int:
    """
    Return the step of least cost to go, mended around the robot; -1: no way is left.

    Before that every wall that this trial has not seen itself is doubted, so that the robot goes
    and looks. Then only what it sees can leave no way.
    """
    rehearse_locally(
        trial.ground, trial.cost, trial.search, row, col, trial.goal, options.n_backups)
    heading = best_step(trial.ground, trial.cost, row, col, field_heading)
    if not options.doubts or (heading >= 0 and not is_shut_off(
            trial.ground, trial.flood, row, col, trial.goal, _LOOKED_AT * options.n_backups)):
        return heading
    n_doubted = doubt_unseen(trial.ground, trial.cost, trial.seen, trial.goal)
    if n_doubted == 0:
        return -1
    trial.n_doubted[0] += n_doubted
    trial.search.masks[:] = 0
    note_opened(trial.flow)
    search_anew(trial.flood)
    rehearse_locally(
        trial.ground, trial.cost, trial.search, row, col, trial.goal, options.n_backups)
    return best_step(trial.ground, trial.cost, row, col, field_heading)


def choose(
    row: int, col: int, field_heading: int, allowed: int, trial: TrialState, options: Options,
    rng: np.random.Generator,
) -> tuple[int, int]:
    """
    Choose the heading of a step, once the local grid is in the remembered map.

    Returns ``(heading, kind)``; heading -1: no way is left.
    """
    counts, limit = trial.counts, options.oscillation_limit
    free = field_heading >= 0 and allowed >> field_heading & 1 == 1
    if free and counts[row, col, field_heading] < limit and (
            not options.rehearsed
            or comes_home(trial.ground.known, trial.headings, trial.flow, row, col, trial.goal,
                          trial.ground.rules)):
        return field_heading, _FIELD
    if options.rehearsed:
        heading = rehearsed_step(row, col, field_heading, trial, options)
        if heading >= 0 and counts[row, col, heading] < 4 * limit:
            return heading, _DETOUR if free else _AVOID
        if heading < 0:
            return -1, _AVOID
    elif not free:
        values = window_values(trial.q, row, col, options.window, options.power)
        heading = next_highest(values, counts, trial.entered, row, col, field_heading, allowed)
        if counts[row, col, heading] < limit:
            return heading, _AVOID
    return least_chosen(counts, row, col, allowed, rng), _EXPLORE


def decide(
    row: int, col: int, blocked: int, unknown: int, trial: TrialState, options: Options,
    rng: np.random.Generator,
) -> Decision:
    """
    Make one decision and give its rewards (Case 1 and eq. 4 to 6 online).

    ``blocked`` and ``unknown`` are the masks of the local grid.
    """
    known, rules = trial.ground.known, trial.ground.rules
    take_in_local_grid(trial, row, col, blocked, unknown)
    trial.entered[row, col] += 1
    field_heading = int(trial.headings[row, col])
    allowed = allowed_steps(known, row, col, rules)
    blocked_heading = -1
    if field_heading >= 0 and not allowed >> field_heading & 1:
        blocked_heading = field_heading
        backup(trial.q, known, Transition(row, col, field_heading, row, col, -1.0),
               options.learning_rate, options.discount, rules)
    if allowed == 0:
        return Decision(-1, _AVOID, blocked_heading, 0)
    heading, kind = choose(row, col, field_heading, allowed, trial, options, rng)
    if heading < 0:
        return Decision(-1, kind, blocked_heading, 0)
    trial.counts[row, col, heading] += 1
    if blocked_heading < 0 or trial.punished[row, col] >> blocked_heading & 1:
        return Decision(heading, kind, blocked_heading, 0)
    trial.punished[row, col] |= 1 << blocked_heading
    backup(trial.q, known, Transition(row, col, heading, row + STEP_ROW[heading],
                                      col + STEP_COL[heading], 1.0),
           options.learning_rate, options.discount, rules)
    return Decision(heading, kind, blocked_heading, 1)


def n_rewards(decision: Decision) -> int:
    """Return how many rewards other than zero a decision gave."""
    return int(decision.blocked_heading >= 0) + int(decision.reward != 0)


def write_decision(
    log: IntMap, n: int, row: int, col: int, decision: Decision, blocked: int, step: int,
) -> int:
    """Append the rows of a decision to a log of n rows if they fit; return their number."""
    if decision.blocked_heading >= 0:
        stays = Transition(row, col, decision.blocked_heading, row, col, -1.0)
        n = write_row(log, n, stays, _BLOCKED_KIND, blocked, step)
    if decision.heading >= 0:
        moves = Transition(row, col, decision.heading, row + STEP_ROW[decision.heading],
                           col + STEP_COL[decision.heading], float(decision.reward))
        n = write_row(log, n, moves, decision.kind, blocked, step)
    return n


def write_row(
    log: IntMap, n: int, transition: Transition, kind: int, blocked: int, step: int,
) -> int:
    """Append a row to a log if it fits; return the number of rows."""
    if n >= log.shape[0]:
        return n
    log[n, 0], log[n, 1], log[n, 2] = transition.row, transition.col, transition.action
    log[n, 3], log[n, 4] = transition.next_row, transition.next_col
    log[n, 5], log[n, 6], log[n, 7], log[n, 8] = int(transition.reward), kind, blocked, step
    return n + 1


def write_shown(log: Log, n: int, scanner: Scanner) -> None:
    """Write down what is in sight for a decision whose rows begin at n, if it fits."""
    if n < log.shown.shape[0]:
        log.shown[n] = scanner.shown
