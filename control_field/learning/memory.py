"""What episodes leave behind: Q-matrix, remembered map, and one prototype a cell."""

import numpy as np
import numpy.typing as npt

from control_field.drives.loops import loop_erased
from control_field.grid import Grid
from control_field.headings import heading_from_step, N_HEADINGS
from control_field.kernels import compiled
from control_field.kernels.decision import Transition
from control_field.learning.evidence import Evidence
from control_field.local_grid import FREE
from control_field.parameters import Parameters
from control_field.records import Demonstration, Kind, Outcome, Prototypes, Trial
from control_field.robot.policy import rules_of
from control_field.windows import moved


class Memory:
    """
    What the episodes of one task have taught, in the order they came.

    Parameters
    ----------
    grid : Grid
    parameters : Parameters

    """

    def __init__(self, grid: Grid, parameters: Parameters) -> None:
        self.grid = grid
        self.parameters = parameters
        self.goal: tuple[int, int] | None = None
        self.n_episodes = 0
        self.q = np.zeros((*grid.shape, 8))
        self.evidence = Evidence(grid.shape, parameters.map_memory)
        self.known = self.evidence.known  #: 1 to 99 where a wall is doubted
        self.reach = 1  #: cells from the robot's to the edge of the widest local grid so far
        self.demonstrated = np.full(grid.shape, -1, dtype=np.int8)
        self.action = np.full(grid.shape, -1, dtype=np.int8)
        self.episode = np.zeros(grid.shape, dtype=np.int32)
        self.stamp = np.full(grid.shape, np.nan)

    def grow(self, grid: Grid) -> None:
        """
        Go on in a larger workspace of the same lattice; every cell keeps its place.

        Raises
        ------
        ValueError
            If it does not hold the present one, or is of another lattice.

        """
        if grid == self.grid:
            return
        offset = self.grid.offset_to(grid)
        if offset is None or min(offset) < 0 or (
                np.add(offset, self.grid.shape) > grid.shape).any():
            raise ValueError(f'{grid} does not hold the cells of {self.grid}')
        for name, fill in (('q', 0.0), ('demonstrated', -1), ('action', -1), ('episode', 0),
                           ('stamp', np.nan)):
            setattr(self, name, moved(getattr(self, name), self.grid, grid, fill))
        self.evidence.grow(self.grid, grid)
        self.known = self.evidence.known
        if self.goal is not None:
            self.goal = (self.goal[0] + offset[0], self.goal[1] + offset[1])
        self.grid = grid

    def add_demonstration(
        self, demonstration: Demonstration, workspace: Grid | None = None,
    ) -> None:
        """
        Learn a drive that a person showed: its cells become prototypes, its end the goal.

        Where demonstrations differ, in a cell or in the goal, the last one wins.

        Parameters
        ----------
        demonstration : Demonstration
        workspace : Grid, optional
            A larger one that its cells are of: the memory grows first, see `grow`.

        Raises
        ------
        ValueError
            If it has fewer than two cells, leaves the workspace, or is nothing but loops; the
            memory is then as it was.

        """
        cells, grid = demonstration.cells, workspace or self.grid
        if len(cells) < 2:
            raise ValueError('a demonstration must lead through at least two cells')
        if (cells < 0).any() or (cells >= np.array(grid.shape)).any():
            raise ValueError('a demonstration leaves the workspace')
        kept = loop_erased(cells)
        if len(kept) < 2:
            raise ValueError('a demonstration ends in the cell where it began; with its loop cut '
                             'out nothing of it is left')
        self.grow(grid)
        self.n_episodes += 1
        self.goal = (int(cells[-1, 0]), int(cells[-1, 1]))
        self._remember(demonstration.stamps, cells, demonstration.blocked, demonstration.unknown,
                       demonstration.local_grids)
        self._learn_path(cells[kept], demonstration.stamps[kept], demonstration.episode, True)

    def add_trial(self, trial: Trial, workspace: Grid | None = None) -> int:
        """
        Learn a trial (Case 2): online rewards, then R_goal carried back along its path.

        Parameters
        ----------
        trial : Trial
        workspace : Grid, optional
            A larger one that its cells are of: the memory grows first, see `grow`.

        Returns
        -------
        int
            Reinforcements: online ones and, unless the field alone led to the goal, R_goal.

        Raises
        ------
        ValueError
            If a decision leaves the workspace or its action is no heading; the memory is then as
            it was.

        """
        rows, grid = trial.decisions, workspace or self.grid
        _check_decisions(rows, grid)
        self.grow(grid)
        self.n_episodes += 1
        if trial.outcome == Outcome.ABORTED:
            return 0
        self._remember(rows['stamp'], np.stack([rows['row'], rows['col']], axis=1),
                       rows['blocked'], rows['unknown'], trial.local_grids)
        moved = rows[rows['kind'] != Kind.BLOCKED]
        if len(moved) == 0:
            return 0
        if not trial.n_reinforcements:
            self._learn_taught(moved, trial.episode)
            return 0
        self._apply_online(rows)
        cells = np.stack([moved['row'], moved['col']], axis=1)
        cells = np.concatenate([cells, [[moved['next_row'][-1], moved['next_col'][-1]]]])
        kept = loop_erased(cells)
        stamps = np.append(moved['stamp'], moved['stamp'][-1])
        reached = trial.outcome == Outcome.GOAL
        self._carry_back(cells[kept], 1.0 if reached else -1.0)
        if reached:
            self._learn_path(cells[kept], stamps[kept], trial.episode, False)
        self._learn_taught(moved, trial.episode)
        return trial.n_reinforcements

    def _remember(
        self, stamps: npt.NDArray[np.float64], cells: npt.NDArray[np.int32],
        blocked: npt.NDArray[np.uint8], unknown: npt.NDArray[np.uint8],
        local_grids: npt.NDArray[np.void],
    ) -> None:
        """Take over what an episode has shown: wide local grids and masks, in their order."""
        self.evidence.begin()
        before = np.searchsorted(local_grids['stamp'], stamps, side='right').tolist()
        n = 0
        for i, (row, col) in enumerate(cells.tolist()):
            n = self._observe_wide(local_grids, n, before[i])
            self.evidence.observe(row, col, int(blocked[i]), int(unknown[i]))
        self._observe_wide(local_grids, n, len(local_grids))
        if len(local_grids):
            self.reach = max(self.reach, local_grids['cells'].shape[1] // 2)
        self.evidence.end()
        self.known = self.evidence.known

    def _observe_wide(self, local_grids: npt.NDArray[np.void], n: int, end: int) -> int:
        """Take in the n-th to the ``end``-th local grid; return how many are taken in now."""
        reach = local_grids['cells'].shape[1] // 2
        for each in local_grids[n:end]:
            cells = each['cells'].copy()
            cells[reach, reach] = FREE  # the robot is there, whatever else reaches into it
            self.evidence.observe_cells(int(each['row']) - reach, int(each['col']) - reach, cells)
        return max(n, end)

    def _apply_online(self, rows: npt.NDArray[np.void]) -> None:
        for row in rows[rows['reward'] != 0]:
            self._backup(Transition(
                int(row['row']), int(row['col']), int(row['action']), int(row['next_row']),
                int(row['next_col']), float(row['reward'])))

    def _backup(self, transition: Transition) -> None:
        parameters = self.parameters
        compiled.backup(self.q, self.known, transition, float(parameters.learning_rate),
                        float(parameters.discount), rules_of(parameters))

    def _carry_back(self, cells: npt.NDArray[np.int32], reward: float) -> None:
        """Give R_goal to the last step of a path and carry it back by eq. 6."""
        for i in range(len(cells) - 2, -1, -1):
            (row, col), (next_row, next_col) = cells[i].tolist(), cells[i + 1].tolist()
            if max(abs(next_row - row), abs(next_col - col)) != 1:
                continue
            self._backup(Transition(
                row, col, heading_from_step(next_row - row, next_col - col), next_row, next_col,
                reward if i == len(cells) - 2 else 0.0))

    def _learn_path(self, cells: npt.NDArray[np.int32], stamps: npt.NDArray[np.float64],
                    episode: int, demonstrated: bool) -> None:
        """Make every step of a path the prototype of its cell; the last one taken wins."""
        for i in range(len(cells) - 1):
            (row, col), (next_row, next_col) = cells[i].tolist(), cells[i + 1].tolist()
            if max(abs(next_row - row), abs(next_col - col)) != 1:
                continue
            heading = heading_from_step(next_row - row, next_col - col)
            self._learn_step(row, col, heading, episode, float(stamps[i]), demonstrated)
        if demonstrated:
            self._carry_back(cells, 1.0)

    def _learn_taught(self, moved: npt.NDArray[np.void], episode: int) -> None:
        """Learn the steps that a person drove in a trial: they count as demonstrated."""
        for row in moved[moved['kind'] == Kind.TAUGHT]:
            self._learn_step(int(row['row']), int(row['col']), int(row['action']), episode,
                             float(row['stamp']), True)

    def _learn_step(self, row: int, col: int, heading: int, episode: int, stamp: float,
                    demonstrated: bool) -> None:
        self.action[row, col] = heading
        self.episode[row, col] = episode
        self.stamp[row, col] = stamp
        if demonstrated:
            self.demonstrated[row, col] = heading

    def prototypes(self) -> Prototypes:
        """Return all that was learnt, one prototype a cell, with its Q-value by eq. 6."""
        cells = np.argwhere(self.action >= 0).astype(np.int32)
        at = (cells[:, 0], cells[:, 1])
        headings = self.action[at]
        return Prototypes(
            cells=cells, headings=headings, q=self.q[(*at, headings)],
            episodes=self.episode[at], stamps=self.stamp[at],
            demonstrated=self.demonstrated[at] == headings)


def _check_decisions(rows: npt.NDArray[np.void], grid: Grid) -> None:
    """Refuse what would lead the compiled kernels out of their arrays."""
    for name, n in (('row', grid.n_rows), ('next_row', grid.n_rows), ('col', grid.n_cols),
                    ('next_col', grid.n_cols), ('action', N_HEADINGS)):
        if ((rows[name] < 0) | (rows[name] >= n)).any():
            raise ValueError(f'a trial holds a decision whose {name} is not 0 to {n - 1}')
