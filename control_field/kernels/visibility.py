"""What can be seen from a cell, and what is remembered of it; plain Python or compiled."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.kernels.steps import _BLOCKED, _UNKNOWN, BoolMap, CellMap, FloatMap

#: Rows and columns from the robot's cell.
Rays = npt.NDArray[np.int16]


class Scanner(NamedTuple):
    """
    How far a robot sees.

    Parameters
    ----------
    rays : ndarray of int16, shape (n_rays, n_cells, 2)
        Of `rays.rays_within`; none: it sees the cells around it.
    shown : ndarray of int8, shape (n, n)
        Takes what is seen.

    """

    rays: Rays
    shown: CellMap


def look(truth: CellMap, row: int, col: int, rays: Rays, seen: CellMap) -> None:
    """
    Write into ``seen`` what is seen from a cell; what lies outside of the map is blocked.

    Parameters
    ----------
    truth : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.
    row, col : int
        The robot's cell.
    rays : ndarray of int16, shape (n_rays, n_cells, 2)
        Of `rays.rays_within`.
    seen : ndarray of int8, shape (n, n)
        As `rays.visible_cells` returns it.

    """
    middle = seen.shape[0] // 2
    seen[:] = _UNKNOWN
    for r in range(-1, 2):
        for c in range(-1, 2):
            seen[middle + r, middle + c] = state_at(truth, row + r, col + c)
    for i in range(rays.shape[0]):
        for j in range(rays.shape[1]):
            r, c = int(rays[i, j, 0]), int(rays[i, j, 1])
            if r != 0 or c != 0:
                state = state_at(truth, row + r, col + c)
                seen[middle + r, middle + c] = state
                if state == _BLOCKED:
                    break


def state_at(truth: CellMap, row: int, col: int) -> int:
    """Return the state of a cell; blocked outside of the map."""
    if row < 0 or col < 0 or row >= truth.shape[0] or col >= truth.shape[1]:
        return _BLOCKED
    return int(truth[row, col])


def remember_cells(known: CellMap, seen: BoolMap, row: int, col: int, cells: CellMap) -> int:
    """
    Write a local grid into the remembered map; return how many cells it newly occupied.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.
    seen : ndarray of bool, shape (n_rows, n_cols)
        Takes where something was seen.
    row, col : int
        The robot's cell, which is free: the robot is there.
    cells : ndarray of int8, shape (n, n)
        0 free, 100 blocked, -1 unknown, the robot's cell in the middle; what lies outside of the
        map is left out.

    """
    low, left = row - cells.shape[0] // 2, col - cells.shape[1] // 2
    bottom, top = max(low, 0), min(low + cells.shape[0], known.shape[0])
    first, last = max(left, 0), min(left + cells.shape[1], known.shape[1])
    new = cells[bottom - low:top - low, first - left:last - left]
    old = known[bottom:top, first:last]
    n_occupied = int(((new == _BLOCKED) & (old != _BLOCKED)).sum())
    shown = new != _UNKNOWN
    # np.where says the same, and takes three times as long to compile.
    known[bottom:top, first:last] = old * ~shown + new * shown
    seen[bottom:top, first:last] |= shown
    known[row, col], seen[row, col] = 0, True
    return n_occupied


def sum_in_view(
    worth: FloatMap, known: CellMap, wanted: BoolMap, rays: Rays, enough: float,
) -> FloatMap:
    """
    Sum up, at some cells, the worth of all that is in view from there, until it is enough.

    Parameters
    ----------
    worth : ndarray of float64, shape (n_rows, n_cols)
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map: nothing is in view behind its walls.
    wanted : ndarray of bool, shape (n_rows, n_cols)
        Which cells to look from.
    rays : ndarray of int16, shape (n_rays, n_cells, 2)
    enough : float
        How much more it is than this does not matter.

    Returns
    -------
    ndarray of float64, shape (n_rows, n_cols)
        0 at all others.

    """
    total = np.zeros(known.shape)
    seen_from = np.full(known.shape, -1, dtype=np.int64)
    shared = shared_beginnings(rays)
    for row in range(known.shape[0]):
        for col in range(known.shape[1]):
            if wanted[row, col] and known[row, col] != _BLOCKED:
                total[row, col] = sum_from(
                    worth, known, row, col, rays, shared, seen_from, enough)
    return total


def shared_beginnings(rays: Rays) -> npt.NDArray[np.int64]:
    """Return how many cells each ray has in common with the one before, from the beginning."""
    shared = np.zeros(rays.shape[0], dtype=np.int64)
    for i in range(1, rays.shape[0]):
        while shared[i] < rays.shape[1] and (
                rays[i, shared[i], 0] == rays[i - 1, shared[i], 0]
                and rays[i, shared[i], 1] == rays[i - 1, shared[i], 1]):
            shared[i] += 1
    return shared


def sum_from(
    worth: FloatMap, known: CellMap, row: int, col: int, rays: Rays,
    shared: npt.NDArray[np.int64], seen_from: npt.NDArray[np.int64], enough: float,
) -> float:
    """Sum up the worth in view from a cell; ``seen_from`` keeps, at each, the last that saw it."""
    rows, cols = known.shape
    number, total, end = row * cols + col, 0.0, rays.shape[1]
    for r in range(max(0, row - 1), min(rows, row + 2)):
        for c in range(max(0, col - 1), min(cols, col + 2)):
            seen_from[r, c] = number
            total += worth[r, c]
    for i in range(rays.shape[0]):
        if total >= enough:
            break
        if end < shared[i]:
            continue  # it ends where the one before did
        end = rays.shape[1]
        for j in range(shared[i], rays.shape[1]):
            r, c = row + int(rays[i, j, 0]), col + int(rays[i, j, 1])
            if r < 0 or c < 0 or r >= rows or c >= cols:
                end = j
                break
            if seen_from[r, c] != number:
                seen_from[r, c] = number
                total += worth[r, c]
            if known[r, c] == _BLOCKED:
                end = j
                break
    return total
