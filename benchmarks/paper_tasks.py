"""The paper's two tasks and the Dyna maze, as experiments."""

import math
from pathlib import Path

import numpy as np

from control_field import compiled
from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.simulation import GridWorld
from experience_cli.evaluation.experiment import Experiment
from experience_cli.evaluation.generators import DYNA_GOAL, dyna_maze, DYNA_START
from experience_cli.evaluation.methods import FieldMethod, Task
from experience_cli.evaluation.teachers import demonstration_from_path, longer_path
from sim_node.world import load_world

WORLDS = Path(__file__).resolve().parent.parent / 'config' / 'worlds'
#: Corners of the paper's demonstration, cells.
WAY = ((3, 2), (3, 15), (16, 15))
#: Steps of the demonstration in the Dyna maze, and the least there are.
DYNA_STEPS, DYNA_LEAST = 16, 14


def paper_experiment(name: str, parameters: Parameters, n_trials: int) -> Experiment:
    """
    Return one of the paper's tasks: shown in the open workspace, tried from where it was shown.

    Only that start is judged.

    Parameters
    ----------
    name : str
        ``task1`` or ``task2``.
    parameters : Parameters
    n_trials : int

    """
    world = load_world(WORLDS / f'{name}.yaml')
    path = [WAY[0]]
    for row, col in WAY[1:]:
        while path[-1] != (row, col):
            last = path[-1]
            path.append((last[0] + int(np.sign(row - last[0])),
                         last[1] + int(np.sign(col - last[1]))))
    open_world = GridWorld(np.zeros_like(world.occupancy), parameters)
    return Experiment(
        world.grid, world.occupancy, WAY[-1], [WAY[0]], n_trials, spread=False, teacher='blind',
        parameters=parameters, demonstrations=(demonstration_from_path(open_world, path, 1),),
        start_radius=0.0)


def dyna_steps(seed: int, n_trials: int = 12) -> tuple[float, float]:
    """
    Teach the Dyna maze with a demonstration of 16 steps, drawn by the seed, and practise.

    Returns
    -------
    q_matrix, field : float
        Steps driven in trials until the greedy path from the start has 14 steps, by the greatest
        Q-value and by the field; inf if it did not come to that.

    """
    parameters = Parameters(moves=4, seed=seed)
    occupancy = dyna_maze()
    world = GridWorld(occupancy, parameters)
    grid = Grid(occupancy.shape[0], occupancy.shape[1], 1.0)
    rng = np.random.default_rng(seed)
    task = Task(world, grid, DYNA_GOAL, DYNA_START, True, np.isfinite(world.cost_to(DYNA_GOAL)),
                parameters)
    method = FieldMethod(task, rng)
    path = longer_path(world, DYNA_START, DYNA_GOAL, DYNA_STEPS, rng)
    method.teach(demonstration_from_path(world, path, 1))
    n_steps, found = 0, [math.inf, math.inf]
    for number in range(1, n_trials + 1):
        greedy = method.refresh.field.q.argmax(axis=2).astype(np.int8)
        for index, headings in enumerate((greedy, method.headings())):
            if compiled.flow_reaches(world.truth, headings, *DYNA_START, *DYNA_GOAL,
                                     world.rules) == DYNA_LEAST:
                found[index] = min(found[index], n_steps)
        practice = method.practise(number)
        n_steps += practice.steps if practice else 0
    return found[0], found[1]
