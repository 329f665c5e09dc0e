"""The paper's two tasks and the Dyna maze, as experiments."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.simulation import GridWorld
from experience_cli.evaluation.experiment import Experiment
from experience_cli.evaluation.generators import DYNA_GOAL, dyna_maze, DYNA_START
from experience_cli.evaluation.teachers import demonstration_from_path, longer_path
from sim_node.world import load_world

WORLDS = Path(__file__).resolve().parent.parent / 'config' / 'worlds'
#: Corners of the paper's demonstration, cells.
WAY = ((3, 2), (3, 15), (16, 15))
DYNA_STEPS = 16


def paper_experiment(name: str, parameters: Parameters, n_trials: int) -> Experiment:
    """
    Return one of the paper's tasks: shown in the open workspace, tried from where it was shown.

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
        parameters=parameters, demonstrations=(demonstration_from_path(open_world, path, 1),))


def dyna_experiment(seed: int, spread: bool, n_trials: int = 12) -> Experiment:
    """
    Return the Dyna maze with a demonstration of 16 steps, drawn by a seed; 14 are the least.

    Only its start is judged.
    """
    parameters = Parameters(moves=4)
    occupancy = dyna_maze()
    world = GridWorld(occupancy, parameters)
    path = longer_path(world, DYNA_START, DYNA_GOAL, DYNA_STEPS, np.random.default_rng(seed))
    grid = Grid(occupancy.shape[0], occupancy.shape[1], 1.0)
    experiment = Experiment(grid, occupancy, DYNA_GOAL, [DYNA_START], n_trials, spread,
                            parameters=parameters, start_radius=0.0)
    return replace(experiment, demonstrations=(demonstration_from_path(world, path, 1),))
