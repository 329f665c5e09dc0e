"""One experiment: a world, a teacher, a method, and what it comes to after every trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
import time
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.moving_world import MovingWorld
from control_field.local_grid import BLOCKED, FREE
from control_field.parameters import Parameters
from control_field.records import Demonstration
from control_field.words import counted
from experience_evaluation.environment import Environment
from experience_evaluation.field_file import field_columns
from experience_evaluation.methods.method import Method, Practice, Task
from experience_evaluation.methods.registry import make_method
from experience_evaluation.metrics import judge
from experience_evaluation.progress import tell
from experience_evaluation.teachers import (
    demonstrate, demonstration_from_path, heading_table, longer_path, NoWayError)
from world_maps.cells_in_motion import moving_in_cells, pace_in_cells
from world_maps.movers_file import Script
from world_maps.world import World

Cell = tuple[int, int]
Row = dict[str, float]
#: Is told what is under way, and how much of all is done.
Watch: TypeAlias = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Change:
    """
    A world that becomes another one between two trials.

    Parameters
    ----------
    after : int
        Number of trials that are run before.
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        What is true from the next trial on: 0 free, anything else blocked.
    world : str
        Its name, for reports.

    """

    after: int
    occupancy: npt.NDArray[np.int8]
    world: str = ''


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
    changes : tuple of Change
        What becomes of the world, in the order of the trials.
    sight : int, [cells]
        Side of the local grid of robot and teacher.
    script : Script
        What moves in the world, and what changes in each trial after so many seconds; trials of
        the control field only meet it.

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
    changes: tuple[Change, ...] = ()
    sight: int = 3
    script: Script = field(default_factory=Script)

    def environments(self) -> list[Environment]:
        """
        Return what is true at first, and after each change.

        Raises
        ------
        ValueError
            If there is no room for what moves; the message says for which.

        """
        first, *worlds = [self._grid_world(occupancy) for occupancy in (
            self.occupancy, *(change.occupancy for change in self.changes))]
        at_first = Environment(first, self.goal)
        return [at_first, *(
            Environment(world, self.goal, at_first.reachable) for world in worlds)]

    def _grid_world(self, occupancy: npt.NDArray[np.int8]) -> GridWorld:
        if not (self.script.movers or self.script.changes):
            return GridWorld(occupancy, self.parameters, self.sight)
        world = World(self.grid, np.where(occupancy == FREE, FREE, BLOCKED).astype(np.int8))
        moving = moving_in_cells(
            world, self.script.movers, self.script.changes, self.parameters.seed)
        return MovingWorld(occupancy, self.parameters, moving, pace_in_cells(world), self.sight)

    def n_changes(self, number: int) -> int:
        """Return how often the world has changed before a trial, counted from 1."""
        return sum(change.after < number for change in self.changes)

    def reachable(self) -> npt.NDArray[np.bool_]:
        """Return the free cells from which a way leads to the goal at first."""
        return self.environments()[0].reachable

    def judged(self, environment: Environment | None = None) -> npt.NDArray[np.bool_]:
        """Return the cells that are judged: free, reachable now (or at first), near enough."""
        rows, cols = np.indices(self.grid.shape)
        first = self.demo_starts[0]
        distance = np.hypot(rows - first[0], cols - first[1]) * self.grid.resolution
        reachable = self.reachable() if environment is None else environment.reachable
        return reachable & (distance <= self.start_radius + 1e-9)


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
    at_changes : tuple of dict
        The same metrics in the world that a change has made, before the first trial there: one
        for each change, ``trials`` is how many there were.

    """

    seed: int
    after: list[Row]
    field: dict[str, npt.NDArray[np.generic]]
    at_changes: tuple[Row, ...] = ()


def _nobody(what: str, share: float) -> None:
    """Tell nobody how far it is."""


def run_seed(experiment: Experiment, seed: int, watch: Watch = tell) -> LearningCurve:
    """
    Run an experiment with one seed: teach, then try and judge in turn.

    Parameters
    ----------
    experiment : Experiment
    seed : int
    watch : callable
        Is told what is under way, and how much of all is done, 0 to 1.

    Raises
    ------
    NoWayError
        If the teacher finds no way.

    """
    watch(f'seed {seed}, loading', 0.0)
    warm_up(experiment.method, experiment.parameters.profile)
    return _run_seed(
        experiment, seed, lambda what, share: watch(f'seed {seed}, {what}', share))


