"""Loops of a path: what is cut out of it, and what is said of that."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.words import counted


def loop_erased(cells: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """
    Return which entries of a path are left when its loops are cut out.

    Parameters
    ----------
    cells : ndarray of int32, shape (n, 2)
        Cells in the order they were entered.

    Returns
    -------
    ndarray of int64, shape (k,)
        Indices, growing: of every cell that is left, the last time it was entered.

    """
    kept: list[int] = []
    place: dict[tuple[int, int], int] = {}
    path = [(row, col) for row, col in cells.tolist()]
    for index, cell in enumerate(path):
        if cell in place:
            cut = place[cell]
            for erased in kept[cut:]:
                del place[path[erased]]
            del kept[cut:]
        place[cell] = len(kept)
        kept.append(index)
    return np.array(kept, dtype=np.int64)


@dataclass(frozen=True)
class Loop:
    """
    A piece of a path that leads back to the cell where it begins; nothing is learnt from it.

    Parameters
    ----------
    n_cells : int
        Cells of the path that are cut out.
    length : float, [m]
        Along them and back.
    first, last : float, [s]
        When it begins and when the robot is back.
    place : tuple of float, [m]
        Centre of the cell where it begins and ends.

    """

    n_cells: int
    length: float
    first: float
    last: float
    place: tuple[float, float]

    def text(self, start: float) -> str:
        """Say it in a few words, with seconds from ``start`` [s]."""
        return (f'{self.n_cells} ({self.length:.1f} m) from ({self.place[0]:.2f}, '
                f'{self.place[1]:.2f}) back to it, {self.first - start:.1f} to '
                f'{self.last - start:.1f} s')


def loops_of(
    cells: npt.NDArray[np.int32], stamps: npt.NDArray[np.float64],
    places: npt.NDArray[np.float64],
) -> tuple[Loop, ...]:
    """
    Return the loops that are cut out of a path, in order.

    Parameters
    ----------
    cells : ndarray of int32, shape (n, 2)
    stamps : ndarray, shape (n,), [s]
        When each was entered.
    places : ndarray, shape (n, 2), [m]
        Their centres.

    """
    if len(cells) == 0:
        return ()
    ends = loop_erased(cells)
    begins = np.concatenate([[-1], ends[:-1]]) + 1
    # What is cut out between two cells that are left leads back to where it began.
    return tuple(
        _loop(begin, end, stamps, places) for begin, end in zip(
            begins.tolist(), ends.tolist(), strict=True) if begin < end)


def _loop(
    begin: int, end: int, stamps: npt.NDArray[np.float64], places: npt.NDArray[np.float64],
) -> Loop:
    way = np.hypot(*np.diff(places[begin:end + 1], axis=0).T)
    return Loop(end - begin, float(way.sum()), float(stamps[begin]), float(stamps[end]),
                (float(places[end, 0]), float(places[end, 1])))


def sentence_from_loops(loops: tuple[Loop, ...], n_cells: int, start: float) -> str:
    """Say how much of a drive of ``n_cells`` cells that began at ``start`` [s] is cut out."""
    if not loops:
        return ''
    n_cut = sum(loop.n_cells for loop in loops)
    longest = sorted(loops, key=lambda loop: -loop.n_cells)[:3]
    texts = '; '.join(loop.text(start) for loop in sorted(longest, key=lambda loop: loop.first))
    more = len(loops) - len(longest)
    return (f'{n_cut} of {counted(n_cells, "cell")} driven are not learnt, they only lead back to '
            f'where the robot had been: {texts}' + (f'; and {more} shorter ways' if more else ''))
