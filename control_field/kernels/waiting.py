"""
What has come into the way of a trial: what is waited for, looked at once more, or given up.

Plain Python over NumPy arrays that numba understands, as `control_field.kernels.steps`: the robot
and the headless world keep the same record, and ask it the same.
"""

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import (
    _BLOCKED, BoolMap, CellMap, FloatMap, step_allowed, StepRules)

#: What is ahead of a step: nothing that came, something that is waited for, or that stays.
CLEAR, WAIT, STAYS = 0, 1, 2
#: What becomes of a trial to which no way is left: it waits and looks, looks at once, or ends.
GIVE_UP, LOOK, GO_ROUND = 0, 1, 2
#: How often it waits and looks whether what came has gone; and how often where nothing goes.
_MAX_LOOKS: Final = 20
_MAX_VAIN_LOOKS: Final = 6
#: How often it then looks once more at all that it has seen closed, where things move.
_MAX_ROUNDS: Final = 2
#: Places in `WayRecord.counts`.
_GONE, _GONE_BEFORE, _N_LOOKS, _VAIN, _N_ROUNDS = 0, 1, 2, 3, 4
#: What is waited for by that name: nothing.
_NOTHING: Final = -1.0
#: Times that differ by less are the same.
_SAME_TIME: Final = 1e-9


class WayRecord(NamedTuple):
    """
    What a trial has seen of its ways; its arrays are changed in place.

    Parameters
    ----------
    room : ndarray of int8, shape (n_rows, n_cols)
        Remembered map with what was seen in this trial; where something has come there is room
        still, until it is taken for something that stays.
    came : ndarray of bool, shape (n_rows, n_cols)
        Where something has come and was not seen to go.
    glance : ndarray of int64, shape (3,)
        What was seen last of the cells around one: its row and column, the mask of the blocked.
    counts : ndarray of int64, shape (5,)
        How many cells something has gone from, be it that it came or was there from the start,
        and how many of them there were at the last look; how often a trial to which no way is
        left has looked, how often in vain, and how often at everything.
    waits : ndarray of float64, shape (2,)
        Which step is waited for, and since when.

    """

    room: CellMap
    came: BoolMap
    glance: npt.NDArray[np.int64]
    counts: npt.NDArray[np.int64]
    waits: FloatMap


def new_record(known: CellMap) -> WayRecord:
    """Return the record of a trial that has seen nothing yet, on a remembered map."""
    return WayRecord(
        known.copy(), np.zeros(known.shape, dtype=np.bool_), np.zeros(3, dtype=np.int64),
        np.zeros(5, dtype=np.int64), np.array([_NOTHING, 0.0]))


def take_in(way: WayRecord, row: int, col: int, cells: CellMap) -> None:
    """
    Take in what is seen from a cell, be it far from it: where there was room, there may be again.

    Parameters
    ----------
    row, col : int
        The robot's cell; the robot is there, whatever else reaches into it.
    cells : ndarray of int8, shape (n, n)
        0 free, 100 blocked, -1 unknown, the robot's cell in the middle; what lies outside of the
        map is left out.

    """
    low, left = row - cells.shape[0] // 2, col - cells.shape[1] // 2
    bottom, top = max(low, 0), min(low + cells.shape[0], way.room.shape[0])
    first, last = max(left, 0), min(left + cells.shape[1], way.room.shape[1])
    seen = cells[bottom - low:top - low, first - left:last - left]
    room, came = way.room[bottom:top, first:last], way.came[bottom:top, first:last]
    blocked, free = seen == _BLOCKED, seen == 0
    way.counts[_GONE] += (free & (came | (room == _BLOCKED))).sum()
    came[:] = (blocked & (came | (room == 0))) | (came & ~free & ~blocked)
    walls = blocked & (room != 0)
    room[:] = room * ~(free | walls) + _BLOCKED * walls
    way.room[row, col], way.came[row, col] = 0, False
    way.glance[0], way.glance[1], way.glance[2] = row, col, blocked_around(cells)


def blocked_around(cells: CellMap) -> int:
    """Return the mask of the blocked cells around the middle of a local grid."""
    middle, mask = cells.shape[0] // 2, 0
    for heading in range(8):
        if cells[middle + STEP_ROW[heading], middle + STEP_COL[heading]] == _BLOCKED:
            mask |= 1 << heading
    return mask


def blocked_beside(way: WayRecord, row: int, col: int) -> int:
    """Return the mask of the cells around one that were seen blocked last, be it from another."""
    d_row, d_col, blocked = way.glance[0] - row, way.glance[1] - col, way.glance[2]
    if (d_row == 0 and d_col == 0) or blocked == 0:
        return int(blocked)
    mask = 0
    for seen in range(8):
        if blocked >> seen & 1:
            r, c = d_row + STEP_ROW[seen], d_col + STEP_COL[seen]
            for heading in range(8):
                if STEP_ROW[heading] == r and STEP_COL[heading] == c:
                    mask |= 1 << heading
    return mask


