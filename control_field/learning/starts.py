"""Where the next trial would teach most, and where one more demonstration would help most."""

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors
from control_field.kernels import compiled
from control_field.kernels.steps import StepRules
from control_field.local_grid import BLOCKED
from control_field.records import ControlField

#: Judge at most this many starts, spread evenly over the workspace.
_MOST_CANDIDATES = 4096


def information_gain(
    field: ControlField, driven: ControlField, worth: npt.NDArray[np.float64],
    rules: StepRules, among: npt.NDArray[np.bool_] | None = None,
) -> npt.NDArray[np.float64]:
    """
    Return how much a trial from each cell would show that is worth a look.

    The cells that the driven flow leads through or past, each counted by how many cells' flow
    crosses it: ground that many ways depend on is worth most. What was never seen counts by the
    square root of that number, and a wall by how many driven flows lead through it. What a wide
    local grid might show besides is left out: starts that see far from where they stand are those
    in the open, and what lies behind corners was seen from the others (measured, ADR 34).

    Parameters
    ----------
    field : ControlField
        The field whose flows shall come home.
    driven : ControlField
        The field the trial would follow.
    worth : ndarray of float64, shape (n_rows, n_cols)
        What a look at each cell is worth, 0 for nothing.
    rules : StepRules
    among : ndarray of bool, shape (n_rows, n_cols), optional
        The only cells that it may begin in.

    Returns
    -------
    ndarray, shape (n_rows, n_cols)
        0 where nothing of worth would be seen or the flow does not reach the goal.

    """
    headings, state, crossing = _flow(field, rules)
    value = worth * np.where(field.known < 0, np.sqrt(crossing), crossing)
    if driven is not field:
        headings, state, crossing = _flow(driven, rules)
        value = np.where(driven.known > 0, worth * crossing, value)
    judged = np.zeros(state.shape, dtype=np.bool_)
    possible = (state == 1) & (field.known != BLOCKED)
    if among is None:
        judged.reshape(-1)[::-(-state.size // _MOST_CANDIDATES)] = True
        judged &= possible
    else:
        places = np.flatnonzero(possible & among)
        judged.reshape(-1)[places[::max(-(-len(places) // _MOST_CANDIDATES), 1)]] = True
    gain: npt.NDArray[np.float64] = compiled.seen_along(
        headings, judged, value, *field.goal)
    return gain


def _flow(
    field: ControlField, rules: StepRules,
) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.int8], npt.NDArray[np.float64]]:
    """Return a field's headings, where its flows lead, and how many cross each cell."""
    headings = headings_from_vectors(field.vx, field.vy)
    state = compiled.flow_basin(field.known, headings, *field.goal, rules)
    return headings, state, compiled.n_crossing(headings, state, *field.goal)


def best_cells(value: npt.NDArray[np.float64], n: int) -> list[tuple[int, int]]:
    """Return the n cells of greatest value above 0, best first; ties by row, then column."""
    order = np.argsort(-value, axis=None, kind='stable')[:n]
    cells = np.stack(np.unravel_index(order, value.shape), axis=1)
    return [(int(row), int(col)) for row, col in cells if value[row, col] > 0.0]
