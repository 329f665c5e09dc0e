"""A drive that leaves the workspace is not learnt; here is what would hold it."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import place_text
from control_field.grid import fitted_workspace, Grid

#: A pose so far outside, in cells, is one on the edge.
EDGE: Final = 0.2
#: No drive gets so many cells away from the workspace that it began in.
FAR_AWAY: Final = 2**30


class OutsideWorkspaceError(ValueError):
    """
    A drive leaves the workspace; the message says when, where, and how far the drive reaches.

    Parameters
    ----------
    message : str
    fitting : Grid or None
        A workspace that holds the whole drive; None if none does.

    """

    def __init__(self, message: str, fitting: Grid | None) -> None:
        """Keep both."""
        super().__init__(message)
        self.fitting = fitting


def check_inside(
    grid: Grid, stamps: npt.NDArray[np.float64], xy: npt.NDArray[np.float64],
) -> None:
    """
    Refuse a drive that leaves the workspace: what lies outside cannot be learnt, nor left out.

    Parameters
    ----------
    grid : Grid
    stamps : ndarray, shape (n,), [s]
    xy : ndarray, shape (n, 2), [m]

    Raises
    ------
    OutsideWorkspaceError

    """
    low = np.array([grid.origin_x, grid.origin_y])
    high = low + grid.resolution * np.array([grid.n_cols, grid.n_rows])
    edge = EDGE * grid.resolution
    outside = ((xy < low - edge) | (xy > high + edge)).any(axis=1)
    if not outside.any():
        return
    first = int(outside.argmax())
    where = place_text((float(xy[first, 0]), float(xy[first, 1])))
    after = f'{stamps[first] - stamps[0]:.2f} s'
    raise OutsideWorkspaceError(
        f'the drive leaves the workspace: {int(outside.sum())} of {len(xy)} poses lie outside, '
        f'the first after {after} at {where}. It reaches from {_corner(xy.min(axis=0))} to '
        f'{_corner(xy.max(axis=0))} m, the workspace from {_corner(low)} to {_corner(high)} m',
        fitting_workspace(grid, xy))


def check_near(grid: Grid, cells: npt.NDArray[np.int64]) -> None:
    """
    Refuse cells so far away that they have no numbers.

    Parameters
    ----------
    grid : Grid
    cells : ndarray of int64, shape (n, 2)
        ``(row, col)`` of ``grid``; they may lie outside it.

    Raises
    ------
    ValueError

    """
    if len(cells) and np.abs(cells).max() > FAR_AWAY:
        far = cells[np.abs(cells).max(axis=1).argmax()].tolist()
        raise ValueError(f'the drive gets to {place_text(grid.world_from_cell(*far))} m, too far '
                         f'away for cells of {grid.resolution:g} m')


def fitting_workspace(grid: Grid, xy: npt.NDArray[np.float64]) -> Grid | None:
    """Return the workspace of the same cells that fits itself to a drive; None if too large."""
    try:
        return fitted_workspace(grid, xy)
    except ValueError:
        return None


def _corner(place: npt.NDArray[np.float64]) -> str:
    return place_text((float(place[0]), float(place[1])))
