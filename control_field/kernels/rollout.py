"""Following the field over a map; plain Python or compiled, as `kernels` says."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.rehearsal import step_masks
from control_field.kernels.steps import (
    best_step, BoolMap, CellMap, FloatMap, Ground, IntMap, is_occupied, step_allowed, StepRules)


def flow_reaches(
    known: CellMap, headings: CellMap, row: int, col: int, goal_row: int, goal_col: int,
    rules: StepRules,
) -> int:
    """
    Follow the field over the remembered map; tell whether it reaches the goal.

    Returns
    -------
    int
        Steps to the goal, or -1 if the flow ends in something occupied, in a cell without heading
        or in a loop: it comes back to where it was after 1, 3, 7, 15, ... steps (Brent).

    """
    step, kept_row, kept_col, until = 0, -1, -1, 1
    while row != goal_row or col != goal_col:
        heading = headings[row, col]
        if heading < 0 or (row == kept_row and col == kept_col) or not step_allowed(
                known, row, col, heading, rules):
            return -1
        if step == until:
            kept_row, kept_col, until = row, col, 2 * until + 1
        row += STEP_ROW[heading]
        col += STEP_COL[heading]
        step += 1
    return step


class KnownFlow(NamedTuple):
    """
    From where the flow was found to reach the goal, and from where not, while a map changes.

    Parameters
    ----------
    verdict : ndarray of int32, shape (n_places,) or (0,)
        Of each place: the number in force where it does, minus that where it does not; else it is
        not known. Empty: nothing is kept.
    in_force : ndarray of int32, shape (2,)
        Which numbers are in force: of the places from where it does, and of the others.

    """

    verdict: npt.NDArray[np.int32]
    in_force: npt.NDArray[np.int32]


def new_flow(shape: tuple[int, int], keeps: bool) -> KnownFlow:
    """Return a record of where flows lead that holds nothing yet, or never will."""
    return KnownFlow(np.zeros(shape[0] * shape[1] if keeps else 0, dtype=np.int32),
                     np.ones(2, dtype=np.int32))


def comes_home(
    known: CellMap, headings: CellMap, flow: KnownFlow, row: int, col: int, goal: tuple[int, int],
    rules: StepRules,
) -> bool:
    """Tell whether the flow reaches the goal, as `flow_reaches`, by what was found before."""
    verdict, n_cols = flow.verdict, known.shape[1]
    if verdict.shape[0] == 0:
        return flow_reaches(known, headings, row, col, goal[0], goal[1], rules) >= 0
    yes, no = flow.in_force[0], -flow.in_force[1]
    r, c = row, col
    while not (r == goal[0] and c == goal[1]) and verdict[r * n_cols + c] != yes:
        heading = headings[r, c]
        if verdict[r * n_cols + c] == no or heading < 0 or not step_allowed(
                known, r, c, heading, rules):
            verdict[r * n_cols + c] = no
            return False
        verdict[r * n_cols + c] = no  # as it is if the flow comes here again
        r, c = r + STEP_ROW[heading], c + STEP_COL[heading]
    while verdict[row * n_cols + col] != yes and not (row == goal[0] and col == goal[1]):
        heading = headings[row, col]
        verdict[row * n_cols + col] = yes
        row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    return True


def note_closed(
    known: CellMap, headings: CellMap, flow: KnownFlow, row: int, col: int, rules: StepRules,
) -> None:
    """Forget which flows reach the goal if one leads into a cell that is now occupied, or by."""
    rows, n_cols = known.shape
    for r in range(max(0, row - 1), min(rows, row + 2)):
        for c in range(max(0, col - 1), min(n_cols, col + 2)):
            if flow.verdict[r * n_cols + c] == flow.in_force[0] and not step_allowed(
                    known, r, c, headings[r, c], rules):
                flow.in_force[0] += 1
                return


def note_opened(flow: KnownFlow) -> None:
    """Forget which flows fail: a cell is free, or doubted, that was not."""
    flow.in_force[1] += 1


def flow_basin(
    known: CellMap, headings: CellMap, goal_row: int, goal_col: int, rules: StepRules,
) -> CellMap:
    """
    Follow the field from every cell at once.

    Returns
    -------
    ndarray of int8, shape (n_rows, n_cols)
        1: reaches the goal; 2: leads into a loop; 3: leads into a cell whose heading is blocked or
        missing; 0: the cell itself is occupied.

    """
    rows, cols = known.shape
    masks, flat = step_masks(known, rules).reshape(-1), headings.reshape(-1)
    state = np.zeros(rows * cols, dtype=np.int8)
    path = np.empty(rows * cols, dtype=np.int64)
    goal = goal_row * cols + goal_col
    for first in range(rows * cols):
        if state[first] or is_occupied(known, first // cols, first % cols, rules[1]):
            continue
        n, place, verdict = 0, first, 0
        while verdict == 0:
            heading = flat[place]
            if state[place] == 9:
                verdict = 2
            elif state[place] != 0:
                verdict = state[place]
            elif place == goal:
                state[place] = 1
                verdict = 1
            elif heading < 0 or not masks[place] >> heading & 1:
                state[place] = 3
                verdict = 3
            else:
                state[place] = 9
                path[n] = place
                n += 1
                place += STEP_ROW[heading] * cols + STEP_COL[heading]
        for i in range(n):
            state[path[i]] = verdict
    return state.reshape((rows, cols))


def flow_ends(
    known: CellMap, headings: CellMap, state: CellMap, starts: BoolMap, rules: StepRules,
) -> BoolMap:
    """
    Mark where the flows from some cells end that do not come home.

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)
        Cells whose heading is blocked or missing, and one cell a loop.

    """
    rows, cols = known.shape
    ends = np.zeros((rows, cols), dtype=np.bool_)
    walked = np.zeros((rows, cols), dtype=np.int64)
    mark = 0
    for first_row in range(rows):
        for first_col in range(cols):
            row, col = first_row, first_col
            if not starts[row, col] or state[row, col] < 2 or walked[row, col] > 0:
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


def n_as_demonstrated(
    known: CellMap, headings: CellMap, demonstrated: CellMap, rules: StepRules,
) -> tuple[int, int]:
    """Return how many demonstrated steps nothing blocks, and how many of them the field takes."""
    n_possible, n_agreeing = 0, 0
    for row in range(known.shape[0]):
        for col in range(known.shape[1]):
            heading = demonstrated[row, col]
            if (heading >= 0 and not is_occupied(known, row, col, False)
                    and step_allowed(known, row, col, heading, rules)):
                n_possible += 1
                n_agreeing += headings[row, col] == heading
    return n_possible, n_agreeing


def flows_home(
    known: CellMap, headings: CellMap, goal_row: int, goal_col: int, rules: StepRules,
) -> tuple[FloatMap, IntMap]:
    """Return every cell's flow to the goal: length and steps; inf, -1 where it does not arrive."""
    rows, cols = known.shape
    length = np.full((rows, cols), np.nan)
    n_steps = np.full((rows, cols), -1, dtype=np.int32)
    length[goal_row, goal_col], n_steps[goal_row, goal_col] = 0.0, 0
    path = np.empty((rows * cols, 2), dtype=np.int64)
    on_path = np.zeros((rows, cols), dtype=np.bool_)
    for first_row in range(rows):
        for first_col in range(cols):
            n, row, col, end, n_left = 0, first_row, first_col, np.inf, -1
            while True:
                if on_path[row, col] or is_occupied(known, row, col, rules[1]):
                    break
                if not np.isnan(length[row, col]):
                    end, n_left = length[row, col], n_steps[row, col]
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
                n_left += n_left >= 0
                length[row, col], n_steps[row, col] = end, n_left
                on_path[row, col] = False
            if np.isnan(length[first_row, first_col]):
                length[first_row, first_col] = np.inf
    return length, n_steps


