"""Which ground is worth a look, and the field for trials that go and look."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import UNIT
from control_field.kernels import compiled
from control_field.kernels.interpolation import Sums
from control_field.kernels.steps import no_preference, plain_ground
from control_field.learning.memory import Memory
from control_field.local_grid import BLOCKED
from control_field.rays import rays_within
from control_field.records import ControlField
from control_field.robot.policy import rules_of

#: What a look at a cell is worth that is merely long unseen, times the square root of its age
#: (Dyna-Q+), beside one that was never seen or may have changed since: it decides where nothing
#: else does. Younger ones are not worth a look.
_LONG_UNSEEN: Final = 0.001
_LEAST_AGE: Final = 10
#: What it costs to go to a wall and find that it still stands, [cells]; from a chosen start, where
#: the trial is there to look, less, unless the world has changed and there is more to look at.
_IN_VAIN: Final = 10.0
_IN_VAIN_FROM_CHOSEN: Final = 4.0
#: Sums of worth that are nothing but rounding.
_NOTHING: Final = 1e-9
#: Confidence in a wall, in the field of a trial that goes to look at it.
_TRIED: Final = 1


def worth_of_look(memory: Memory) -> npt.NDArray[np.float64]:
    """
    Return what a look at each cell is worth: 0 for what is fresh.

    1 where nothing was ever seen, or not since the world has changed.

    Returns
    -------
    ndarray of float64, shape (n_rows, n_cols)

    """
    evidence = memory.evidence
    age = np.maximum(evidence.age, 0)
    is_old = (age >= _LEAST_AGE) | (evidence.state == BLOCKED)
    worth = np.where(is_old, _LONG_UNSEEN * np.sqrt(age), 0.0)
    worth[evidence.outdated | (memory.known < 0)] = 1.0
    return worth


def prices_of_walls(memory: Memory) -> npt.NDArray[np.float64]:
    """
    Return how many cells nearer a way through each wall must be for a look at it to be worth it.

    A wall that has stood for n episodes opens, as far as one can tell, once in n. To look at it
    every ``a`` episodes costs ``cost / a`` an episode; what opened is found ``a / 2`` episodes
    late, which costs ``gain * a / (2 * n)``. Both together are least for ``a * a = 2 * n * cost
    / gain``: so a wall of age ``a`` is worth a look if it would save ``2 * n * cost / (a * a)``.

    Returns
    -------
    ndarray of float64, shape (n_rows, n_cols), [cells]
        At least 1; inf for what is no wall, or was seen in the last episode.

    """
    evidence = memory.evidence
    age = np.maximum(evidence.age, 1)
    in_vain = np.where(
        evidence.outdated | memory.parameters.prefer_shorter, _IN_VAIN, _IN_VAIN_FROM_CHOSEN)
    price = np.maximum(2.0 * evidence.n_episodes * in_vain / age.astype(np.float64) ** 2, 1.0)
    is_tried = (evidence.state == BLOCKED) & (evidence.age > 0) & (
        evidence.map_memory > 0)
    return np.where(is_tried, price, np.inf)


def worth_around(worth: npt.NDArray[np.float64], reach: int) -> npt.NDArray[np.float64]:
    """
    Sum up, at every cell, what its local grid would show.

    Parameters
    ----------
    worth : ndarray of float64, shape (n_rows, n_cols)
    reach : int, [cells]
        From the robot's cell to the edge of the local grid.

    Returns
    -------
    ndarray of float64, shape (n_rows, n_cols)

    """
    rows, cols = worth.shape
    sums = np.zeros((rows + 2 * reach + 1, cols + 2 * reach + 1))
    sums[1:, 1:] = np.pad(worth, reach).cumsum(axis=0).cumsum(axis=1)
    side = 2 * reach + 1
    total: npt.NDArray[np.float64] = (
        sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side])
    return total


def worth_in_view(
    worth: npt.NDArray[np.float64], known: npt.NDArray[np.int8], reach: int,
    enough: float = np.inf,
) -> npt.NDArray[np.float64]:
    """
    Sum up, at every cell, what its local grid would show past the walls that are remembered.

    Parameters
    ----------
    worth : ndarray of float64, shape (n_rows, n_cols)
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.
    reach : int, [cells]
        From the robot's cell to the edge of the local grid.
    enough : float, optional
        How much more it is than this does not matter, and may be left out.

    Returns
    -------
    ndarray of float64, shape (n_rows, n_cols)

    """
    around = worth_around(worth, reach)
    if reach > 1:
        # Where nothing of worth is near no line of sight needs to be followed.
        around = compiled.sum_in_view(worth, known, around > _NOTHING, rays_within(reach), enough)
    return around


def exploration_field(memory: Memory, field: ControlField) -> ControlField:
    """
    Return a field for a trial that is to teach: on its way to the goal it prefers to look around.

    Steps to where cells worth a look come into sight count as shorter, by at most ``curiosity``;
    so the way is longer than the best by at most ``1 / (1 - curiosity)``, and only over such
    ground. Through walls that may have opened it leads at their price: those last seen before the
    world has changed, and once all that can be reached was seen, those not seen for long. With
    ``prefer_shorter`` it looks only where a shorter way may be: unseen ground counts as free.
    A robot reads these prices in the Q-matrix (`policy.prices_in_q`), so that it goes on looking
    around where the way is not free as planned.

    Parameters
    ----------
    memory : Memory
        With a goal.
    field : ControlField
        The field in force; grid, goal and revision are taken from it.

    """
    parameters, none = memory.parameters, no_preference(field.grid.shape)
    known: npt.NDArray[np.int8] = np.where(memory.known > 0, BLOCKED, memory.known)
    plain = plain_ground(known, rules_of(parameters))
    price = prices_of_walls(memory)
    if not parameters.prefer_shorter and compiled.reaches_unseen(plain, field.goal):
        price[~memory.evidence.outdated] = np.inf
    is_tried = np.isfinite(price)
    known[is_tried] = _TRIED
    curiosity = 0.0 if parameters.prefer_shorter else parameters.curiosity
    # As much as a step brings into sight on unseen ground makes it as attractive as it gets.
    enough = 2 * memory.reach + 1
    around = worth_in_view(worth_of_look(memory), memory.known, memory.reach, float(enough))
    factor = np.where(is_tried, price, 1.0 - curiosity * np.minimum(around, enough) / enough)
    ground = plain._replace(factor=factor)
    cost = compiled.cost_to_go(ground, field.goal, none)
    q = compiled.q_from_cost(ground, cost, none, parameters.discount)
    headings = compiled.attraction_from_cost(ground, cost, Sums.none(field.grid.shape))
    vx, vy = (np.where(headings >= 0, UNIT[headings, axis], 0.0) for axis in (0, 1))
    return ControlField(
        grid=field.grid, revision=field.revision, goal=field.goal, vx=vx.astype(np.float32),
        vy=vy.astype(np.float32), coherence=np.hypot(vx, vy).astype(np.float32),
        q=q.astype(np.float32), known=known, flags=field.flags.copy())
