"""Behaviour cloning: do what was demonstrated nearest by."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from control_field.headings import heading_from_step, STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import compiled
from control_field.learning.judge import Runs
from control_field.records import Demonstration
from experience_evaluation.environment import Environment
from experience_evaluation.methods.method import Notes, Task, Watch


class NearestPrototype:
    """
    Takes the action of the nearest demonstrated cell; with local grid, of the nearest allowed one.

    Parameters
    ----------
    task : Task

    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self._action: dict[tuple[int, int], int] = {}

    def teach(self, demonstration: Demonstration) -> None:
        """Remember every demonstrated step; the last one in a cell wins."""
        cells = demonstration.cells.tolist()
        for (row, col), (r, c) in pairwise(cells):
            self._action[row, col] = heading_from_step(r - row, c - col)

    def practise(self, environment: Environment, number: int) -> None:
        """Learn nothing from trials."""

    def _ranked(self) -> npt.NDArray[np.int8]:
        """
        Return the actions of all prototypes a cell, the nearest first: (n_places, n).

        Of those that are equally near the one that was shown first stands first.
        """
        centres = np.array(list(self._action), dtype=np.float64)
        actions = np.array(list(self._action.values()), dtype=np.int8)
        n_rows, n_cols = self.task.grid.shape
        ranked = np.empty((n_rows, n_cols, len(centres)), dtype=np.int8)
        for row in range(n_rows):  # all rows at once would need a number for every pair
            away = (row - centres[:, 0]) ** 2 + (np.arange(n_cols)[:, None] - centres[:, 1]) ** 2
            ranked[row] = actions[away.argsort(axis=1, kind='stable')]
        return ranked.reshape(n_rows * n_cols, -1)

    def headings(self) -> npt.NDArray[np.int8]:
        """Return the action of the nearest prototype at every cell."""
        return self._ranked()[:, 0].reshape(self.task.grid.shape)

    def runs(self, environment: Environment, starts: npt.NDArray[np.int64], seed: int,
             watch: Watch = None) -> Runs:
        """Run from every start; a cell entered twice is a loop, for nothing is remembered."""
        del seed, watch
        ranked = self._ranked().reshape(*self.task.grid.shape, -1)
        headings = np.full(self.task.grid.shape, -1, dtype=np.int8)
        world = environment.world
        for row, col in np.argwhere(world.truth == 0).tolist():
            for heading in ranked[row, col]:
                if compiled.step_allowed(world.truth, row, col, int(heading), world.rules):
                    headings[row, col] = heading
                    break
        table = np.array([self._run(headings, int(row), int(col)) for row, col in starts])
        table = table.reshape(-1, 3)
        return Runs(table[:, 0].astype(np.int8), table[:, 1].astype(np.int64),
                    np.zeros(len(table), dtype=np.int64), table[:, 2])

    def _run(self, headings: npt.NDArray[np.int8], row: int, col: int,
             ) -> tuple[float, float, float]:
        entered: set[tuple[int, int]] = set()
        length = 0.0
        while (row, col) != self.task.goal:
            heading = int(headings[row, col])
            if heading < 0 or (row, col) in entered or (
                    len(entered) >= self.task.parameters.step_limit):
                return 2.0, float(len(entered)), length
            entered.add((row, col))
            length += float(STEP_LENGTH[heading])
            row, col = row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])
        return 0.0, float(len(entered)), length

    def notes(self) -> Notes:
        """Return the number of prototypes."""
        return Notes(len(self._action))
