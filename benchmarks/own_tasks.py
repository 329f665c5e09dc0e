"""Worlds of the families that maps from elsewhere belong to, another one for every seed."""

from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation.experiment import Experiment
from experience_evaluation.starts import choose_places
from experience_evaluation.worlds import (
    cylinders_world, maze_world, Occupancy, open_world, random_world, rooms_world)

Tasks = list[tuple[Experiment, int]]
#: By name: side of the world in cells, and what makes it. Rooms and mazes are those of the
#: MovingAI maps: 3 cells behind walls of which a fifth has no door, corridors of 4 and 2 cells.
OWN: Final[dict[str, tuple[int, Callable[[int, np.random.Generator], Occupancy]]]] = {
    'empty, 32 x 32': (32, open_world),
    'random, 10 %, 32 x 32': (32, partial(random_world, share=0.1)),
    'random, 20 %, 32 x 32': (32, partial(random_world, share=0.2)),
    'rooms of 3, 32 x 32': (32, partial(rooms_world, room=3, closed=0.2)),
    'maze of width 4, 32 x 32': (32, partial(maze_world, width=4)),
    'maze of width 2, 32 x 32': (32, partial(maze_world, width=2)),
    'random, 10 %, 64 x 64': (64, partial(random_world, share=0.1)),
}
#: Shape and resolution of the BARN worlds, and the shares of cells that they start from.
_BARN_SHAPE: Final = (95, 31)
_BARN_RESOLUTION: Final = 0.15
_BARN_SHARES: Final = (0.15, 0.20, 0.25, 0.30, 0.35)
_BARN_START, _BARN_GOAL = (21, 16), (88, 16)


def own_tasks(name: str, n_seeds: int) -> Tasks:
    """Return an experiment a seed; world, goal and start are drawn by the seed."""
    size, make = OWN[name]
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng([seed, list(OWN).index(name)])
        occupancy = make(size, rng)
        goal, start = choose_places(occupancy, rng)
        judged = tuple(range(0, 31, 10)) if size > 32 else None
        tasks.append((Experiment(Grid(size, size, 1.0), occupancy, goal, [start], 0,
                                 judged_after=judged), seed))
    return tasks


def own_barn_tasks(n_seeds: int) -> Tasks:
    """Return an experiment a seed on a lane with clumps, from one end to the other."""
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng(seed)
        share = _BARN_SHARES[seed % len(_BARN_SHARES)]
        occupancy = cylinders_world(*_BARN_SHAPE, rng, share)
        while not np.isfinite(GridWorld(occupancy, Parameters()).cost_to(_BARN_GOAL)[_BARN_START]):
            occupancy = cylinders_world(*_BARN_SHAPE, rng, share)
        grid = Grid(*_BARN_SHAPE, _BARN_RESOLUTION)
        tasks.append((Experiment(grid, occupancy, _BARN_GOAL, [_BARN_START], 0), seed))
    return tasks
