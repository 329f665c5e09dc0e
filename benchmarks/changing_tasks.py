"""Tasks in worlds that change, another world for every seed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from benchmarks.own_tasks import Tasks
from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation.changing_worlds import (
    BLOCKING, doors_world, moved_obstacles, persons_crossing, SHORTCUT, WALL_ROW, WALLED_SIZE,
    walled_world, with_block)
from experience_evaluation.experiment import Change, Experiment
from experience_evaluation.starts import choose_places
from experience_evaluation.teachers import demonstration_from_path, detour_path
from experience_evaluation.worlds import Occupancy, random_world, rooms_world
from world_maps.movers_file import Script

#: Trials before the first change, which show (nearly) all there is, and after the last one.
N_BEFORE: Final = 10
N_AFTER: Final = 10
#: How long a way stays shut that opens again, [trials].
N_SHUT: Final = 3
#: How far what stands on the shown way reaches to every side, [cells].
BLOCK_REACH: Final = 1
#: Trials among persons.
N_PERSON_TRIALS: Final = 20
#: Doors are shut and opened so often, and after so many trials each time.
N_TURNS: Final = 4
N_EACH: Final = 5
#: Kinds of worlds that nothing was tuned on, 32 x 32 cells, for those who see far.
HELD_OUT: Final[dict[str, Callable[[int, np.random.Generator], Occupancy]]] = {
    'random, 20 %': partial(random_world, share=0.2), 'rooms of 8': partial(rooms_world, room=8)}


def walled_tasks(n_seeds: int, first: Sequence[int], *changes: tuple[int, Sequence[int]],
                 least_col: int = 0, margin: int = 2, **options: object) -> Tasks:
    """
    Return an experiment a seed on a square with a wall across it.

    Parameters
    ----------
    n_seeds : int
    first : sequence of int
        Columns of the gaps at first.
    *changes : tuple of (int, sequence of int)
        Numbers of trials, and the gaps after them.
    least_col : int
        Start and goal are drawn from this column on, on either side of the wall.
    margin : int, [cells]
        How far from the wall they are at least.
    options : object
        More of the experiment.

    """
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng(seed)
        start = int(rng.integers(WALL_ROW - margin)), int(rng.integers(least_col, WALLED_SIZE))
        goal = (int(rng.integers(WALL_ROW + margin, WALLED_SIZE)),
                int(rng.integers(least_col, WALLED_SIZE)))
        experiment = Experiment(
            Grid(WALLED_SIZE, WALLED_SIZE, 1.0), walled_world(*first), goal, [start],
            (changes[-1][0] if changes else 0) + N_AFTER,
            changes=tuple(Change(after, walled_world(*gaps)) for after, gaps in changes))
        tasks.append((replace(experiment, **options), seed))  # type: ignore[arg-type]
    return tasks


def obstacle_tasks(n_seeds: int, spread: bool) -> Tasks:
    """
    Return an experiment a seed in which something stands on the shown way for some trials.

    It is so large that nobody who goes round it sees its middle.
    """
    tasks = []
    for experiment, seed in walled_tasks(n_seeds, range(WALLED_SIZE), margin=5, spread=spread):
        world = GridWorld(experiment.occupancy, experiment.parameters)
        path = detour_path(world, experiment.demo_starts[0], experiment.goal,
                             np.random.default_rng(seed))
        blocked = with_block(experiment.occupancy, path[len(path) // 2], BLOCK_REACH)
        tasks.append((replace(
            experiment, demonstrations=(demonstration_from_path(world, path, 1),),
            n_trials=N_BEFORE + N_SHUT + N_AFTER,
            changes=(Change(N_BEFORE, blocked),
                     Change(N_BEFORE + N_SHUT, experiment.occupancy))), seed))
    return tasks


def moved_tasks(tasks: Tasks) -> Tasks:
    """Return the tasks with a tenth of the obstacles moved after some trials."""
    def moved(experiment: Experiment, seed: int) -> Occupancy:
        return moved_obstacles(experiment.occupancy, 0.1, np.random.default_rng([seed, 1]),
                               experiment.goal, experiment.demo_starts[0])

    return [(replace(experiment, n_trials=N_BEFORE + N_AFTER,
                     changes=(Change(N_BEFORE, moved(experiment, seed)),)), seed)
            for experiment, seed in tasks]


def doors_tasks(n_seeds: int) -> Tasks:
    """Return an experiment a seed in rooms whose doors shut and open: others every few trials."""
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng(seed)
        first, *later = doors_world(23, rng, N_TURNS)
        goal, start = choose_places(first, rng)
        for shut in later:
            shut[goal] = shut[start] = 0
        changes = tuple(Change((turn + 1) * N_EACH, shut) for turn, shut in enumerate(later))
        tasks.append((Experiment(Grid(23, 23, 1.0), first, goal, [start],
                                 (N_TURNS + 1) * N_EACH, changes=changes), seed))
    return tasks


def held_out_tasks(name: str, sight: int, n_seeds: int) -> Tasks:
    """Return an experiment a seed in a world of a kind that nothing was tuned on."""
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng([seed, 77])
        occupancy = HELD_OUT[name](32, rng)
        goal, start = choose_places(occupancy, rng)
        tasks.append((Experiment(Grid(32, 32, 1.0), occupancy, goal, [start], 3, sight=sight,
                                 judged_after=(0, 3)), seed))
    return tasks


def persons_tasks(n_seeds: int) -> Tasks:
    """Return an experiment a seed with five persons who cross; only the start is judged."""
    tasks = []
    for experiment, seed in walled_tasks(n_seeds, range(7, 13), spread=False, start_radius=0.0):
        grid = Grid(WALLED_SIZE, WALLED_SIZE, 0.25)
        persons = persons_crossing(grid, 5, np.random.default_rng([seed, 5]))
        tasks.append((replace(experiment, grid=grid, n_trials=N_PERSON_TRIALS,
                              script=Script(persons)), seed))
    return tasks


def blocking_tasks(n_seeds: int) -> Tasks:
    """Return the blocking maze: the gap shuts, and another opens that was a wall."""
    return walled_tasks(n_seeds, BLOCKING[0], (N_BEFORE, BLOCKING[1]))


def shortcut_tasks(n_seeds: int, spread: bool = True, prefer_shorter: bool = False) -> Tasks:
    """Return the shortcut maze: a gap opens where start and goal are."""
    return walled_tasks(
        n_seeds, SHORTCUT[0], (N_BEFORE, SHORTCUT[1]), least_col=13, spread=spread,
        parameters=Parameters(prefer_shorter=prefer_shorter))


def sealed_tasks(n_seeds: int, spread: bool = True) -> Tasks:
    """Return a wall that is shut altogether for some trials, and opens again."""
    return walled_tasks(n_seeds, BLOCKING[0], (N_BEFORE, ()), (N_BEFORE + N_SHUT, BLOCKING[0]),
                        spread=spread)
