"""Where the next trial would teach most, and where one more demonstration would help most."""

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors, UNIT
from control_field.kernels import compiled
from control_field.kernels.interpolation import Sums
from control_field.kernels.steps import Ground, no_preference, StepRules
from control_field.learning.memory import Memory
from control_field.records import ControlField
from control_field.robot.policy import rules_of

#: Judge at most this many starts, spread evenly over the workspace.
_MOST_CANDIDATES = 4096
#: Three unseen cells in sight make a step as attractive as it gets.
_ENOUGH_UNSEEN = 3


def n_unseen_around(known: npt.NDArray[np.int8]) -> npt.NDArray[np.int64]:
    """
    Count the unseen cells of every cell's 3x3 local grid.

    Returns
    -------
    ndarray of int64, shape (n_rows, n_cols)

    """
    rows, cols = known.shape
    unseen = np.pad(known < 0, 1).astype(np.int64)
    count: npt.NDArray[np.int64] = np.sum(
        [unseen[i:i + rows, j:j + cols] for i in range(3) for j in range(3)], axis=0)
    return count


def exploration_field(memory: Memory, field: ControlField) -> ControlField:
    """
    Return a field for a trial that is to teach: on its way to the goal it prefers to look around.

    Steps to where unseen cells come into sight count as shorter, by at most ``curiosity``; so the
    way is longer than the best by at most ``1 / (1 - curiosity)``, and only over unseen ground.
    With ``prefer_shorter`` it looks only where a shorter way may be: unseen ground counts as free.

    Parameters
    ----------
    memory : Memory
        With a goal.
    field : ControlField
        The field in force; grid, goal, revision and remembered map are taken from it.

    """
    parameters, rules = memory.parameters, rules_of(memory.parameters)
    curiosity = 0.0 if parameters.prefer_shorter else parameters.curiosity
    share = np.minimum(n_unseen_around(memory.known), _ENOUGH_UNSEEN) / _ENOUGH_UNSEEN
    factor = 1.0 - curiosity * share
    ground, none = Ground(memory.known, factor, rules), no_preference(field.grid.shape)
    cost = compiled.cost_to_go(ground, field.goal, none)
    q = compiled.q_from_cost(ground, cost, none, parameters.discount)
    headings = compiled.attraction_from_cost(ground, cost, Sums.none(field.grid.shape))
    vx, vy = (np.where(headings >= 0, UNIT[headings, axis], 0.0) for axis in (0, 1))
    return ControlField(
        grid=field.grid, revision=field.revision, goal=field.goal, vx=vx.astype(np.float32),
        vy=vy.astype(np.float32), coherence=np.hypot(vx, vy).astype(np.float32),
        q=q.astype(np.float32), known=field.known.copy(), flags=field.flags.copy())


def information_gain(
    field: ControlField, driven: ControlField, rules: StepRules,
) -> npt.NDArray[np.float64]:
    """
    Return how much unseen ground a trial from each cell would show, and how much it matters.

    The unseen cells that come into sight along the driven flow, each counted by the square root of
    how many cells' flow crosses it: ground that many ways depend on is worth most.

    Parameters
    ----------
    field : ControlField
        The field whose flows shall come home.
    driven : ControlField
        The field the trial would follow.
    rules : StepRules

    Returns
    -------
    ndarray, shape (n_rows, n_cols)
        0 where nothing new would be seen or the flow does not reach the goal.

    """
    headings = headings_from_vectors(field.vx, field.vy)
    state = compiled.flow_basin(field.known, headings, *field.goal, rules)
    crossing = compiled.n_crossing(headings, state, *field.goal)
    if driven is not field:
        headings = headings_from_vectors(driven.vx, driven.vy)
        state = compiled.flow_basin(field.known, headings, *field.goal, rules)
    judged = np.zeros(state.shape, dtype=np.bool_)
    judged.reshape(-1)[::-(-state.size // _MOST_CANDIDATES)] = True
    value: npt.NDArray[np.float64] = compiled.unseen_along(
        headings, judged & (state == 1), field.known, np.sqrt(crossing), *field.goal)
    return value


def best_cells(value: npt.NDArray[np.float64], n: int) -> list[tuple[int, int]]:
    """Return the n cells of greatest value above 0, best first; ties by row, then column."""
    order = np.argsort(-value, axis=None, kind='stable')[:n]
    cells = np.stack(np.unravel_index(order, value.shape), axis=1)
    return [(int(row), int(col)) for row, col in cells if value[row, col] > 0.0]
