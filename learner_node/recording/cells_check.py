"""Which cells a workspace that fits itself is made of, and whether local grids lie on them."""

from collections.abc import Callable

from nav_msgs.msg import OccupancyGrid

from control_field.grid import default_lattice, Grid
from learner_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import (
    lattice_from_local_grid, neighbourhood_from_grid, RESOLUTION_TOLERANCE)
from msgs_bridge.messages.serialized import message_from_cdr
from msgs_bridge.node.workspace_settings import side_of_cells


class CellsCheck:
    """
    Finds the cells for a first demonstration: those of the local grids, else by the robot's size.

    Parameters
    ----------
    settings : Settings
    said : callable, optional
        Returns a cell of those that a simulator, or who makes local grids, says of itself; None
        if nobody does. A local grid of 9 x 9 may be one of 3 x 3 in finer cells.

    """

    def __init__(
        self, settings: Settings, said: Callable[[], Grid | None] = lambda: None,
    ) -> None:
        self._settings, self._said = settings, said
        self._default = default_lattice(side_of_cells(settings), settings.frame_id)

    def lattice(self, local_grid: bytes) -> Grid:
        """
        Return a cell of the lattice that a first demonstration is recorded on.

        Parameters
        ----------
        local_grid : bytes
            The newest message, serialised; empty before the first.

        """
        found = self._heard(local_grid)
        return self._default if found is None or self._contradiction(found) else found

    def problem(self, local_grid: bytes, learnt: Grid | None) -> str:
        """
        Say why nothing can be learnt from local grids, with what to set; empty if it can.

        Parameters
        ----------
        local_grid : bytes
            The newest message, serialised; empty before the first.
        learnt : Grid or None
            The workspace of what was learnt; None before the first demonstration.

        """
        if learnt is not None:
            return self._misfit(local_grid, learnt) if local_grid else ''
        found = self._heard(local_grid)
        return '' if found is None else self._contradiction(found)

    def _heard(self, local_grid: bytes) -> Grid | None:
        """Return the cells of a local grid; None if there is none that can be read."""
        if not local_grid:
            return None
        said = self._said() or self._default
        try:
            found = lattice_from_local_grid(message_from_cdr(local_grid, OccupancyGrid),
                                            self._settings.resolution or said.resolution)
        except (ValueError, RuntimeError):
            return None  # its reader says so where it is learnt from
        return found if found.frame_id == self._settings.frame_id else None

    def _contradiction(self, found: Grid) -> str:
        given, side = self._settings.resolution, found.resolution
        if not given or abs(given - side) <= RESOLUTION_TOLERANCE * side:
            return ''
        return (f'resolution is {given:g} m, and the cells of neighbourhood are {side:g} m: start '
                f'learner_node with resolution:={side:g} or without it, or what publishes '
                f'neighbourhood with resolution:={given:g}')

    def _misfit(self, local_grid: bytes, learnt: Grid) -> str:
        try:
            neighbourhood_from_grid(
                message_from_cdr(local_grid, OccupancyGrid), learnt, bounded=False)
        except (ValueError, RuntimeError) as error:
            return (f'{error}. What task {self._settings.task} has learnt is of cells of '
                    f'{learnt.resolution:g} m: set these for what publishes neighbourhood, or '
                    f'begin another task (-p task:=...)')
        return ''
