"""A drive that ends, or begins, where no trial does: in a cell that it saw blocked itself."""

from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import place_text
from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.records import Demonstration

#: The goal moves at most so many cells back; a drive that ends deeper among walls is kept.
MOST_BACK: Final = 2


def n_before_tight_end(
    cells: npt.NDArray[np.int32], at: npt.NDArray[np.float64], stamps: npt.NDArray[np.float64],
    seen_from: npt.NDArray[np.int64] | None, blocked: npt.NDArray[np.uint8],
) -> int:
    """
    Return how many cells of a drive lie before those at its end that it saw blocked.

    A person may stop the robot close to a desk, where it fits beside the centre of a cell and not
    at it. What was seen last before the cell was entered counts: who steps aside is no desk.

    Parameters
    ----------
    cells : ndarray of int32, shape (n, 2)
        Of the drive, neighbours one after the other.
    at : ndarray, shape (n,), [s]
        When each was entered.
    stamps : ndarray, shape (m,), [s]
        Of the local grids, not decreasing.
    seen_from : ndarray, shape (m, 2), or None
        The cells they were seen from, where that is known.
    blocked : ndarray of uint8, shape (m,)
        Which neighbours they show blocked, a bit a heading.

    Returns
    -------
    int
        ``n`` where the end is free, or blocked for more than `MOST_BACK` cells.

    """
    n = len(cells)
    for last in range(n - 1, max(n - 2 - MOST_BACK, 0), -1):
        step = cells[last] - cells[last - 1]
        before = (stamps >= at[last - 1]) & (stamps <= at[last])
        if seen_from is not None:
            before &= (seen_from == cells[last - 1]).all(axis=1)
        looks = np.flatnonzero(before)
        if not (len(looks) and step.any()
                and blocked[looks[-1]] >> heading_from_step(*step.tolist()) & 1):
            return last + 1
    return n


def sentence_from_tight_end(grid: Grid, goal: tuple[int, int], end: tuple[int, int]) -> str:
    """Say that the goal is not where the drive ended, but before."""
    return (f'it ends at {place_text(grid.world_from_cell(*end))} m, in a cell that the local '
            f'grid shows as blocked: the goal is before it, at '
            f'{place_text(grid.world_from_cell(*goal))} m')


def first_free_cell(record: Demonstration) -> int:
    """
    Return the number of the first cell of a drive in the middle of which a robot can start.

    A person may have begun close to a desk: then that cell is seen blocked from the next one.
    Where that goes on for more than `MOST_BACK` cells it is the very first.
    """
    cells = record.cells[:MOST_BACK + 2].tolist()
    for i, ((row, col), (next_row, next_col)) in enumerate(pairwise(cells)):
        back = heading_from_step(row - next_row, col - next_col)
        if i + 2 < len(record.cells) and not record.blocked[i + 1] >> back & 1:
            return i
    return 0
