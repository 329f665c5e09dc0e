"""A neighbourhood, prepared once for everything that decides by it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.local_grid import ALL, masks_from_neighbourhood
from control_field.robot.obstacle_boxes import local_grid_from_cells, LocalGrid
from msgs_bridge.messages.neighbourhoods import Neighbourhood

Mask = npt.NDArray[np.bool_]
_STEPS: Final = tuple(zip(STEP_ROW.tolist(), STEP_COL.tolist(), strict=True))


@dataclass(frozen=True, slots=True)
class Observation:
    """
    What the robot observes around a cell.

    Parameters
    ----------
    row, col : int
        The cell in the middle.
    blocked, unknown, outside : int
        Masks of the eight cells around it; the last one: outside the workspace.
    occupied : frozenset of (row, col)
        Cells of the nine that must not be entered.
    local_grid : LocalGrid
        The same for the collision monitor.
    cells : ndarray of int8, shape (n, n)
        All that is observed, the robot's cell in the middle.

    """

    row: int
    col: int
    blocked: int
    unknown: int
    outside: int
    occupied: frozenset[tuple[int, int]]
    local_grid: LocalGrid
    cells: npt.NDArray[np.int8] = field(compare=False)

    @property
    def cell(self) -> tuple[int, int]:
        """Return the cell in the middle."""
        return self.row, self.col

    def around(self) -> Iterator[tuple[tuple[int, int], bool]]:
        """Yield each cell of the workspace around the robot that is seen, and if it is blocked."""
        for heading, (d_row, d_col) in enumerate(_STEPS):
            if not (self.unknown | self.outside) >> heading & 1:
                yield (self.row + d_row, self.col + d_col), bool(self.blocked >> heading & 1)

    @property
    def is_wide(self) -> bool:
        """Return whether more is observed than the cells around the robot's."""
        return len(self.cells) > 3

    @property
    def is_all_unknown(self) -> bool:
        """Return whether all eight cells around the robot are unknown."""
        return self.unknown == ALL

    @property
    def is_tight(self) -> bool:
        """Return whether anything around is occupied, so that the robot has to drive exactly."""
        return bool(self.occupied)


@dataclass(frozen=True, slots=True)
class LocalGridRules:
    """
    How a neighbourhood is taken.

    Parameters
    ----------
    unknown_is_blocked : bool
        Whether to keep out of unknown cells.
    own_cell : bool
        Whether a blocked middle means that something reaches into the robot's own cell.
    mover_speed : float, [m/s]
        How fast what moves may come; 0: nothing does.
    backs_off : bool
        Whether the robot may drive away from it.
    bounded : bool
        Whether to keep out of what lies outside the workspace: a trial does, a person need not.

    """

    unknown_is_blocked: bool = False
    own_cell: bool = True
    mover_speed: float = 0.0
    backs_off: bool = False
    bounded: bool = True


def observation_from_neighbourhood(
    neighbourhood: Neighbourhood, grid: Grid, rules: LocalGridRules, moving: Mask | None = None,
) -> Observation:
    """Prepare a neighbourhood; ``moving`` are the cells of its `finest` that may come nearer."""
    row, col = neighbourhood.row, neighbourhood.col
    nine = neighbourhood.nine
    cells = nine.tolist()
    blocked, unknown = masks_from_neighbourhood(nine)
    outside = 0 if not rules.bounded else sum(
        1 << heading for heading, (d_row, d_col) in enumerate(_STEPS)
        if not grid.contains(row + d_row, col + d_col))
    occupied = frozenset(
        (row + i - 1, col + j - 1) for i in range(3) for j in range(3)
        if (i, j) != (1, 1) and (
            (rules.bounded and not grid.contains(row + i - 1, col + j - 1))
            or (rules.unknown_is_blocked if cells[i][j] == -1 else cells[i][j] != 0)))
    local_grid = local_grid_from_cells(
        nine, row, col, grid, rules.unknown_is_blocked, rules.own_cell,
        fine=None if neighbourhood.fine is None else neighbourhood.finest, moving=moving,
        mover_speed=rules.mover_speed, backs_off=rules.backs_off, bounded=rules.bounded)
    return Observation(
        row, col, blocked, unknown, outside, occupied, local_grid, neighbourhood.cells)


class ObservationCache:
    """Prepares a neighbourhood again only when it has changed."""

    def __init__(self) -> None:
        """Start empty."""
        self._last: tuple[object, Observation] | None = None

    def get(
        self, neighbourhood: Neighbourhood, grid: Grid, rules: LocalGridRules,
        moving: Mask | None = None,
    ) -> Observation:
        """Return what `observation_from_neighbourhood` does."""
        key = (neighbourhood.row, neighbourhood.col, neighbourhood.cells.tobytes(),
               None if neighbourhood.fine is None else neighbourhood.fine.tobytes(), grid, rules,
               None if moving is None else moving.tobytes())
        if self._last is None or self._last[0] != key:
            self._last = key, observation_from_neighbourhood(neighbourhood, grid, rules, moving)
        return self._last[1]
