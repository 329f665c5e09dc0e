"""Q-learning, Sarsa, Dyna-Q, Dyna-Q+ and prioritised sweeping on the cells, for comparison."""

import time
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import heading_from_step
from control_field.learning.judge import Runs
from control_field.records import Demonstration
from experience_evaluation.environment import Environment
from experience_evaluation.methods import tabular_kernels as kernels
from experience_evaluation.methods.method import Notes, Practice, Task, Watch

#: Share of random actions, and backups after every step of the methods that plan.
EPSILON: Final = 0.1
N_PLANNING: Final = 10
#: What a blocked step earns, and how much Dyna-Q+ is drawn to what it has not tried for long.
BLOCKED_REWARD: Final = -1.0
KAPPA: Final = 1e-3
#: How often a demonstration is replayed, last step first.
_N_REPLAYS: Final = 20
KINDS: Final = {'q_learning': kernels.Q_LEARNING, 'sarsa': kernels.SARSA,
                'dyna_q': kernels.DYNA_Q, 'dyna_q+': kernels.DYNA_Q_PLUS,
                'prioritised_sweeping': kernels.SWEEPING}


class TabularMethod:
    """
    A table of values over cells and headings.

    Learning rate, discount and step limit are those of the task's parameters. Without local grid
    while it practises: it learns what is blocked by bumping into it.

    Parameters
    ----------
    task : Task
    rng : numpy.random.Generator
    kind : int
        Of `KINDS`.
    with_demonstration : bool
        Whether it learns from demonstrations, as experience replayed before the first trial.

    """

    def __init__(self, task: Task, rng: np.random.Generator, kind: int,
                 with_demonstration: bool) -> None:
        self.task = task
        self._rng = rng
        self._with_demonstration = with_demonstration
        n_places = task.grid.n_rows * task.grid.n_cols
        self._tables = kernels.new_tables(n_places)
        self._tie_break = rng.random((n_places, 8))
        parameters = task.parameters
        self._settings = kernels.Settings(
            kind, task.grid.n_cols, self._place(task.goal),
            0b01010101 if parameters.moves == 4 else 0b11111111, float(parameters.learning_rate),
            float(parameters.discount), EPSILON, N_PLANNING, BLOCKED_REWARD, KAPPA)

    @property
    def q(self) -> npt.NDArray[np.float64]:
        """Return the values, shape (n_places, 8)."""
        return self._tables.q

    def _place(self, cell: tuple[int, int]) -> int:
        return cell[0] * self.task.grid.n_cols + cell[1]

    def teach(self, demonstration: Demonstration) -> None:
        """Replay a demonstration, last step first, as often as values need to come through."""
        if not self._with_demonstration:
            return
        steps = np.diff(demonstration.cells, axis=0)
        actions = np.array([heading_from_step(row, col) for row, col in steps], dtype=np.int64)
        places = (demonstration.cells @ [self.task.grid.n_cols, 1]).astype(np.int64)
        kernels.replay(self._tables, places, actions, _N_REPLAYS, self._settings, self._rng)

    def practise(self, environment: Environment, number: int) -> Practice:
        """Run an episode from a random start (or the fixed one)."""
        del number
        start = self.task.random_start(environment, self._rng)
        began = time.perf_counter()
        n_steps, n_bumps, n_rewards = kernels.run_episode(
            environment.allowed, self._tables, self._place(start),
            self.task.parameters.step_limit, self._settings, self._rng)
        return Practice(int(n_steps), int(n_bumps), int(n_rewards), time.perf_counter() - began)

    def headings(self) -> npt.NDArray[np.int8]:
        """Return the greedy action of every cell; equals are settled by lot, once for all."""
        mask = self._settings.mask
        allowed = np.array([mask >> action & 1 for action in range(8)], dtype=np.bool_)
        values = np.where(allowed, self.q, -np.inf)
        best = values == values.max(axis=1, keepdims=True)
        chosen = np.where(best, self._tie_break, -1.0).argmax(axis=1)
        headings: npt.NDArray[np.int8] = chosen.astype(np.int8).reshape(self.task.grid.shape)
        return headings

    def runs(self, environment: Environment, starts: npt.NDArray[np.int64], seed: int,
             watch: Watch = None) -> Runs:
        """Follow the greedy policy from every start, without the steps seen to be blocked."""
        del watch
        results = [kernels.greedy_run(
            environment.allowed, self.q, self._place((int(row), int(col))),
            self.task.parameters.step_limit, self._settings, np.random.default_rng([seed, index]))
            for index, (row, col) in enumerate(starts)]
        table = np.array(results, dtype=np.float64).reshape(-1, 3)
        return Runs(table[:, 0].astype(np.int8), table[:, 1].astype(np.int64),
                    np.zeros(len(table), dtype=np.int64), table[:, 2])

    def notes(self) -> Notes:
        """Return how many cells the table holds something for."""
        return Notes(int((self.q != 0.0).any(axis=1).sum()))
