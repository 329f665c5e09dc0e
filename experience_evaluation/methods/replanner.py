"""The honest opponent: an optimistic replanner that knows the goal, and keeps its map or not."""

import time

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import compiled
from control_field.kernels.interpolation import Sums
from control_field.kernels.steps import plain_ground
from control_field.learning.grid_world import GridWorld
from control_field.learning.judge import Runs
from control_field.local_grid import BLOCKED, UNKNOWN
from control_field.records import Demonstration
from control_field.robot.policy import rules_of
from experience_evaluation.environment import Environment
from experience_evaluation.methods.method import Notes, Practice, Task, Watch

Known = npt.NDArray[np.int8]


class Replanner:
    """
    Drives the shortest way on its map, unseen cells taken as free, and replans on what it sees.

    What D* Lite (Koenig and Likhachev 2002) does, without its bookkeeping: the paths are the same.

    Parameters
    ----------
    task : Task
    rng : numpy.random.Generator
        Of the starts.
    forgets : bool
        Whether walls that it has not seen for ``map_memory`` trials become unseen again, and all
        that it does not see in a run where no way is left on its map.

    """

    def __init__(self, task: Task, rng: np.random.Generator, forgets: bool = False) -> None:
        self.task = task
        self._rng = rng
        self._forgets = forgets
        self._age = np.zeros(task.grid.shape, dtype=np.int64)
        self._rules = rules_of(task.parameters)
        self.known = np.full(task.grid.shape, -1, dtype=np.int8)

    def teach(self, demonstration: Demonstration) -> None:
        """Take what was seen during a demonstration into the map."""
        cells = demonstration.cells.tolist()
        for (row, col), blocked, unknown in zip(
                cells, demonstration.blocked, demonstration.unknown, strict=True):
            compiled.remember_local_grid(self.known, row, col, int(blocked), int(unknown))
        seen = np.zeros(self.known.shape, dtype=np.bool_)
        for grid in demonstration.local_grids:
            compiled.remember_cells(self.known, seen, int(grid['row']), int(grid['col']),
                                    grid['cells'])

    def practise(self, environment: Environment, number: int) -> Practice:
        """Drive to the goal from a random start (or the fixed one), keeping what is seen."""
        del number
        start, began = self.task.random_start(environment, self._rng), time.perf_counter()
        seen = np.zeros(self.known.shape, dtype=np.bool_)
        _, n_steps, _ = self._run(environment, self.known, start, seen)
        self._age = np.where(seen, 0, self._age + 1)
        memory = self.task.parameters.map_memory
        if self._forgets and memory:
            self.known[(self.known == BLOCKED) & (self._age > memory)] = UNKNOWN
        return Practice(n_steps, 0, 0, time.perf_counter() - began)

    def _cost(self, known: Known) -> npt.NDArray[np.float64]:
        return GridWorld(np.maximum(known, 0), self.task.parameters).cost_to(self.task.goal)

    def _headings(self, known: Known) -> npt.NDArray[np.int8]:
        headings: npt.NDArray[np.int8] = compiled.attraction_from_cost(
            plain_ground(known, self._rules), self._cost(known), Sums.none(known.shape))
        return headings

    def _run(self, environment: Environment, known: Known, start: tuple[int, int],
             seen: npt.NDArray[np.bool_], headings: npt.NDArray[np.int8] | None = None,
             ) -> tuple[int, int, float]:
        """Run once, writing what is seen into ``known``, and where into ``seen``."""
        (row, col), length = start, 0.0
        world, limit = environment.world, self.task.parameters.step_limit
        if headings is None:
            headings = self._headings(known)
        for step in range(limit):
            if (row, col) == self.task.goal:
                return 0, step, length
            if self._look(world, known, seen, row, col):
                headings = self._headings(known)
            if headings[row, col] < 0 and self._forgets:
                known[(known == BLOCKED) & ~seen] = UNKNOWN
                headings = self._headings(known)
            heading = int(headings[row, col])
            if heading < 0:
                return 2, step, length
            length += float(STEP_LENGTH[heading])
            row, col = row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])
        return 0 if (row, col) == self.task.goal else 2, limit, length

    @staticmethod
    def _look(world: GridWorld, known: Known, seen: npt.NDArray[np.bool_], row: int, col: int,
              ) -> bool:
        """Remember what is seen from a cell; return whether that is anything new."""
        changed = compiled.remember_local_grid(known, row, col, world.local_grid(row, col), 0)
        seen[max(0, row - 1):row + 2, max(0, col - 1):col + 2] = True
        for grid in world.local_grids(np.array([[row, col]], dtype=np.int32), np.zeros(1)):
            changed += compiled.remember_cells(known, seen, row, col, grid['cells'])
        return bool(changed)

    def headings(self) -> npt.NDArray[np.int8]:
        """Return the first step of the shortest way on the map as it is."""
        return self._headings(self.known)

    def runs(self, environment: Environment, starts: npt.NDArray[np.int64], seed: int,
             watch: Watch = None) -> Runs:
        """Run from every start, each on a copy of the map."""
        del seed, watch
        headings = self._headings(self.known)
        table = np.array([
            self._run(environment, self.known.copy(), (int(row), int(col)),
                      np.zeros(self.known.shape, dtype=np.bool_), headings)
            for row, col in starts], dtype=np.float64).reshape(-1, 3)
        return Runs(table[:, 0].astype(np.int8), table[:, 1].astype(np.int64),
                    np.zeros(len(table), dtype=np.int64), table[:, 2])

    def notes(self) -> Notes:
        """Return the basin on its own map."""
        judged = (self.known == 0) & np.isfinite(self._cost(self.known))
        home = compiled.flow_basin(
            self.known, self._headings(self.known), *self.task.goal, self._rules) == 1
        return Notes(0, basin=float(home[judged].mean()) if judged.any() else float('nan'))
