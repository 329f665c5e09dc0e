"""One experiment: a world, a teacher, a method, and what it comes to after every trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
import time

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import Demonstration
from experience_evaluation.field_file import field_columns
from experience_evaluation.methods.method import Method, Task
from experience_evaluation.methods.registry import make_method
from experience_evaluation.metrics import judge
from experience_evaluation.teachers import (
    demonstrate, demonstration_from_path, heading_table, longer_path, NoWayError)

Cell = tuple[int, int]
Row = dict[str, float]


@dataclass(frozen=True, eq=False)
class Experiment:
    """
    What is evaluated; with a seed, all there is to know.

    Parameters
    ----------
    grid : Grid
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        The true map: 0 free, anything else blocked.
    goal : tuple of int
        ``(row, col)``
    demo_starts : sequence of tuple of int
        Where demonstrations start, one each, in this order; the first one is the fixed start.
    n_trials : int
    spread : bool
        Trials start where they teach most, else at the first demonstration's start.
    teacher : str
        Of `teachers.TEACHERS`.
    method : str
        Of `registry.METHODS`.
    parameters : Parameters
        The seed in it is replaced by each seed.
    demonstrations : tuple of Demonstration
        Used instead of a teacher if there are any.
    start_radius : float, [m]
        Only cells this near to the first demonstration's start are judged.
    demo_steps : int, optional
        Instead of a teacher, a random way without loops of exactly so many steps.
    judged_after : tuple of int, optional
        Numbers of trials after which it is judged; after every trial if not given.

    """

    grid: Grid
    occupancy: npt.NDArray[np.int8]
    goal: Cell
    demo_starts: Sequence[Cell]
    n_trials: int
    spread: bool = True
    teacher: str = 'shortest'
    method: str = 'ours'
    parameters: Parameters = field(default_factory=Parameters)
    demonstrations: tuple[Demonstration, ...] = ()
    start_radius: float = float('inf')
    demo_steps: int | None = None
    judged_after: tuple[int, ...] | None = None

    def reachable(self) -> npt.NDArray[np.bool_]:
        """Return the free cells from which a way leads to the goal."""
        return np.isfinite(GridWorld(self.occupancy, self.parameters).cost_to(self.goal))

    def judged(self) -> npt.NDArray[np.bool_]:
        """Return the cells that are judged: free, reachable, near enough."""
        rows, cols = np.indices(self.grid.shape)
        first = self.demo_starts[0]
        distance = np.hypot(rows - first[0], cols - first[1]) * self.grid.resolution
        return self.reachable() & (distance <= self.start_radius + 1e-9)


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """
    How an experiment went with one seed.

    Parameters
    ----------
    seed : int
    after : list of dict
        Metrics by name, and ``trials``: after how many trials, growing.
    field : dict
        Columns of the field file after the last trial.

    """

    seed: int
    after: list[Row]
    field: dict[str, npt.NDArray[np.generic]]


def run_seed(experiment: Experiment, seed: int) -> LearningCurve:
    """
    Run an experiment with one seed: teach, then try and judge in turn.

    Raises
    ------
    NoWayError
        If the teacher finds no way.

    """
    _warm_up(experiment.method, experiment.parameters.profile)
    return _run_seed(experiment, seed)


@cache
def _warm_up(method: str, profile: str) -> None:
    """Load what this process needs, once, so that no measured second goes into that."""
    parameters = Parameters(profile=profile)
    grid = Grid(6, 6, 1.0)
    occupancy = np.zeros(grid.shape, dtype=np.int8)
    occupancy[3, 3] = 100
    _run_seed(Experiment(grid, occupancy, (5, 5), [(0, 0)], 1, teacher='blind', method=method,
                         parameters=parameters), 0)


def _run_seed(experiment: Experiment, seed: int) -> LearningCurve:
    parameters = replace(experiment.parameters, seed=seed)
    world = GridWorld(experiment.occupancy, parameters)
    task = Task(world, experiment.grid, experiment.goal, experiment.demo_starts[0],
                experiment.spread, experiment.reachable(), parameters)
    streams = np.random.default_rng(seed).spawn(2)
    method = make_method(experiment.method, task, streams[1])
    demonstrations = _demonstrations(experiment, world, streams[0])
    demonstrated = heading_table(demonstrations, experiment.grid.shape)
    seconds = sum(_seconds(method.teach, demonstration) for demonstration in demonstrations)
    judged = experiment.judged()
    after = [_row(method, task, judged, demonstrated, 0, _Spent(0, 0, 0, seconds))]
    steps = collisions = 0
    for number in range(1, experiment.n_trials + 1):
        practice = method.practise(number)
        is_judged = experiment.judged_after is None or number in experiment.judged_after
        if practice is None:
            if is_judged:
                after.append({**after[-1], 'trials': float(number), 'seconds_learning': 0.0})
            continue
        steps, collisions = steps + practice.steps, collisions + practice.collisions
        spent = _Spent(steps, collisions, practice.reinforcements, practice.seconds)
        if is_judged:
            after.append(_row(method, task, judged, demonstrated, number, spent))
    return LearningCurve(seed, after, field_columns(method, task, demonstrated))


def _seconds(act: Callable[[Demonstration], None], demonstration: Demonstration) -> float:
    began = time.perf_counter()
    act(demonstration)
    return time.perf_counter() - began


def has_demonstration(experiment: Experiment, seed: int) -> bool:
    """Return whether the teacher finds a way with this seed."""
    world = GridWorld(experiment.occupancy, experiment.parameters)
    try:
        _demonstrations(experiment, world, np.random.default_rng(seed).spawn(2)[0])
    except NoWayError:
        return False
    return True


def _demonstrations(experiment: Experiment, world: GridWorld, rng: np.random.Generator,
                    ) -> list[Demonstration]:
    if experiment.demonstrations:
        return list(experiment.demonstrations)
    if experiment.demo_steps is not None:
        return [demonstration_from_path(
            world, longer_path(world, start, experiment.goal, experiment.demo_steps, rng), episode)
            for episode, start in enumerate(experiment.demo_starts, start=1)]
    return [demonstrate(world, experiment.teacher, start, experiment.goal, rng, episode)
            for episode, start in enumerate(experiment.demo_starts, start=1)]


@dataclass(frozen=True)
class _Spent:
    """What the trials so far came to; reinforcements and seconds are those of the last one."""

    steps: int
    collisions: int
    reinforcements: int
    seconds: float


def _row(method: Method, task: Task, judged: npt.NDArray[np.bool_],
         demonstrated: npt.NDArray[np.int8], number: int, spent: _Spent) -> Row:
    row = judge(method, task, judged, demonstrated)
    row['trials'] = float(number)
    row['steps'] = float(spent.steps)
    row['collisions'] += float(spent.collisions)
    row['reinforcements'] = float(spent.reinforcements)
    row['seconds_learning'] = spent.seconds
    return row