def comes_into_the_way(
    known: CellMap, row: int, col: int, heading: int, blocked: int, rules: StepRules,
) -> bool:
    """
    Return whether something stands in the way of a step where there was room for it before.

    For a diagonal step the two cells beside it count, too. Where a cell of the step was never
    seen free and is blocked now, there is a wall: nobody waits for that to go.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map with what was seen in this trial, before what is seen now.
    row, col : int
        The robot's cell.
    heading : int
        Of the step, 0 to 7.
    blocked : int
        Mask of the cells around it that are seen blocked now.
    rules : StepRules

    """
    if not step_allowed(known, row, col, heading, rules):
        return False
    reach = 1 if heading % 2 == 1 and not rules.corner_cutting else 0
    comes = False
    for turn in range(-reach, reach + 1):
        beside = (heading + turn) % 8
        if blocked >> beside & 1:
            if known[row + STEP_ROW[beside], col + STEP_COL[beside]] != 0:
                return False
            comes = True
    return comes


def look_ahead(
    way: WayRecord, now: float, patience: float, row: int, col: int, heading: int,
    rules: StepRules,
) -> int:
    """
    Return whether to wait before a step or in the middle of it: `CLEAR`, `WAIT` or `STAYS`.

    What has been waited for as long as there is patience stays: it counts as a wall from then on,
    with all else that is seen blocked beside it.

    Parameters
    ----------
    now, patience : float
        Time, and how long is waited, in any unit; 0: never.
    row, col : int
        Where the step begins.
    heading : int
        Of the step; -1 for none.
    rules : StepRules

    """
    blocked = blocked_beside(way, row, col)
    if heading < 0 or blocked == 0 or not comes_into_the_way(
            way.room, row, col, heading, blocked, rules):
        way.waits[0] = _NOTHING
        return CLEAR
    step = float((row * way.room.shape[1] + col) * 8 + heading)
    if way.waits[0] != step:
        way.waits[0], way.waits[1] = step, now
    if now - way.waits[1] < patience - _SAME_TIME:
        return WAIT
    believe(way)
    return STAYS


def believe(way: WayRecord) -> None:
    """Take what was seen blocked last, around the robot, for something that stays."""
    for heading in range(8):
        r, c = way.glance[0] + STEP_ROW[heading], way.glance[1] + STEP_COL[heading]
        if way.glance[2] >> heading & 1 and (
                0 <= r < way.room.shape[0] and 0 <= c < way.room.shape[1]):
            way.room[r, c] = _BLOCKED


def look_again(way: WayRecord, patience: float, known: CellMap, seen: BoolMap) -> int:
    """
    Return what becomes of a trial to which no way is left: `LOOK`, `GO_ROUND` or `GIVE_UP`.

    Where something has come it may have gone: it is waited for, and looked at, once more. Where
    nothing has come, or that is in vain, and things were seen to move, so may whatever else was
    seen closed. What is looked at counts as not seen in this trial.

    Parameters
    ----------
    patience : float
        0: it never waits, nor looks.
    known : ndarray of int8, shape (n_rows, n_cols)
        The trial's map.
    seen : ndarray of bool, shape (n_rows, n_cols)
        What the trial has seen of it; changed in place.

    """
    if patience <= 0.0:
        return GIVE_UP
    counts = way.counts
    if counts[_GONE] != counts[_GONE_BEFORE]:
        counts[_GONE_BEFORE], counts[_VAIN] = counts[_GONE], 0
    if counts[_VAIN] < _MAX_VAIN_LOOKS and counts[_N_LOOKS] < _MAX_LOOKS:
        counts[_N_LOOKS] += 1
        counts[_VAIN] += 1
        way.room[:] = way.room * ~way.came
        if forget(seen, way.came & (known == _BLOCKED)):
            return LOOK
    if counts[_GONE] == 0 or counts[_N_ROUNDS] == _MAX_ROUNDS:
        return GIVE_UP
    counts[_N_ROUNDS] += 1
    counts[_N_LOOKS] = counts[_VAIN] = 0
    return GO_ROUND if forget(seen, known == _BLOCKED) else GIVE_UP


def forget(seen: BoolMap, cells: BoolMap) -> bool:
    """Count cells as not seen, in place; return whether there are any."""
    seen[:] = seen & ~cells
    return bool(cells.any())


def n_looks(way: WayRecord) -> int:
    """Return how often a trial has looked again since it last looked at everything."""
    return int(way.counts[_N_LOOKS])
