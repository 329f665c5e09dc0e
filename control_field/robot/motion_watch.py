"""Which cells something has come into a short while ago."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED, FREE, UNKNOWN

#: How long what has come into a cell may go on moving, [s]: what has stood for so long stands.
_MOVES_FOR: Final = 2.0
#: How long a cell must have been free before it counts, [s]: walls at the edge of a cell flicker.
_FREE_FOR: Final = 0.3

Cells = npt.NDArray[np.int8]


class MotionWatch:
    """
    Compares each sight with those before it, and what is seen first with what is remembered.

    What leaves the sight is forgotten: nobody knows what it did meanwhile. What has come into the
    robot's own cell may go on as long as it is there.
    """

    def __init__(self) -> None:
        """Start with nothing seen."""
        self.forget()

    def forget(self) -> None:
        """Start anew, on other cells or in another time."""
        self._low = (0, 0)
        self._stamp = -np.inf
        self._states = np.zeros((0, 0), dtype=np.int8)
        self._since = np.zeros((0, 0))
        self._came = np.zeros((0, 0))

    def shift(self, rows: int, cols: int) -> None:
        """Go on in another workspace of the same lattice, so many rows and columns farther up."""
        k = len(self._states) // 3  # finer cells along a side of each
        self._low = self._low[0] + rows * k, self._low[1] + cols * k

    def moving(
        self, stamp: float, low: tuple[int, int], cells: Cells, k: int = 1,
        remembered: Cells | None = None,
    ) -> npt.NDArray[np.bool_]:
        """
        Take in a sight; return which of its cells something has come into.

        Parameters
        ----------
        stamp : float, [s]
        low : tuple of int
            Row and column of the first cell, among cells of this size.
        cells : ndarray of int8, shape (n, n)
            0 free, 100 blocked, -1 unknown; the robot's own in the middle.
        k : int
            How many of them lie along a side of the robot's own cell.
        remembered : ndarray of int8, shape (n, n), optional
            What is remembered of them.

        Returns
        -------
        ndarray of bool, shape (n, n)

        """
        if stamp < self._stamp or cells.shape != self._states.shape:
            self.forget()
        before, since, came = self._shifted(low, cells.shape)
        if remembered is not None:
            is_first = (before == UNKNOWN) & (remembered == FREE)
            before[is_first], since[is_first] = FREE, -np.inf
        is_blocked = cells == BLOCKED
        comes = is_blocked & (before == FREE) & (stamp - since >= _FREE_FOR)
        came = np.where(comes, stamp, np.where(cells == FREE, -np.inf, came))
        own = slice((len(cells) - k) // 2, (len(cells) + k) // 2)
        came[own, own][is_blocked[own, own] & (came[own, own] > -np.inf)] = stamp
        states = np.where(cells == UNKNOWN, before, cells)
        self._since = np.where(states == before, since, stamp)
        self._states, self._came, self._low, self._stamp = states, came, low, stamp
        moving: npt.NDArray[np.bool_] = is_blocked & (stamp - came <= _MOVES_FOR)
        return moving

    def _shifted(
        self, low: tuple[int, int], shape: tuple[int, ...],
    ) -> tuple[Cells, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return what was seen before of the cells that are seen now, and since when."""
        before = np.full(shape, UNKNOWN, dtype=np.int8)
        since, came = np.full(shape, np.inf), np.full(shape, -np.inf)
        here, there = [], []
        for new, old, n in zip(low, self._low, self._states.shape, strict=True):
            first, last = max(new, old), min(new, old) + n
            here.append(slice(first - new, max(last - new, first - new)))
            there.append(slice(first - old, max(last - old, first - old)))
        to, of = tuple(here), tuple(there)
        before[to], since[to], came[to] = self._states[of], self._since[of], self._came[of]
        return before, since, came
