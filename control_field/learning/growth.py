"""A workspace that fits itself: what each episode needs of it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.grid import CellBox, fitted_box, Grid
from control_field.local_grid import UNKNOWN
from control_field.records import Demonstration, Trial


@dataclass(frozen=True)
class FittedWorkspace:
    """
    The workspace of a sequence of episodes: what each of them needs, and never less than before.

    Parameters
    ----------
    lattice : Grid
        The cell that all places are reckoned from, see `Grid.lattice`.
    box : CellBox or None
        The workspace in cells of the lattice; None before the first episode.

    """

    lattice: Grid
    box: CellBox | None = None

    @property
    def grid(self) -> Grid | None:
        """
        Return the workspace; None before the first episode.

        Raises
        ------
        TooLargeError
            If none has so many cells.

        """
        return None if self.box is None else self.lattice.window(self.box)

    def with_record(self, record: Demonstration | Trial, grid: Grid) -> 'FittedWorkspace':
        """
        Return it with room for one more episode, see `grid.fitted_box`.

        Parameters
        ----------
        record : Demonstration or Trial
        grid : Grid
            The one that its cells are of; they may lie outside it.

        Raises
        ------
        ValueError
            If the grid is of another lattice.

        """
        offset = grid.offset_to(self.lattice)
        if offset is None:
            raise ValueError(f'the cells of {grid} are not those of {self.lattice}')
        been, seen = (None if box is None else box.shifted(*offset)
                      for box in (_been(record), _seen(record.local_grids)))
        box = fitted_box(been, seen)
        if box is not None and self.box is not None:
            box = box.union(self.box)
        return FittedWorkspace(self.lattice, box or self.box)

    def with_places(self, xy: npt.NDArray[np.float64]) -> 'FittedWorkspace':
        """
        Return it with room for a robot at places; itself where it holds them and what is beside.

        Parameters
        ----------
        xy : ndarray, shape (n, 2), [m]
            Finite.

        """
        box = self.box
        for cell in self.lattice.cells_from_world(xy):
            place = CellBox.of(cell[np.newaxis])
            beside = place.widened(1)
            if box is not None and box.union(beside) != box:
                needed = fitted_box(place)
                box = box if needed is None else box.union(needed)
        return self if box == self.box else FittedWorkspace(self.lattice, box)

    def with_grid(self, grid: Grid) -> 'FittedWorkspace':
        """Return it with room for all cells of a grid of the lattice; itself for any other."""
        offset = grid.offset_to(self.lattice)
        if offset is None:
            return self
        box = grid.box.shifted(*offset)
        return FittedWorkspace(self.lattice, box if self.box is None else box.union(self.box))


def _been(record: Demonstration | Trial) -> CellBox | None:
    """Return the cells that a robot was in, or is told to go to."""
    if isinstance(record, Demonstration):
        return CellBox.of(record.cells) if len(record.cells) else None
    rows = record.decisions
    if not len(rows):
        return None
    return CellBox(*(int(edge) for edge in (
        min(rows['row'].min(), rows['next_row'].min()),
        min(rows['col'].min(), rows['next_col'].min()),
        max(rows['row'].max(), rows['next_row'].max()),
        max(rows['col'].max(), rows['next_col'].max()))))


def _seen(local_grids: npt.NDArray[np.void]) -> CellBox | None:
    """Return the cells that wide local grids say something about; the others show no farther."""
    is_seen = local_grids['cells'] != UNKNOWN
    edges = []
    for name, across in (('row', 2), ('col', 1)):
        along = is_seen.any(axis=across)
        some = along.any(axis=1)
        if not some.any():
            return None
        along, middles = along[some], local_grids[name][some].astype(np.int64)
        reach = along.shape[1] // 2
        last = along.shape[1] - 1 - along[:, ::-1].argmax(axis=1)
        edges.append((int((middles + along.argmax(axis=1)).min()) - reach,
                      int((middles + last).max()) - reach))
    (low_row, high_row), (low_col, high_col) = edges
    return CellBox(low_row, low_col, high_row, high_col)
