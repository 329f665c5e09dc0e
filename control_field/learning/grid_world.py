"""Trials on a grid world, without a robot: what evaluation and the next starts are judged with."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors
from control_field.kernels import compiled
from control_field.kernels.decision import Log, LOGGED, new_trial, TrialState
from control_field.kernels.steps import no_preference, plain_ground
from control_field.kernels.visibility import Scanner
from control_field.learning.judge import Judge, Runs
from control_field.local_grid import is_local_grid_size, MAX_SIDE
from control_field.parameters import Parameters
from control_field.rays import rays_within
from control_field.records import ControlField, local_grid_dtype, no_local_grids, Outcome, Trial
from control_field.robot.decision_table import decisions_from_log
from control_field.robot.policy import options_of, rules_of, trial_on

#: Rows that a trial's log has room for at first.
_FIRST_ROWS = 4096
_OUTCOMES = (Outcome.GOAL, Outcome.COLLISION, Outcome.GAVE_UP)


def fresh(state: TrialState) -> TrialState:
    """Return a trial before its first decision, whose arrays are its own, like another one."""
    ground = state.ground._replace(
        known=state.ground.known.copy(), factor=state.ground.factor.copy())
    return new_trial(ground, state.headings, state.goal, state.q.copy(), state.cost.copy())


class GridWorld:
    """
    A true map that trials are run in, cell by cell; nothing is learnt here.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, anything else blocked.
    parameters : Parameters
    sight : int, [cells]
        Side of the local grid: 3, or another odd number up to 61; then what lies behind something
        is not seen.

    Raises
    ------
    ValueError
        If a local grid has no such side.

    """

    def __init__(self, occupancy: npt.NDArray[np.int8], parameters: Parameters,
                 sight: int = 3) -> None:
        if not is_local_grid_size(sight):
            raise ValueError(f'a local grid has an odd number of cells along a side, '
                             f'3 to {MAX_SIDE}, not {sight}')
        self.truth = np.where(occupancy == 0, 0, 100).astype(np.int8)
        self.parameters = parameters
        self.sight = sight
        self.rules = rules_of(parameters)
        self._scanner = Scanner(rays_within(sight // 2 if sight > 3 else 0),
                                np.zeros((sight, sight), dtype=np.int8))

    def with_parameters(self, parameters: Parameters) -> 'GridWorld':
        """Return the same world for a robot with other parameters."""
        return GridWorld(self.truth, parameters, self.sight)

    def cost_to(self, goal: tuple[int, int]) -> npt.NDArray[np.float64]:
        """Return the true least cost from every cell to the goal, in cells; inf without a way."""
        cost: npt.NDArray[np.float64] = compiled.cost_to_go(
            plain_ground(self.truth, self.rules), goal, no_preference(self.truth.shape))
        return np.where(self.truth == 0, cost, np.inf)

    def local_grid(self, row: int, col: int) -> int:
        """Return the mask of the blocked neighbours of a cell."""
        return int(compiled.see(self.truth, row, col))

    def local_grids(
        self, cells: npt.NDArray[np.int32], stamps: npt.NDArray[np.float64],
    ) -> npt.NDArray[np.void]:
        """
        Return what is seen along some cells beyond those around each; an empty table at sight 3.

        Parameters
        ----------
        cells : ndarray of int32, shape (n, 2)
        stamps : ndarray, shape (n,), [s]

        Returns
        -------
        ndarray of `local_grid_dtype`, shape (n,)

        """
        if self.sight == 3:
            return no_local_grids()
        shown = np.zeros((len(cells), self.sight, self.sight), dtype=np.int8)
        for (row, col), seen in zip(cells.tolist(), shown, strict=True):
            compiled.look(self.truth, row, col, self._scanner.rays, seen)
        return self._table(cells, stamps, shown)

    def _table(self, cells: npt.NDArray[np.int32], stamps: npt.NDArray[np.float64],
               shown: npt.NDArray[np.int8]) -> npt.NDArray[np.void]:
        """Return local grids as a table."""
        table = np.zeros(len(cells), dtype=local_grid_dtype(self.sight))
        table['stamp'], table['row'], table['col'] = stamps, cells[:, 0], cells[:, 1]
        table['cells'] = shown
        return table

    def _new_log(self, n_rows: int) -> Log:
        return Log(np.zeros((n_rows, len(LOGGED)), dtype=np.int32),
                   np.zeros((n_rows if self.sight > 3 else 0, self.sight, self.sight),
                            dtype=np.int8))

    def trial(self, field: ControlField, start: tuple[int, int], seed: int, number: int = 1,
              ) -> tuple[Trial, float]:
        """
        Run one trial with local grid and exploration.

        Parameters
        ----------
        field : ControlField
            What the robot drives on.
        start : tuple of int
            Free cell.
        seed : int
            Of the exploration.
        number : int
            Trial number, written into the decisions and the episode.

        Returns
        -------
        trial : Trial
        length : float, [cells]

        Raises
        ------
        ValueError
            If the start is blocked.

        """
        if self.truth[start] != 0:
            raise ValueError(f'the start {start} is blocked')
        ready, n_rows, capacity = self._ready(field), 0, _FIRST_ROWS
        while True:  # a run is the same every time, so a log that was too short costs time only
            log = self._new_log(capacity)
            outcome, _, n_rows, length, _ = self._run(ready, start, seed, log)
            if n_rows < capacity:
                break
            capacity *= 8
        rows = decisions_from_log(log.rows[:n_rows], number, field.revision)
        _, first = np.unique(rows['step'], return_index=True)
        cells = np.stack([rows['row'], rows['col']], axis=1)[first]
        seen = no_local_grids() if self.sight == 3 else self._table(
            cells, rows['stamp'][first], log.shown[first])
        return Trial(rows, _OUTCOMES[outcome], number, seen), float(length)

    def trials(self, field: ControlField, starts: npt.NDArray[np.integer], seed: int,
               watch: Callable[[int], None] | None = None) -> Runs:
        """
        Run a trial from every start, each on a field and memory of its own; nothing is learnt.

        Parameters
        ----------
        starts : ndarray of int, shape (n, 2)
            Free cells.
        watch : callable, optional
            Is told how many are done, again and again.

        """
        judge = Judge(field, self.truth, self.parameters, self.cost_to(field.goal), self._scanner)
        return judge.runs(starts, seed, watch)

    def _ready(self, field: ControlField) -> TrialState:
        """Return what every run on a field starts from."""
        return trial_on(field, field.known.copy(), self.parameters)

    def _run(self, ready: TrialState, start: tuple[int, int], seed: int,
             log: Log) -> tuple[int, int, int, float, int]:
        parameters = self.parameters
        result: tuple[int, int, int, float, int] = compiled.run_trial(
            self.truth, start, fresh(ready), options_of(parameters), parameters.step_limit,
            np.random.default_rng(seed), log, self._scanner)
        return result

    def flow_home(self, field: ControlField) -> npt.NDArray[np.bool_]:
        """Return the cells from which the flow alone reaches the goal in the true map."""
        state = compiled.flow_basin(self.truth, headings_from_vectors(field.vx, field.vy),
                                    *field.goal, self.rules)
        return np.asarray(state == 1)

    def flow_lengths(self, field: ControlField) -> npt.NDArray[np.float64]:
        """Return the length of the flow home from every cell, in cells; inf where it fails."""
        return np.asarray(compiled.flow_lengths(
            self.truth, headings_from_vectors(field.vx, field.vy), *field.goal, self.rules))
