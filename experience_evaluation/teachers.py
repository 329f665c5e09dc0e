"""Scripted teachers: what a person might demonstrate."""

from collections.abc import Callable, Iterator
from itertools import chain, pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import heading_from_step, STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import compiled
from control_field.learning.grid_world import GridWorld
from control_field.records import Demonstration

Cell = tuple[int, int]
Path = list[Cell]

#: How surely a teacher goes straight on while that is no detour.
_STEADINESS: Final = 0.95
#: How long a detour is, beside the shortest path.
_DETOUR: Final = (1.3, 2.0)
_N_WAYPOINTS: Final = 300
_N_PAIRS: Final = 100
_N_ATTEMPTS: Final = 2000


class NoWayError(ValueError):
    """There is no such path from the cell ``start``; the message is one sentence."""

    def __init__(self, problem: str, start: Cell | None = None) -> None:
        """Say what there is none of."""
        super().__init__(problem, start)
        self.start = start

    def __str__(self) -> str:
        """Return the sentence."""
        return str(self.args[0])


def shortest_path(world: GridWorld, start: Cell, goal: Cell, rng: np.random.Generator) -> Path:
    """
    Return one of the shortest paths, drawn so that it has few turns.

    Parameters
    ----------
    world : GridWorld
        Its map and rules of a step hold.
    start, goal : tuple of int
        ``(row, col)``
    rng : numpy.random.Generator
        Chooses among paths of the same length.

    Raises
    ------
    NoWayError
        If there is none.

    """
    cost = world.cost_to(goal)
    if not np.isfinite(cost[start]):
        raise NoWayError('no way leads to the goal', start)
    path, heading = [start], -1
    while path[-1] != goal:
        best = _best_headings(world, cost, path[-1])
        if heading not in best or rng.random() > _STEADINESS:
            heading = best[int(rng.integers(len(best)))]
        row, col = path[-1]
        path.append((row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])))
    return path


def _best_headings(world: GridWorld, cost: npt.NDArray[np.float64], cell: Cell) -> list[int]:
    """Return the headings of the first steps of all shortest paths."""
    row, col = cell
    return [heading for heading in range(8)
            if compiled.step_allowed(world.truth, row, col, heading, world.rules)
            and STEP_LENGTH[heading] + cost[row + STEP_ROW[heading], col + STEP_COL[heading]]
            < cost[cell] + 1e-9]


def path_length(path: Path) -> float:
    """Return the length of a path, [cells]."""
    steps = np.diff(np.array(path, dtype=np.float64), axis=0)
    return float(np.hypot(*steps.T).sum()) if len(path) > 1 else 0.0


def detour_path(world: GridWorld, start: Cell, goal: Cell, rng: np.random.Generator) -> Path:
    """
    Return a path without loops that is 1.3 to 2 times as long as the shortest one.

    It leads over a waypoint, or two where one will not do: there on shortest paths, and on
    without touching those again.

    Raises
    ------
    NoWayError
        If none was found.

    """
    to_goal, to_start = world.cost_to(goal), world.cost_to(start)
    if not np.isfinite(to_goal[start]):
        raise NoWayError('no way leads to the goal', start)
    through = (to_goal + to_start) / max(to_goal[start], 1.0)
    waypoints = np.argwhere((through >= 1.05) & (through <= _DETOUR[1]))
    tries: list[list[Cell]] = [[_cell(waypoints[index])]
                               for index in rng.permutation(len(waypoints))[:_N_WAYPOINTS]]
    places = np.argwhere(np.isfinite(to_start))
    for stops in chain(tries, _pairs(places, rng)):
        path = _path_over(world, [start, *stops, goal], rng)
        if path and _DETOUR[0] <= path_length(path) / to_goal[start] <= _DETOUR[1]:
            return path
    raise NoWayError(f'no way of {_DETOUR[0]:g} to {_DETOUR[1]:g} times the shortest length that '
                     f'does not cross itself was found', start)


def _pairs(places: npt.NDArray[np.int64], rng: np.random.Generator) -> Iterator[list[Cell]]:
    """Return two waypoints at a time; drawn only when they are asked for."""
    for _ in range(_N_PAIRS):
        yield [_cell(places[index]) for index in rng.integers(len(places), size=2)]


def _cell(place: npt.NDArray[np.int64]) -> Cell:
    return int(place[0]), int(place[1])


