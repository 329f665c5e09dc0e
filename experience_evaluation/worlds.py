"""Seeded worlds of our own: open, random, rooms, mazes, corridors with doors."""

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED, FREE

Occupancy = npt.NDArray[np.int8]
#: Radius of a robot for which every pixel of a map is a cell, [m], as in our tables.
SMALL: Final = 0.01


def open_world(size: int, rng: np.random.Generator) -> Occupancy:
    """Return an empty workspace of ``size`` x ``size`` cells."""
    del rng
    return np.full((size, size), FREE, dtype=np.int8)


def random_world(size: int, rng: np.random.Generator, share: float = 0.12) -> Occupancy:
    """
    Return a workspace where single cells are blocked at random.

    Parameters
    ----------
    size : int, [cells]
    rng : numpy.random.Generator
    share : float
        Of blocked cells, 0 to 1.

    """
    return np.where(rng.random((size, size)) < share, BLOCKED, FREE).astype(np.int8)


def rooms_world(size: int, rng: np.random.Generator, room: int = 5, closed: float = 0.0,
                ) -> Occupancy:
    """
    Return square rooms behind walls one cell thick, with doors between them.

    Parameters
    ----------
    size : int, [cells]
    rng : numpy.random.Generator
        Places the doors.
    room : int, [cells]
        Inner side of a room.
    closed : float
        Share of the walls between two rooms that have no door, 0 to 1.

    """
    cells = np.full((size, size), FREE, dtype=np.int8)
    pitch = room + 1
    cells[room::pitch, :] = BLOCKED
    cells[:, room::pitch] = BLOCKED
    for wall in range(room, size, pitch):
        for first in range(0, size, pitch):
            n = min(room, size - first)
            for door in ((wall, first + int(rng.integers(n))),
                         (first + int(rng.integers(n)), wall)):
                if closed == 0.0 or rng.random() >= closed:
                    cells[door] = FREE
    return cells


def maze_world(size: int, rng: np.random.Generator, width: int = 2) -> Occupancy:
    """
    Return a maze with one way between any two places: a random depth-first tree.

    Parameters
    ----------
    size : int, [cells]
    rng : numpy.random.Generator
    width : int, [cells]
        Of the corridors; the walls are one cell thick.

    """
    pitch = width + 1
    n = (size + 1) // pitch
    cells = np.full((size, size), BLOCKED, dtype=np.int8)
    stack, visited = [(0, 0)], {(0, 0)}
    _clear(cells, (0, 0), (0, 0), pitch, width)
    while stack:
        row, col = stack[-1]
        ways = [(row + r, col + c) for r, c in ((0, 1), (1, 0), (0, -1), (-1, 0))
                if 0 <= row + r < n and 0 <= col + c < n and (row + r, col + c) not in visited]
        if not ways:
            stack.pop()
            continue
        way = ways[int(rng.integers(len(ways)))]
        _clear(cells, (row, col), way, pitch, width)
        visited.add(way)
        stack.append(way)
    return cells


def _clear(cells: Occupancy, one: tuple[int, int], other: tuple[int, int], pitch: int,
           width: int) -> None:
    """Clear two places of a maze and the wall between them."""
    top, left = min(one[0], other[0]) * pitch, min(one[1], other[1]) * pitch
    bottom, right = max(one[0], other[0]) * pitch, max(one[1], other[1]) * pitch
    cells[top:bottom + width, left:right + width] = FREE


def corridors_world(size: int, rng: np.random.Generator, width: int = 3) -> Occupancy:
    """
    Return long parallel corridors; each wall between two of them has two doors.

    Parameters
    ----------
    size : int, [cells]
    rng : numpy.random.Generator
        Places the doors.
    width : int, [cells]
        Of a corridor.

    """
    cells = np.full((size, size), FREE, dtype=np.int8)
    for wall in range(width, size, width + 1):
        cells[wall, :] = BLOCKED
        cells[wall, rng.choice(size, size=2, replace=False)] = FREE
    return cells


def cylinders_world(n_rows: int, n_cols: int, rng: np.random.Generator, share: float = 0.25,
                    ) -> Occupancy:
    """
    Return a walled lane with open ends; between them clumps, grown by a cellular automaton.

    Like the worlds of BARN (Perille et al., 2020): cells are filled at random, then four times
    over a cell with five filled neighbours or more is filled, one with one or none is cleared.

    Parameters
    ----------
    n_rows, n_cols : int, [cells]
        The clumps stand in the middle third of the rows.
    rng : numpy.random.Generator
    share : float
        Of cells filled at random, 0 to 1.

    """
    third = n_rows // 3
    filled = rng.random((third, n_cols - 2)) < share
    for _ in range(4):
        around = sum(np.pad(filled.astype(int), 1)[row:row + third, col:col + n_cols - 2]
                     for row in range(3) for col in range(3)) - filled
        filled = (around >= 5) | (filled & (around >= 2))
    cells = np.full((n_rows, n_cols), BLOCKED, dtype=np.int8)
    cells[1:-1, 1:-1] = FREE
    cells[third:2 * third, 1:-1][filled] = BLOCKED
    return cells


#: The families by name.
FAMILIES: Final[dict[str, Callable[[int, np.random.Generator], Occupancy]]] = {
    'open': open_world, 'random': random_world, 'rooms': rooms_world, 'maze': maze_world,
    'corridors': corridors_world,
}


def generate(family: str, size: int, seed: int) -> Occupancy:
    """
    Return a world of a family.

    Returns
    -------
    ndarray of int8, shape (size, size)
        0 free, 100 blocked.

    Raises
    ------
    ValueError
        If there is no such family, or the world would be too small for it.

    """
    if family not in FAMILIES:
        raise ValueError(f'there is no family {family}, there are: {", ".join(FAMILIES)}')
    if size < 8:
        raise ValueError(f'a world of {size} x {size} cells is too small, 8 is the least')
    return FAMILIES[family](size, np.random.default_rng([seed, list(FAMILIES).index(family)]))


def dyna_maze() -> Occupancy:
    """
    Return the maze of Sutton and Barto, "Reinforcement Learning", figure 8.2: 6 x 9 cells.

    Start `DYNA_START`, goal `DYNA_GOAL`, four moves; the shortest way has 14 steps.
    """
    picture = ('.......#.',
               '..#....#.',
               '..#....#.',
               '..#......',
               '.....#...',
               '.........')
    rows = [[BLOCKED if mark == '#' else FREE for mark in line] for line in picture]
    return np.array(rows[::-1], dtype=np.int8)


DYNA_START: Final = (3, 0)
DYNA_GOAL: Final = (5, 8)
