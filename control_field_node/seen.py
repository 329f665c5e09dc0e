"""A neighbourhood, made ready once for everything that looks at it."""

from collections.abc import Callable
from dataclasses import dataclass

from control_field.grid import Grid
from control_field.local_grid import ALL, masks_from_neighbourhood
from control_field.robot.collision_monitor import local_grid_from_cells, LocalGrid
from msgs_bridge.messages.neighbourhoods import Neighbourhood


@dataclass(frozen=True, slots=True)
class Seen:
    """
    What the robot sees around a cell.

    Parameters
    ----------
    row, col : int
        The cell in the middle.
    blocked, unknown : int
        Masks of the eight cells around it.
    occupied : frozenset of (row, col)
        Cells of the nine that must not be entered.
    local_grid : LocalGrid
        The same for the collision monitor.

    """

    row: int
    col: int
    blocked: int
    unknown: int
    occupied: frozenset[tuple[int, int]]
    local_grid: LocalGrid

    @property
    def shows_nothing(self) -> bool:
        """Tell whether all around the robot is unknown."""
        return self.unknown == ALL

    @property
    def is_tight(self) -> bool:
        """Tell whether anything around is occupied, so that the robot has to drive exactly."""
        return bool(self.occupied)


def seen_from_neighbourhood(
    neighbourhood: Neighbourhood, grid: Grid, unknown_is_blocked: bool,
) -> Seen:
    """Make a neighbourhood ready."""
    row, col = neighbourhood.row, neighbourhood.col
    cells = neighbourhood.cells.tolist()
    blocked, unknown = masks_from_neighbourhood(neighbourhood.cells)
    occupied = frozenset(
        (row + i - 1, col + j - 1) for i in range(3) for j in range(3)
        if (i, j) != (1, 1) and (
            not grid.contains(row + i - 1, col + j - 1)
            or (unknown_is_blocked if cells[i][j] == -1 else cells[i][j] != 0)))
    local_grid = local_grid_from_cells(cells, row, col, grid, unknown_is_blocked)
    return Seen(row, col, blocked, unknown, occupied, local_grid)


def cached_seen() -> Callable[[Neighbourhood, Grid, bool], Seen]:
    """Return `seen_from_neighbourhood` that does nothing while the same things are seen."""
    last: list[tuple[object, Seen]] = []

    def seen(neighbourhood: Neighbourhood, grid: Grid, unknown_is_blocked: bool) -> Seen:
        key = (neighbourhood.row, neighbourhood.col, neighbourhood.cells.tobytes(), grid,
               unknown_is_blocked)
        if not last or last[0][0] != key:
            last[:] = [(key, seen_from_neighbourhood(neighbourhood, grid, unknown_is_blocked))]
        return last[0][1]

    return seen
