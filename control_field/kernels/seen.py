"""What the local grids of one episode show of every cell; compiled, as `kernels` says."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import CellMap

SeenMap = npt.NDArray[np.uint8]

#: Bits of a cell: seen free, seen occupied, and occupied when it was seen last.
FREE_SEEN: Final = 1
OCCUPIED_SEEN: Final = 2
OCCUPIED_LAST: Final = 4


def note_cell(shown: SeenMap, row: int, col: int, occupied: bool) -> None:
    """Note how a cell was seen; one outside the map is passed over."""
    if 0 <= row < shown.shape[0] and 0 <= col < shown.shape[1]:
        if occupied:
            shown[row, col] |= OCCUPIED_SEEN | OCCUPIED_LAST
        else:
            shown[row, col] = (shown[row, col] | FREE_SEEN) & (FREE_SEEN | OCCUPIED_SEEN)


def note_local_grid(shown: SeenMap, row: int, col: int, blocked: int, unknown: int) -> None:
    """Note a 3x3 local grid; the robot's own cell is free, for it is there."""
    note_cell(shown, row, col, False)
    for heading in range(8):
        if not unknown >> heading & 1:
            note_cell(shown, row + STEP_ROW[heading], col + STEP_COL[heading],
                      blocked >> heading & 1 == 1)


def note_cells(shown: SeenMap, top: int, left: int, cells: CellMap) -> None:
    """Note a block of cells, -1 for those it says nothing about."""
    for row in range(cells.shape[0]):
        for col in range(cells.shape[1]):
            if cells[row, col] >= 0:
                note_cell(shown, top + row, left + col, cells[row, col] != 0)
