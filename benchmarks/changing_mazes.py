"""
The blocking maze and the shortcut maze of Sutton and Barto (2018, section 8.3), without a teacher.

Four moves, +1 at the goal, from where the robot starts again; a maze changes while steps are
counted, wherever the robot is. What a run is worth is how often it has reached the goal.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels import compiled
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import explores, Learner
from control_field.parameters import Parameters
from control_field.records import Demonstration, Outcome, Trial
from control_field.robot.policy import TrialPolicy
from experience_evaluation.changing_worlds import walled_world
from experience_evaluation.environment import Environment
from experience_evaluation.methods import tabular_kernels as kernels
from experience_evaluation.worlds import Occupancy

Cell = tuple[int, int]
START: Final[Cell] = (0, 3)
GOAL: Final[Cell] = (5, 8)


@dataclass(frozen=True)
class Maze:
    """
    A maze that changes.

    Parameters
    ----------
    gaps : tuple of tuple of int
        Columns at which its wall is open, before and after the change.
    n_steps : tuple of int
        So many steps before the change, and after it.
    must : float
        What was asked for.

    """

    gaps: tuple[tuple[int, ...], tuple[int, ...]]
    n_steps: tuple[int, int]
    must: float

    def worlds(self) -> list[Occupancy]:
        """Return what is true before and after the change."""
        return [walled_world(*gaps, n_rows=6, n_cols=9, row=2) for gaps in self.gaps]

    def environments(self, parameters: Parameters) -> list[Environment]:
        """Return the same, to be tried."""
        return [Environment(GridWorld(world, parameters), GOAL) for world in self.worlds()]


MAZES: Final = {'blocking maze': Maze(((8,), (0,)), (1000, 2000), 200.0),
                'shortcut maze': Maze(((0,), (0, 8)), (3000, 3000), 430.0)}
#: Of Dyna-Q and Dyna-Q+: the best constants found on a grid of 24.
_ALPHA, _DISCOUNT, _EPSILON, _N_PLANNING, _KAPPA = 1.0, 0.95, 0.1, 50, 1e-3
#: Counts how often the goal was reached by each step, shape (n_steps,).
Arrived = npt.NDArray[np.int64]


def dyna(kind: int, maze: Maze, seed: int) -> Arrived:
    """Run Dyna-Q or Dyna-Q+ as the book does: a blocked step earns nothing."""
    parameters, rng = Parameters(moves=4), np.random.default_rng(seed)
    first, *_ = environments = maze.environments(parameters)
    n_cols = first.world.truth.shape[1]
    start, goal = (row * n_cols + col for row, col in (START, GOAL))
    settings = kernels.Settings(kind, n_cols, goal, 0b01010101, _ALPHA, _DISCOUNT, _EPSILON,
                                _N_PLANNING, 0.0, _KAPPA)
    tables = kernels.new_tables(first.world.truth.size)
    place, parts = start, [np.zeros(1, dtype=np.int64)]
    for environment, n_steps in zip(environments, maze.n_steps, strict=True):
        place, arrived = kernels.run_steps(
            environment.allowed, tables, start, settings, rng, n_steps, place)
        parts.append(parts[-1][-1] + arrived)
    return np.concatenate(parts[1:])


def oracle(maze: Maze, seed: int) -> Arrived:
    """Return what who knows everything comes to: the shortest way, again and again."""
    del seed
    lengths = [environment.shortest[START] for environment in maze.environments(
        Parameters(moves=4))]
    return np.floor(np.cumsum(np.repeat(1.0 / np.array(lengths), maze.n_steps)) + 1e-9).astype(
        np.int64)


@dataclass(eq=False)
class OwnRun:
    """
    Our robot in a maze: it explores until it finds the goal, learns from that, and goes on trying.

    It knows nothing but what its 3x3 local grid shows, and when it has reached the goal.

    Parameters
    ----------
    maze : Maze
    parameters : Parameters
    rng : numpy.random.Generator

    """

    maze: Maze
    parameters: Parameters
    rng: np.random.Generator
    cell: Cell = START
    n_arrived: list[int] = field(default_factory=list)

    def run(self) -> Arrived:
        """Run until the steps are used up."""
        self._worlds = [environment.world for environment in self.maze.environments(
            self.parameters)]
        n_rows, n_cols = self._worlds[0].truth.shape
        learner = Learner(Grid(n_rows, n_cols, 1.0), self.parameters)
        shown = self._explore()
        learner.add_demonstration(shown)
        number = 2
        while not self._is_over():
            learner.add_trial(self._try(learner, number))
            number += 1
        return np.array(self.n_arrived[:sum(self.maze.n_steps)])

    def _is_over(self) -> bool:
        return len(self.n_arrived) >= sum(self.maze.n_steps)

    def _see(self) -> int:
        """Return the mask of what is blocked around the robot now."""
        world = self._worlds[int(len(self.n_arrived) >= self.maze.n_steps[0])]
        return world.local_grid(*self.cell)

    def _step(self, heading: int) -> bool:
        """Take a step, or none; return whether it led to the goal."""
        if heading >= 0 and not self._see() >> heading & 1:
            self.cell = (self.cell[0] + int(STEP_ROW[heading]),
                         self.cell[1] + int(STEP_COL[heading]))
        arrived = self.cell == GOAL
        self.n_arrived.append((self.n_arrived[-1] if self.n_arrived else 0) + int(arrived))
        return arrived

    def _explore(self) -> Demonstration:
        """Take the step chosen least often where the robot is, until the goal is found."""
        shape = self._worlds[0].truth.shape
        counts = np.zeros((*shape, 8), dtype=np.int32)
        known = np.full(shape, -1, dtype=np.int8)
        cells, blocked = [self.cell], [self._see()]
        found = False
        while not found:
            compiled.remember_local_grid(known, *self.cell, blocked[-1], 0)
            allowed = compiled.allowed_steps(known, *self.cell, self._worlds[0].rules)
            heading = int(compiled.least_chosen(counts, *self.cell, allowed, self.rng))
            counts[(*self.cell, heading)] += 1
            found = self._step(heading)
            cells.append(self.cell)
            blocked.append(self._see())
        self.cell = START
        n = len(cells)
        return Demonstration(
            np.array(cells, dtype=np.int32), np.arange(n, dtype=np.float64),
            np.array(blocked, dtype=np.uint8), np.zeros(n, dtype=np.uint8), 1)

    def _try(self, learner: Learner, number: int) -> Trial:
        """Run one trial of a series from where the robot is; at the goal it is put back."""
        driven = learner.trial_field(explores(learner.parameters, False))
        policy = TrialPolicy(driven, self.parameters, self.rng, number)
        decisions, found = [], False
        while not found and not self._is_over():
            choice = policy.decide(*self.cell, self._see(), 0, float(len(self.n_arrived)))
            decisions.append(choice.decisions)
            found = self._step(choice.heading)
            if choice.heading < 0:
                break
        if found:
            self.cell = START
        outcome = Outcome.GOAL if found else Outcome.GAVE_UP
        return Trial(np.concatenate(decisions), outcome, number)


def ours(maze: Maze, seed: int, **parameters: object) -> Arrived:
    """Run our robot."""
    values = {'moves': 4, 'prefer_shorter': True, 'seed': seed, **parameters}
    return OwnRun(maze, Parameters.from_mapping(values), np.random.default_rng(seed)).run()


def dyna_q(maze: Maze, seed: int) -> Arrived:
    """Run Dyna-Q."""
    return dyna(kernels.DYNA_Q, maze, seed)


def dyna_q_plus(maze: Maze, seed: int) -> Arrived:
    """Run Dyna-Q+."""
    return dyna(kernels.DYNA_Q_PLUS, maze, seed)


#: Who runs: name in the tables -> run of a maze with a seed.
RUNNERS: Final[dict[str, Callable[[Maze, int], Arrived]]] = {
    'ours': ours, 'Dyna-Q+': dyna_q_plus, 'Dyna-Q': dyna_q, 'oracle': oracle}
