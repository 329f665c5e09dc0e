"""A picture of what stands where: squares of one size, free or blocked."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE


@dataclass(frozen=True, eq=False)
class Raster:
    """
    Squares and whether something stands in them.

    Parameters
    ----------
    grid : Grid
        Where they are; around it are walls.
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked; row 0 at the lowest y. Made read-only.

    Raises
    ------
    ValueError
        If the shape disagrees with the grid, or a cell is neither free nor blocked.

    """

    grid: Grid
    occupancy: npt.NDArray[np.int8]

    def __post_init__(self) -> None:
        """Check the cells and lock them."""
        cells = np.ascontiguousarray(self.occupancy, dtype=np.int8)
        if cells.shape != self.grid.shape:
            raise ValueError(f'world: occupancy has shape {cells.shape}, must be '
                             f'{self.grid.shape}')
        if not ((cells == FREE) | (cells == BLOCKED)).all():
            raise ValueError(f'world: cells must be {FREE} (free) or {BLOCKED} (blocked)')
        if cells is self.occupancy and cells.flags.writeable:
            cells = cells.copy()
        cells.setflags(write=False)
        object.__setattr__(self, 'occupancy', cells)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Return the lower left and the upper right corner, (x, y, x, y), [m]."""
        grid = self.grid
        return (grid.origin_x, grid.origin_y,
                grid.origin_x + grid.n_cols * grid.resolution,
                grid.origin_y + grid.n_rows * grid.resolution)