def _path_over(world: GridWorld, stops: Path, rng: np.random.Generator) -> Path | None:
    """Return a path from stop to stop that touches no cell twice; None if there is none such."""
    rest, path = world.truth.copy(), stops[:1]
    for stop, following in pairwise(stops):
        try:
            segment = shortest_path(GridWorld(rest, world.parameters), stop, following, rng)
        except NoWayError:
            return None
        if following != stops[-1] and stops[-1] in segment:
            return None
        path += segment[1:]
        for cell in segment[:-1]:
            rest[cell] = 100
    return path


def longer_path(world: GridWorld, start: Cell, goal: Cell, n_steps: int,
                rng: np.random.Generator) -> Path:
    """
    Return a random path without loops of exactly so many steps.

    Raises
    ------
    NoWayError
        If there is none, or none was found.

    """
    cost = world.cost_to(goal)
    for _ in range(_N_ATTEMPTS):
        path = [start]
        while path[-1] != goal and len(path) <= n_steps:
            ways = [cell for cell in _neighbours(world, path[-1])
                    if cell not in path and cost[cell] <= n_steps - len(path)]
            if not ways:
                break
            path.append(ways[int(rng.integers(len(ways)))])
        if path[-1] == goal and len(path) == n_steps + 1:
            return path
    raise NoWayError(f'no way of {n_steps} steps to the goal was found', start)


def _neighbours(world: GridWorld, cell: Cell) -> list[Cell]:
    """Return the cells that one step leads to."""
    row, col = cell
    return [(row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])) for heading in range(8)
            if compiled.step_allowed(world.truth, row, col, heading, world.rules)]


def demonstration_from_path(world: GridWorld, path: Path, episode: int) -> Demonstration:
    """
    Return the demonstration of a path, with the local grid that a robot has under way.

    Raises
    ------
    ValueError
        If the path has fewer than two cells.

    """
    if len(path) < 2:
        raise ValueError('a demonstration needs at least two cells')
    cells = np.array(path, dtype=np.int32)
    blocked = np.array([world.local_grid(row, col) for row, col in path], dtype=np.uint8)
    stamps = np.arange(len(path), dtype=np.float64)
    return Demonstration(cells, stamps, blocked, np.zeros(len(path), dtype=np.uint8), episode,
                         world.local_grids(cells, stamps))


def _shortest(world: GridWorld, start: Cell, goal: Cell, rng: np.random.Generator,
              ) -> tuple[GridWorld, Path]:
    return world, shortest_path(world, start, goal, rng)


def _blind(world: GridWorld, start: Cell, goal: Cell, rng: np.random.Generator,
           ) -> tuple[GridWorld, Path]:
    empty = GridWorld(np.zeros_like(world.truth), world.parameters)
    return empty, shortest_path(empty, start, goal, rng)


def _detour(world: GridWorld, start: Cell, goal: Cell, rng: np.random.Generator,
            ) -> tuple[GridWorld, Path]:
    return world, detour_path(world, start, goal, rng)


#: What each teacher drives in, and along which path.
TEACHERS: Final[dict[str, Callable[[GridWorld, Cell, Cell, np.random.Generator],
                                   tuple[GridWorld, Path]]]] = {
    'shortest': _shortest, 'blind': _blind, 'detour': _detour,
}


def demonstrate(world: GridWorld, teacher: str, start: Cell, goal: Cell,
                rng: np.random.Generator, episode: int) -> Demonstration:
    """
    Let a teacher demonstrate.

    The local grid that comes with it is that of the world the teacher drives in: the true one, or
    for ``blind`` the open workspace, where cells are seen free that later are not.

    Raises
    ------
    NoWayError
        If the teacher finds no way.
    ValueError
        If start and goal are the same cell.

    """
    driven, path = TEACHERS[teacher](world, start, goal, rng)
    return demonstration_from_path(driven, path, episode)


def heading_table(demonstrations: list[Demonstration], shape: tuple[int, int],
                  ) -> npt.NDArray[np.int8]:
    """Return the demonstrated heading of every cell, the last demonstration wins; -1 for none."""
    demonstrated = np.full(shape, -1, dtype=np.int8)
    for demonstration in demonstrations:
        cells = demonstration.cells.tolist()
        for (row, col), (next_row, next_col) in pairwise(cells):
            demonstrated[row, col] = heading_from_step(next_row - row, next_col - col)
    return demonstrated
