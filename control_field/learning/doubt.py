"""Which doubted walls a field is led through: none, as long as there is another way."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels import compiled
from control_field.kernels.steps import Ground, no_preference, StepRules
from control_field.learning.memory import Memory
from control_field.local_grid import BLOCKED
from control_field.robot.policy import is_doubted, rules_of

#: A certain wall counts as so many times longer than a doubted one of the same strength.
_CERTAIN = 10.0


@dataclass(frozen=True, eq=False)
class Maps:
    """
    What a field says of the map, and what it is planned on.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map; walls that shut off known free ground are doubted on the way from there.
    planned : ndarray of int8, shape (n_rows, n_cols)
        The same with doubted walls as walls, but for those on ways that have no other.

    """

    known: npt.NDArray[np.int8]
    planned: npt.NDArray[np.int8]


def cautious(known: npt.NDArray[np.int8]) -> Maps:
    """Return the maps of a remembered map, planned on with every doubted wall as a wall."""
    planned: npt.NDArray[np.int8] = np.where(is_doubted(known), BLOCKED, known)
    return Maps(known, planned)


def with_ways_out(memory: Memory, maps: Maps, cost: npt.NDArray[np.float64]) -> Maps:
    """
    Open walls where known free ground has no way to the goal: the least certain ones on the way.

    Parameters
    ----------
    memory : Memory
        With a goal.
    maps : Maps
    cost : ndarray of float64, shape (n_rows, n_cols)
        Cost to go on ``maps.planned``, inf without a way.

    """
    shut_off = (maps.known == 0) & np.isinf(cost)
    if memory.goal is None or not memory.parameters.map_memory or not shut_off.any():
        return maps
    strength = memory.evidence.strength
    factor = 1.0 + np.where(maps.known == BLOCKED, _CERTAIN * strength, strength)
    passable = np.where(maps.known > 0, 1, maps.known).astype(np.int8)
    ground = Ground(passable, factor, rules_of(memory.parameters))
    through = compiled.cost_to_go(ground, memory.goal, no_preference(passable.shape))
    opened = compiled.crossed(ground, through, shut_off, memory.goal) & (maps.planned == BLOCKED)
    known, planned = maps.known.copy(), maps.planned.copy()
    known[opened & (known == BLOCKED)] = BLOCKED - 1
    planned[opened] = known[opened]
    return Maps(known, planned)


def as_shown(memory: Memory, rules: StepRules) -> npt.NDArray[np.int8]:
    """
    Return the remembered map with what is doubted on the shown way as free: to go and look.

    The very map, if nothing is in doubt there.
    """
    doubted = is_doubted(memory.known)
    if not doubted.any():
        return memory.known
    known = memory.known.copy()
    for row, col in np.argwhere(memory.demonstrated >= 0).tolist():
        heading = int(memory.demonstrated[row, col])
        r, c = row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])
        beside = () if rules.corner_cutting else ((r, col), (row, c))
        for cell in ((row, col), (r, c), *beside):
            if doubted[cell]:
                known[cell] = 0
    return known
