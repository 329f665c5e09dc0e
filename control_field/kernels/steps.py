"""
Steps and choices: the loops of the method, written once for two executions.

Plain Python over NumPy arrays: the robot runs these functions as they stand, the learner's side
runs the same source through numba (`control_field.kernels.compiled`). So they keep to what numba
understands: scalars, arrays, tuples, and one another.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.local_grid import BLOCKED, UNKNOWN

CellMap = npt.NDArray[np.int8]
IntMap = npt.NDArray[np.int32] | npt.NDArray[np.int64]
BoolMap = npt.NDArray[np.bool_]
FloatMap = npt.NDArray[np.float64]


class StepRules(NamedTuple):
    """
    Which steps from cell to cell a map allows.

    Parameters
    ----------
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell beside it.
    unknown_is_blocked : bool
        Whether cells never seen count as occupied.
    moves : int
        8, or 4 without diagonal steps.

    """

    corner_cutting: bool
    unknown_is_blocked: bool
    moves: int


class Ground(NamedTuple):
    """
    What a way is planned over.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map: 0 free, 100 blocked, -1 never seen; 1 to 99 doubted, which can be passed.
    factor : ndarray of float64, shape (n_rows, n_cols)
        What scales the length of a step into each cell.
    rules : StepRules

    """

    known: CellMap
    factor: FloatMap
    rules: StepRules


class Preference(NamedTuple):
    """
    Steps that count as shorter than they are.

    Parameters
    ----------
    headings : ndarray of int8, shape (n_rows, n_cols)
        The preferred step of each cell, -1 for none.
    spared : ndarray of float64, shape (n_rows, n_cols)
        Share of its length that it is spared, 0 to 1.

    """

    headings: CellMap
    spared: FloatMap


_BLOCKED = int(BLOCKED)
_UNKNOWN = int(UNKNOWN)


def plain_ground(known: CellMap, rules: StepRules) -> Ground:
    """Return ground where every step is as long as it is."""
    return Ground(known, np.ones(known.shape), rules)


def no_preference(shape: tuple[int, int]) -> Preference:
    """Return the preference for no step at all."""
    return Preference(np.full(shape, -1, dtype=np.int8), np.zeros(shape))


def is_occupied(known: CellMap, row: int, col: int, unknown_is_blocked: bool) -> bool:
    """Return whether a cell lies outside or is known (or held) to be blocked."""
    if row < 0 or col < 0 or row >= known.shape[0] or col >= known.shape[1]:
        return True
    state = known[row, col]
    return state == _BLOCKED or (unknown_is_blocked and state == _UNKNOWN)


def is_doubtful(known: CellMap, row: int, col: int, unknown_is_blocked: bool) -> bool:
    """Return whether a cell is occupied or doubted: no diagonal step may pass beside it."""
    return is_occupied(known, row, col, unknown_is_blocked) or known[row, col] > 0


def step_allowed(known: CellMap, row: int, col: int, heading: int, rules: StepRules) -> bool:
    """Return True if the map allows a step."""
    corner_cutting, unknown_is_blocked, moves = rules
    if heading % 2 == 1:
        if moves == 4:
            return False
        if not corner_cutting and (
                is_doubtful(known, row + STEP_ROW[heading], col, unknown_is_blocked)
                or is_doubtful(known, row, col + STEP_COL[heading], unknown_is_blocked)):
            return False
    return not is_occupied(
        known, row + STEP_ROW[heading], col + STEP_COL[heading], unknown_is_blocked)


def allowed_steps(known: CellMap, row: int, col: int, rules: StepRules) -> int:
    """Return the mask of the steps that the map allows: `step_allowed` for all of them at once."""
    corner_cutting, unknown_is_blocked, moves = rules
    free, clear = 0, 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if not is_occupied(known, r, c, unknown_is_blocked):
            free |= 1 << heading
            if known[r, c] <= 0:
                clear |= 1 << heading
    straight = free & 0b01010101
    if moves == 4:
        return straight
    if corner_cutting:
        return free
    # Bit h of these is the straight neighbour before heading h, and the one after it.
    clear &= 0b01010101
    before, after = clear << 1, clear >> 1 | clear << 7
    return straight | (free & before & after & 0b10101010)


def remember_local_grid(known: CellMap, row: int, col: int, blocked: int, unknown: int) -> int:
    """Write a 3x3 local grid into the remembered map; return how many cells it newly occupied."""
    known[row, col] = 0
    n_occupied = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if 0 <= r < known.shape[0] and 0 <= c < known.shape[1] and not unknown >> heading & 1:
            state = _BLOCKED if blocked >> heading & 1 else 0
            if state == _BLOCKED and known[r, c] != _BLOCKED:
                n_occupied += 1
            known[r, c] = state
    return n_occupied


def step_length(ground: Ground, preference: Preference, row: int, col: int, heading: int) -> float:
    """Return what a step from a cell counts as, [cells]; it must not leave the map."""
    length: float = STEP_LENGTH[heading] * ground.factor[
        row + STEP_ROW[heading], col + STEP_COL[heading]]
    if preference.headings[row, col] == heading:
        length *= 1.0 - preference.spared[row, col]
    return length


def best_step(ground: Ground, cost: FloatMap, row: int, col: int, toward: int) -> int:
    """
    Return the allowed step of least cost to go; ties go to the one nearest the field's heading.

    Returns -1 where no step leads to the goal. ``toward`` is a heading or -1.
    """
    allowed = allowed_steps(ground.known, row, col, ground.rules)
    return best_of(allowed, ground.factor, cost, row, col, toward)


def best_of(
    allowed: int, factor: FloatMap, cost: FloatMap, row: int, col: int, toward: int,
) -> int:
    """Return which of the steps of a mask is the `best_step`."""
    best, best_cost, best_turn = -1, np.inf, 9
    for heading in range(8):
        if not allowed >> heading & 1:
            continue
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        total = cost[r, c] + STEP_LENGTH[heading] * factor[r, c]
        turn = turn_between(heading, toward)
        if total < best_cost - 1e-9 or (total < best_cost + 1e-9 and turn < best_turn):
            best, best_cost, best_turn = heading, total, turn
    return best


def turn_between(heading: int, toward: int) -> int:
    """Return how many eighths of a turn lie between two headings; 0 where there is no heading."""
    if toward < 0:
        return 0
    return abs((heading - toward + 4) % 8 - 4)


def least_chosen(
    counts: IntMap, row: int, col: int, allowed: int, rng: np.random.Generator,
) -> int:
    """Return a random one of the allowed headings that were chosen least often here."""
    fewest = 1 << 30
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] < fewest:
            fewest = counts[row, col, heading]
    n = 0
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] == fewest:
            n += 1
    pick = int(rng.random() * n)
    for heading in range(8):
        if allowed >> heading & 1 and counts[row, col, heading] == fewest:
            if pick == 0:
                return heading
            pick -= 1
    return -1


def window_values(q: FloatMap, row: int, col: int, window: float, power: float) -> FloatMap:
    """
    Return the Q-values of the eight actions as the effective window sees them.

    Inverse-distance sum of ``Q(c, a)`` over the cells c of the window; the cell itself counts as
    half a cell away. Only their order matters, so the common denominator is left out.
    """
    values = np.zeros(8)
    reach = int(window)
    for r in range(max(0, row - reach), min(q.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(q.shape[1], col + reach + 1)):
            d = math.hypot(r - row, c - col)
            if d > window:
                continue
            w = 1.0 / max(d, 0.5) ** power
            for heading in range(8):
                if q[r, c, heading] != 0.0:
                    values[heading] += w * q[r, c, heading]
    return values


def next_highest(
    values: FloatMap, counts: IntMap, entered: IntMap, row: int, col: int, toward: int,
    allowed: int,
) -> int:
    """
    Return the free action with the next highest Q-value (Case 1).

    Ties: nearest to the field's heading, then least often chosen, then the cell least often
    entered, then counter-clockwise.
    """
    best = -1
    best_key = (0.0, 0, 0, 0)
    for heading in range(8):
        if not allowed >> heading & 1:
            continue
        turn = turn_between(heading, toward)
        visits = entered[row + STEP_ROW[heading], col + STEP_COL[heading]]
        key = (-round(values[heading], 9), turn, counts[row, col, heading], visits)
        if best < 0 or key < best_key:
            best, best_key = heading, key
    return best
