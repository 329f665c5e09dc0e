"""Worlds that change, made by ourselves: gaps that close and open, doors, moved furniture."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.local_grid import BLOCKED, FREE
from control_field.parameters import Parameters
from experience_evaluation.worlds import Occupancy, rooms_world
from world_maps.mover import Mover, Waypoint

Cell = tuple[int, int]
#: Side of the workspace with a wall across it, and the row of the wall, [cells].
WALLED_SIZE: Final = 20
WALL_ROW: Final = 10
#: Columns of the gaps: what a maze has at first, and afterwards. Where the shortcut opens, start
#: and goal are at that side, and the way through the old gap is twice as long.
BLOCKING: Final = ((17,), (2,))
SHORTCUT: Final = ((2,), (2, 17))
_N_ATTEMPTS: Final = 1000


def walled_world(*gaps: int, n_rows: int = WALLED_SIZE, n_cols: int = WALLED_SIZE,
                 row: int = WALL_ROW) -> Occupancy:
    """Return a workspace with a wall across it that is open at some columns."""
    cells = np.full((n_rows, n_cols), FREE, dtype=np.int8)
    cells[row] = BLOCKED
    cells[row, list(gaps)] = FREE
    return cells


def with_block(occupancy: Occupancy, cell: Cell, reach: int) -> Occupancy:
    """Return a world with a square block around a cell: so many cells to every side of it."""
    cells, (row, col) = occupancy.copy(), cell
    cells[max(0, row - reach):row + reach + 1, max(0, col - reach):col + reach + 1] = BLOCKED
    return cells


def moved_obstacles(occupancy: Occupancy, share: float, rng: np.random.Generator,
                    goal: Cell, start: Cell) -> Occupancy:
    """
    Move some of the blocked cells to where it was free, as furniture is moved.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, anything else blocked.
    share : float
        Of the blocked cells that move, 0 to 1.
    rng : numpy.random.Generator
    goal, start : tuple of int
        Stay free, with a way between them, ``(row, col)``.

    Raises
    ------
    ValueError
        If that cannot be done.

    """
    blocked = np.argwhere(occupancy != FREE)
    free = np.argwhere(occupancy == FREE)
    free = free[(free != goal).any(axis=1) & (free != start).any(axis=1)]
    n = round(share * len(blocked))
    for _ in range(_N_ATTEMPTS):
        cells = occupancy.copy()
        cells[tuple(rng.permutation(blocked)[:n].T)] = FREE
        cells[tuple(rng.permutation(free)[:n].T)] = BLOCKED
        if np.isfinite(GridWorld(cells, Parameters()).cost_to(goal)[start]):
            return cells
    raise ValueError(f'{share:.0%} of the obstacles cannot be moved so that a way is left')


def doors_world(size: int, rng: np.random.Generator, n: int, share: float = 0.3,
                ) -> Iterator[Occupancy]:
    """
    Yield rooms n + 1 times over: first with all doors open, then each time with others shut.

    Parameters
    ----------
    size : int, [cells]
    rng : numpy.random.Generator
        Places the doors, and draws which are shut.
    n : int
    share : float
        Of the doors that are shut, 0 to 1.

    """
    room = 5
    cells = rooms_world(size, rng, room)
    yield cells
    walls = np.zeros(cells.shape, dtype=np.bool_)
    walls[room::room + 1] = True
    walls[:, room::room + 1] = True
    doors = np.argwhere(walls & (cells == FREE))
    for _ in range(n):
        shut = cells.copy()
        shut[tuple(doors[rng.random(len(doors)) < share].T)] = BLOCKED
        yield shut


def persons_crossing(grid: Grid, n: int, rng: np.random.Generator) -> tuple[Mover, ...]:
    """
    Return persons who walk to and fro across a workspace, every other one along x.

    Parameters
    ----------
    grid : Grid
    n : int
    rng : numpy.random.Generator
        Draws where they cross, how fast they are (0.05 to 0.15 m/s), and how long they stand at
        either end (0 to 5 s).

    """
    x, y = grid.origin_x, grid.origin_y
    width, height = grid.n_cols * grid.resolution, grid.n_rows * grid.resolution
    persons = []
    for number in range(n):
        here, there = rng.uniform(0.1, 0.9, 2)
        ends = ((x, y + here * height), (x + width, y + there * height)) if number % 2 else (
            (x + here * width, y), (x + there * width, y + height))
        persons.append(Mover(
            0.15, float(rng.uniform(0.05, 0.15)), tuple(
                Waypoint(float(px), float(py), float(rng.uniform(0.0, 5.0))) for px, py in ends),
            'back_and_forth', name=f'person {number + 1}'))
    return tuple(persons)
