"""What every method under evaluation can do, and the methods made of control fields."""

from collections.abc import Callable
from dataclasses import dataclass, replace
import time
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import headings_from_vectors
from control_field.learning.judge import Runs
from control_field.learning.learner import explores, Learner, Refresh
from control_field.parameters import Parameters
from control_field.records import ControlField, Demonstration, Outcome
from experience_evaluation.environment import Environment

#: Proposals of the learner among which a start is looked for that is free in the true world.
_N_PROPOSALS = 400
#: Is told how many starts are judged; None: nobody asks.
Watch: TypeAlias = Callable[[int], None] | None


@dataclass(frozen=True, eq=False)
class Task:
    """
    A workspace, a goal in it, and how trials start; what is true in it, trials have to show.

    Parameters
    ----------
    grid : Grid
    goal : tuple of int
        ``(row, col)``
    first_start : tuple of int
        Where the (first) demonstration starts: the start of all trials if ``spread`` is false.
    spread : bool
        Whether the method may choose where its trials start.
    parameters : Parameters

    """

    grid: Grid
    goal: tuple[int, int]
    first_start: tuple[int, int]
    spread: bool
    parameters: Parameters

    def random_start(
        self, environment: Environment, rng: np.random.Generator,
    ) -> tuple[int, int]:
        """Return where a trial starts that nobody chose a start for."""
        if not self.spread:
            return self.first_start
        cells = np.argwhere(environment.startable)
        row, col = cells[int(rng.integers(len(cells)))]
        return int(row), int(col)


@dataclass(frozen=True)
class Practice:
    """
    What a trial came to.

    Parameters
    ----------
    steps : int
        Cell-to-cell steps.
    collisions : int
        With what is blocked.
    reinforcements : int
        Rewards other than zero.
    seconds : float, [s]
        Spent learning, on this machine.

    """

    steps: int
    collisions: int
    reinforcements: int
    seconds: float


@dataclass(frozen=True)
class Notes:
    """
    What a method says of itself.

    Parameters
    ----------
    n_prototypes : int
        Prototypes, or cells that a table holds something for.
    fidelity : float
        On the map it remembers; NaN if it remembers none.
    basin : float
        On the map it remembers; NaN if it remembers none.

    """

    n_prototypes: int
    fidelity: float = float('nan')
    basin: float = float('nan')


class Method(Protocol):
    """Something that is taught, practises, and can be judged at any time."""

    def teach(self, demonstration: Demonstration) -> None:
        """Learn from a demonstration."""

    def practise(self, environment: Environment, number: int) -> Practice | None:
        """Run trial ``number`` (from 1) and learn from it; None if it does not learn by trying."""

    def headings(self) -> npt.NDArray[np.int8]:
        """Return the heading of every cell without local grid, -1 for none."""

    def runs(self, environment: Environment, starts: npt.NDArray[np.int64], seed: int,
             watch: Watch = None) -> Runs:
        """Run from every start with local grid, learning nothing; tell how many are done."""

    def notes(self) -> Notes:
        """Return what it says of itself."""


class FieldMethod:
    """
    The control field: taught, practising, in either profile.

    Parameters
    ----------
    task : Task
    rng : numpy.random.Generator
        Of starts and exploration.
    practises : bool
        Whether it learns from trials; eq. 7 alone does not.

    """

    def __init__(self, task: Task, rng: np.random.Generator, practises: bool = True) -> None:
        self.task = task
        self.learner = Learner(task.grid, task.parameters)
        self._rng = rng
        self._practises = practises
        self._n_taught = 0

    @property
    def refresh(self) -> Refresh:
        """Return the field in force with what was made of it."""
        refresh = self.learner.refresh
        assert refresh is not None, 'taught before anything else'
        return refresh

    def teach(self, demonstration: Demonstration) -> None:
        """Learn from a demonstration."""
        self._n_taught += 1
        self.learner.add_demonstration(demonstration)

    def practise(self, environment: Environment, number: int) -> Practice | None:
        """Run a trial from where it teaches most (or from the fixed start) and learn from it."""
        if not self._practises:
            return None
        field = self.learner.trial_field(explores(self.learner.parameters, self.task.spread))
        start = self._start(environment, field) if self.task.spread else self.task.first_start
        seed = int(self._rng.integers(2**62))
        world = environment.world_with(self.task.parameters)
        trial, _ = world.trial(field, start, seed, self._n_taught + number)
        began = time.perf_counter()
        self.learner.add_trial(trial)
        return Practice(trial.n_steps, int(trial.outcome == Outcome.COLLISION),
                        self.refresh.reinforcements, time.perf_counter() - began)

    def _start(self, environment: Environment, field: ControlField) -> tuple[int, int]:
        """Return the first proposed start that is free in the true world."""
        for cell in self.learner.next_starts(_N_PROPOSALS, self._rng, field):
            if environment.startable[cell]:
                return cell
        return self.task.random_start(environment, self._rng)

    def headings(self) -> npt.NDArray[np.int8]:
        """Return the field's headings."""
        field = self.refresh.field
        return headings_from_vectors(field.vx, field.vy)

    def runs(self, environment: Environment, starts: npt.NDArray[np.int64], seed: int,
             watch: Watch = None) -> Runs:
        """Run from every start with local grid and exploration."""
        world = environment.world_with(self.task.parameters)
        return world.trials(self.refresh.field, starts, seed, watch)

    def notes(self) -> Notes:
        """Return size and certificate."""
        certificate = self.refresh.certificate
        return Notes(len(self.refresh.prototypes), certificate.fidelity, certificate.basin)


def equation_7(task: Task, rng: np.random.Generator) -> FieldMethod:
    """Return the paper's field of the demonstrations alone."""
    parameters = replace(task.parameters, profile='paper')
    return FieldMethod(replace(task, parameters=parameters), rng, practises=False)
