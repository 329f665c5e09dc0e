"""The cells of many local grids at once: what `neighbourhood_from_grid` reads of each."""

from collections.abc import Iterator
from dataclasses import dataclass
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import (
    BLOCKED, cells_from_fine, FREE, is_local_grid_size, MAX_SIDE, SUBDIVISIONS, UNKNOWN)
from control_field.records import local_grid_dtype, no_local_grids
from episode_store.rosbag2.columns import Columns
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.neighbourhoods import RESOLUTION_TOLERANCE

#: Bytes of cells that are looked at in one go.
_BLOCK: Final = 1 << 22

Rows = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LocalGridCells:
    """
    What local grids show, message by message.

    Parameters
    ----------
    reach : ndarray of int64, shape (n,), [cells]
        From the robot's cell to the edge; 1 for a 3x3.
    nine : ndarray of int8, shape (n, 9)
        The cells in the middle.
    wide : list of (ndarray of int64, shape (m,), and ndarray of int8, shape (m, side, side))
        Those that show more than the nine: which message, and its cells.

    """

    reach: Rows
    nine: npt.NDArray[np.int8]
    wide: list[tuple[Rows, npt.NDArray[np.int8]]]

    def local_grids(
        self, stamps: npt.NDArray[np.float64], middles: Rows, kept: npt.NDArray[np.bool_],
    ) -> npt.NDArray[np.void]:
        """
        Return the wide ones as a table, in order, each only where it is not as the one before.

        Parameters
        ----------
        stamps : ndarray, shape (n,), [s]
        middles : ndarray of int64, shape (n, 2)
            The robot's cells.
        kept : ndarray of bool, shape (n,)
            Which messages count.

        Returns
        -------
        ndarray of `local_grid_dtype`, shape (k,)
            Smaller ones are unknown around.

        """
        wide = [(rows[kept[rows]], cells[kept[rows]]) for rows, cells in self.wide]
        rows = np.concatenate([np.zeros(0, dtype=np.int64), *(each for each, _ in wide)])
        if not len(rows):
            return no_local_grids()
        table = np.zeros(len(rows), local_grid_dtype(max(cells.shape[1] for _, cells in wide)))
        table['stamp'], table['row'], table['col'] = (
            stamps[rows], middles[rows, 0], middles[rows, 1])
        n_before = 0
        for each, cells in wide:
            edge = (table['cells'].shape[1] - cells.shape[1]) // 2
            table['cells'][n_before:n_before + len(each)] = np.pad(
                cells, ((0, 0), (edge, edge), (edge, edge)), constant_values=UNKNOWN)
            n_before += len(each)
        table = table[np.argsort(rows, kind='stable')]
        changes = (table['cells'][1:] != table['cells'][:-1]).any(axis=(1, 2))
        for name in ('row', 'col'):
            changes |= table[name][1:] != table[name][:-1]
        return np.asarray(table[np.append(True, changes)])


def read_cells(messages: RawMessages, columns: Columns, grid: Grid) -> LocalGridCells:
    """
    Read the cells of OccupancyGrid messages on the cells of ``grid``, or on finer ones.

    Parameters
    ----------
    messages : RawMessages
    columns : Columns
        With ``resolution``, ``width`` and ``height``; takes refusals.
    grid : Grid

    """
    n, name = len(messages), messages.topic
    found = LocalGridCells(np.ones(n, dtype=np.int64), np.zeros((n, 9), dtype=np.int8), [])
    finer = _subdivisions(columns, grid)
    _refuse(columns, np.arange(n), finer == 0, f'{name}: resolution is not {grid.resolution:g} m, '
            f'or a third or a fifth of it')
    for rows, offset, side, k in _alike(columns, finer, name):
        found.reach[rows] = side // k // 2
        step = max(_BLOCK // side ** 2, 1)
        for start in range(0, len(rows), step):
            _read(messages, columns, found, rows[start:start + step], (offset, side, k))
    return found


def _subdivisions(columns: Columns, grid: Grid) -> Rows:
    """Return how many of each message's cells lie along one of the workspace's; 0: none."""
    with np.errstate(over='ignore', invalid='ignore'):
        resolution = columns.values['resolution'].astype(np.float64)
        fits = [np.abs(resolution * k - grid.resolution) <= RESOLUTION_TOLERANCE * grid.resolution
                for k in SUBDIVISIONS]
    return np.select(fits, SUBDIVISIONS, 0).astype(np.int64)


def _alike(
    columns: Columns, finer: Rows, name: str,
) -> Iterator[tuple[Rows, int, int, int]]:
    """Yield messages of one size: which, where their cells begin, side, how many a cell."""
    for number, layout in enumerate(columns.layouts):
        rows = np.flatnonzero(columns.layout == number)
        place = layout.places['data']
        side = math.isqrt(place.n)
        fits = ((columns.values['width'][rows] == side) & (columns.values['height'][rows] == side)
                & (side * side == place.n))
        for k in SUBDIVISIONS:
            fits &= (finer[rows] != k) | (side % k == 0 and is_local_grid_size(side // k))
        _refuse(columns, rows, ~fits,
                f'{name}: is not square, of an odd number of cells from 3 to {MAX_SIDE}')
        rows = rows[fits]
        for k in SUBDIVISIONS:
            if (finer[rows] == k).any():
                yield rows[finer[rows] == k], place.offset, side, k


def _read(
    messages: RawMessages, columns: Columns, found: LocalGridCells, rows: Rows,
    shape: tuple[int, int, int],
) -> None:
    """Read the cells of messages whose cells have one place, side and fineness."""
    offset, side, k = shape
    data = messages.bytes_at(rows, offset, side * side).view(np.int8)
    valid = ((data == FREE) | (data == BLOCKED) | (data == UNKNOWN)).all(axis=1)
    _refuse(columns, rows, ~valid, f'{messages.topic}: a cell is not 0, 100 or -1')
    rows = rows[valid]
    cells = cells_from_fine(data[valid].reshape(-1, side, side), k)
    low = side // k // 2 - 1
    found.nine[rows] = cells[:, low:low + 3, low:low + 3].reshape(-1, 9)
    if side > 3 * k:
        found.wide.append((rows, cells))


def _refuse(columns: Columns, rows: Rows, bad: npt.NDArray[Any], reason: str) -> None:
    rows = rows[bad]
    columns.refuse(rows[columns.accepted[rows]], reason)