def flow_lengths(
    known: CellMap, headings: CellMap, goal_row: int, goal_col: int, rules: StepRules,
) -> FloatMap:
    """Return the length of every cell's flow to the goal, inf where it does not get there."""
    return flows_home(known, headings, goal_row, goal_col, rules)[0]


def most_ahead(
    headings: CellMap, state: CellMap, value: IntMap, goal_row: int, goal_col: int,
) -> IntMap:
    """
    Return the greatest value on the flow home from each cell, its own and the goal's among them.

    Parameters
    ----------
    state : ndarray of int8
        Of `flow_basin`; other cells than those of 1 keep their own value.
    value : ndarray of int32, shape (n_rows, n_cols)

    """
    rows, cols = headings.shape
    most = value.copy()
    is_done = np.zeros((rows, cols), dtype=np.bool_)
    is_done[goal_row, goal_col] = True
    path = np.empty((rows * cols, 2), dtype=np.int64)
    for first_row in range(rows):
        for first_col in range(cols):
            n, row, col = 0, first_row, first_col
            while state[row, col] == 1 and not is_done[row, col]:
                path[n, 0], path[n, 1] = row, col
                n += 1
                heading = headings[row, col]
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
            for i in range(n - 1, -1, -1):
                r, c = path[i, 0], path[i, 1]
                most[r, c] = max(most[r, c], most[row, col])
                is_done[r, c] = True
                row, col = r, c
    return most


def n_crossing(headings: CellMap, state: CellMap, goal_row: int, goal_col: int) -> FloatMap:
    """
    Count from how many cells the flow home leads through each cell, itself included.

    Parameters
    ----------
    state : ndarray of int8
        Of `flow_basin`.

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


def seen_along(
    headings: CellMap, starts: BoolMap, value: FloatMap, goal_row: int, goal_col: int,
) -> FloatMap:
    """
    Return the summed value of the cells that flows home lead through or past.

    ``starts`` marks the cells to follow the flow from; from each it must reach the goal.
    """
    rows, cols = headings.shape
    total = np.zeros((rows, cols))
    mark = np.zeros((rows, cols), dtype=np.int64)
    for first_row in range(rows):
        for first_col in range(cols):
            if not starts[first_row, first_col]:
                continue
            row, col = first_row, first_col
            while True:
                for r in range(max(0, row - 1), min(rows, row + 2)):
                    for c in range(max(0, col - 1), min(cols, col + 2)):
                        if value[r, c] > 0.0 and mark[r, c] != first_row * cols + first_col + 1:
                            mark[r, c] = first_row * cols + first_col + 1
                            total[first_row, first_col] += value[r, c]
                if row == goal_row and col == goal_col:
                    break
                heading = headings[row, col]
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    return total


def crossed(ground: Ground, cost: FloatMap, starts: BoolMap, goal: tuple[int, int]) -> BoolMap:
    """Mark the cells on the best ways from some cells to the goal, both ends among them."""
    marked = np.zeros(cost.shape, dtype=np.bool_)
    for first_row in range(cost.shape[0]):
        for first_col in range(cost.shape[1]):
            row, col = first_row, first_col
            if not starts[row, col] or not cost[row, col] < np.inf:
                continue
            while not marked[row, col]:
                marked[row, col] = True
                heading = best_step(ground, cost, row, col, -1)
                if (row == goal[0] and col == goal[1]) or heading < 0:
                    break
                row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
    return marked
