"""The ground that a bag's local grids show, for where no field was recorded in it."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import CellBox, Grid, TooLargeError
from control_field.headings import N_HEADINGS, STEP_COL, STEP_ROW
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from episode_store.episode import Episode
from episode_store.rosbag2.topic_tables import local_grid_table, LocalGridTable

#: Cells of a picture; a place that is larger is not drawn.
_MOST_CELLS: Final = 2**20
#: So many wide local grids are laid upon each other.
_MOST_WIDE: Final = 400
_AROUND: Final = np.stack([STEP_ROW, STEP_COL], axis=1).astype(np.int64)

Known = npt.NDArray[np.int8]
#: Cells ``(row, col)`` and what was seen there, in the order of time.
Seen = tuple[npt.NDArray[np.int64], Known]


def ground_seen(episode: Episode) -> tuple[Grid, Known]:
    """
    Return what the local grids of a bag saw, each cell as it was seen last.

    Returns
    -------
    grid : Grid
        So large that it holds all of it; one cell where there is nothing, or too much.
    known : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked, -1 never seen.

    """
    header = episode.header
    table = local_grid_table(episode.messages('neighbourhood'), header.grid, header.fitted)
    seen = [_far(table), _near(table)]
    cells = np.concatenate([part[0] for part in seen])
    nowhere = header.grid.window(CellBox(0, 0, 0, 0)), np.full((1, 1), UNKNOWN, dtype=np.int8)
    if not len(cells):
        return nowhere
    box = CellBox.of(cells)
    if (box.high_row - box.low_row + 1) * (box.high_col - box.low_col + 1) > _MOST_CELLS:
        return nowhere
    try:
        grid = header.grid.window(box)
    except TooLargeError:
        return nowhere
    known = np.full(grid.shape, UNKNOWN, dtype=np.int8)
    for where, states in seen:
        known[where[:, 0] - box.low_row, where[:, 1] - box.low_col] = states
    return grid, known


def _near(table: LocalGridTable) -> Seen:
    """Return the robot's cells and the eight around each."""
    around = table.cells[:, np.newaxis] + np.concatenate([np.zeros((1, 2), np.int64), _AROUND])
    states = np.full((len(table.cells), 1 + N_HEADINGS), FREE, dtype=np.int8)
    bits = np.uint8(1) << np.arange(N_HEADINGS, dtype=np.uint8)
    for masks, state in ((table.blocked, BLOCKED), (table.unknown, UNKNOWN)):
        states[:, 1:][masks[:, np.newaxis] & bits != 0] = state
    return _known(around.reshape(-1, 2), states.reshape(-1))


def _far(table: LocalGridTable) -> Seen:
    """Return what wider local grids show, of some of them where there are many."""
    grids = table.local_grids
    grids = grids[::max(1, -(-len(grids) // _MOST_WIDE))]
    if not len(grids):
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int8)
    side = grids['cells'].shape[1]
    offsets = np.argwhere(np.ones((side, side), dtype=np.bool_)) - side // 2
    middle = np.stack([grids['row'], grids['col']], axis=1).astype(np.int64)
    cells = middle[:, np.newaxis] + offsets
    return _known(cells.reshape(-1, 2), grids['cells'].reshape(-1))


def _known(cells: npt.NDArray[np.int64], states: Known) -> Seen:
    seen = states != UNKNOWN
    return cells[seen], states[seen]
