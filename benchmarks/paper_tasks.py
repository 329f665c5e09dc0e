"""The paper's two tasks and the Dyna maze, as experiments."""

import math
from pathlib import Path

import numpy as np

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_cli.demo.path_follower import cells_along
from experience_cli.demo.show_and_try import WAY
from experience_evaluation.experiment import Experiment, LearningCurve
from experience_evaluation.teachers import demonstration_from_path
from experience_evaluation.workers import run_all
from experience_evaluation.worlds import DYNA_GOAL, dyna_maze, DYNA_START
from world_maps.world import load_world

WORLDS = Path(__file__).resolve().parent.parent / 'config' / 'worlds'
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
    open_world = GridWorld(np.zeros_like(world.occupancy), parameters)
    return Experiment(
        world.grid, world.occupancy, WAY[-1], [WAY[0]], n_trials, spread=False, teacher='blind',
        parameters=parameters,
        demonstrations=(demonstration_from_path(open_world, cells_along(WAY), 1),),
        start_radius=0.0)


def dyna_curves(n_seeds: int, n_jobs: int, spread: bool = True, n_trials: int = 12,
                **parameters: object) -> list[LearningCurve]:
    """
    Teach the Dyna maze with a demonstration of 16 steps, drawn by each seed, and practise.

    ``experience evaluate --world dyna --set moves=4 --goal 8.5,5.5 --demo-start 0.5,3.5
    --demo-steps 16 --trials 12`` does the same.

    Parameters
    ----------
    n_seeds, n_jobs : int
    spread : bool
        Trials start where they teach most, else at the start.
    n_trials : int
    parameters : object
        Learning parameters, by name.

    """
    occupancy = dyna_maze()
    n_rows, n_cols = occupancy.shape
    experiment = Experiment(
        Grid(n_rows, n_cols, 1.0), occupancy, DYNA_GOAL, [DYNA_START], n_trials, spread,
        parameters=Parameters.from_mapping({'moves': 4, **parameters}), demo_steps=DYNA_STEPS)
    return run_all([(experiment, seed) for seed in range(n_seeds)], n_jobs, 'Dyna maze')


def n_steps_until(curve: LearningCurve, metric: str, value: float) -> float:
    """Return the steps driven in trials until a metric had a value first; inf without that."""
    return next((row['steps'] for row in curve.after if row[metric] == value), math.inf)