@cache
def warm_up(method: str, profile: str) -> None:
    """Load what this process needs, once, so that no measured second goes into that."""
    parameters = Parameters(profile=profile)
    grid = Grid(6, 6, 1.0)
    occupancy = np.zeros(grid.shape, dtype=np.int8)
    occupancy[3, 3] = 100
    _run_seed(Experiment(grid, occupancy, (5, 5), [(0, 0)], 1, teacher='blind', method=method,
                         parameters=parameters), 0, _nobody)


def _run_seed(experiment: Experiment, seed: int, watch: Watch) -> LearningCurve:
    experiment = replace(experiment, parameters=replace(experiment.parameters, seed=seed))
    environments = experiment.environments()
    task = Task(experiment.grid, experiment.goal, experiment.demo_starts[0], experiment.spread,
                experiment.parameters)
    streams = np.random.default_rng(seed).spawn(2)
    method = make_method(experiment.method, task, streams[1])
    watch('teaching', 0.0)
    demonstrations = _demonstrations(experiment, environments[0].world, streams[0])
    seconds = sum(_seconds(method.teach, demonstration) for demonstration in demonstrations)
    judged = _Judge(experiment, method, task, heading_table(demonstrations, experiment.grid.shape),
                    watch)
    spent = _Spent(0, 0, 0, seconds)
    environment = environments[0]
    after, at_changes = [judged.row(environment, 0, spent)], list[Row]()
    for number in range(1, experiment.n_trials + 1):
        environment = environments[experiment.n_changes(number)]
        if environment is not environments[len(at_changes)]:
            at_changes.append(judged.row(environment, number - 1, spent.without_seconds()))
        before = environment.n_mover_contacts
        watch(f'trial {number} of {experiment.n_trials}', judged.share_done(number))
        practice = method.practise(environment, number)
        spent = spent.without_seconds() if practice is None else spent.then(
            practice, environment.n_mover_contacts - before)
        if experiment.judged_after is None or number in experiment.judged_after:
            after.append(judged.row(environment, number, spent) if practice or at_changes else
                         {**after[-1], 'trials': float(number), 'seconds_learning': 0.0})
    columns = field_columns(method, task, environment, judged.demonstrated)
    return LearningCurve(seed, after, columns, tuple(at_changes))


def _seconds(act: Callable[[Demonstration], None], demonstration: Demonstration) -> float:
    began = time.perf_counter()
    act(demonstration)
    return time.perf_counter() - began


def has_demonstration(experiment: Experiment, seed: int) -> bool:
    """Return whether the teacher finds a way with this seed."""
    world = experiment.environments()[0].world
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
    mover_contacts: int = 0

    def then(self, practice: Practice, mover_contacts: int) -> '_Spent':
        """Return what it comes to after one more trial."""
        return _Spent(self.steps + practice.steps, self.collisions + practice.collisions,
                      practice.reinforcements, practice.seconds,
                      self.mover_contacts + mover_contacts)

    def without_seconds(self) -> '_Spent':
        """Return the same where nothing was learnt since."""
        return replace(self, seconds=0.0)


@dataclass(frozen=True, eq=False)
class _Judge:
    """Judges a method of an experiment as it stands, in the world that is true then."""

    experiment: Experiment
    method: Method
    task: Task
    demonstrated: npt.NDArray[np.int8]
    watch: Watch

    def share_done(self, number: int, share: float = 0.0) -> float:
        """Return how much is done before a trial, or in its judgement: these take the time."""
        n_trials = self.experiment.n_trials
        judged = self.experiment.judged_after
        numbers = [n for n in range(n_trials + 1) if judged is None or n in judged]
        return (sum(n < number for n in numbers) + share) / max(len(numbers), 1)

    def row(self, environment: Environment, number: int, spent: _Spent) -> Row:
        """Return the metrics after so many trials."""
        starts = self.experiment.judged(environment)
        n_starts = int(starts.sum())

        def watch(n: int) -> None:
            self.watch(f'judging {n} of {n_starts} starts after {counted(number, "trial")}',
                       self.share_done(number, n / max(n_starts, 1)))
        watch(0)
        row = judge(self.method, self.task, environment, starts, self.demonstrated, watch)
        row['trials'] = float(number)
        row['steps'] = float(spent.steps)
        row['collisions'] += float(spent.collisions)
        row['mover_contacts'] += float(spent.mover_contacts)
        row['reinforcements'] = float(spent.reinforcements)
        row['seconds_learning'] = spent.seconds
        return row
