"""What the robot does in one trial (Case 1): the decisions between cell and cell."""

from collections.abc import Iterator
from dataclasses import dataclass
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import (
    headings_from_vectors, N_HEADINGS, STEP_COL, STEP_LENGTH, STEP_ROW)
from control_field.kernels.decision import (
    decide, LOGGED, n_rewards, new_trial, Options, take_in_local_grid, Transition, TrialState,
    write_decision, write_row)
from control_field.kernels.last_resort import search_anew
from control_field.kernels.steps import allowed_steps, Ground, StepRules
from control_field.kernels.visibility import remember_cells
from control_field.local_grid import BLOCKED
from control_field.parameters import Parameters
from control_field.records import ControlField, DECISION_DTYPE, Kind
from control_field.robot.decision_table import decisions_from_log
from control_field.robot.other_workspace import moved_state
from control_field.words import counted

#: Backups that one decision may spend on rehearsing around the robot: about 10 ms in Python.
N_ONLINE_BACKUPS: Final = 400
#: Q-values up to this say only that the goal is far.
_NOTHING_IN_Q: Final = 1.001e-37
#: Prices that differ by less are the same: a field's Q-values have single precision.
_SAME_PRICE: Final = 1e-3
_LEAST_PRICE: Final = 0.01
#: Cells of a map that are gone over in one go.
_SLICE: Final = 2**13


@dataclass(frozen=True, eq=False)
class Choice:
    """
    What to do next.

    Parameters
    ----------
    heading : int
        Step to take, 0 to 7; -1: give up.
    kind : Kind
        Why this step.
    reason : str
        One sentence if the trial is given up, else empty.
    decisions : ndarray of DECISION_DTYPE, shape (k,)
        Rows to publish, in order.

    """

    heading: int
    kind: Kind
    reason: str
    decisions: npt.NDArray[np.void]


def cost_from_q(q: npt.NDArray[np.floating], discount: float) -> npt.NDArray[np.float64]:
    """
    Return the cost to go that a rehearsed Q-matrix stands for, in cells; inf where it has none.

    Parameters
    ----------
    q : ndarray, shape (n_rows, n_cols, 8)
    discount : float
        Above 0 and below 1.

    """
    value = np.asarray(q, dtype=np.float64).max(axis=2)
    with np.errstate(divide='ignore'):
        cost = np.log(np.maximum(value, 0.0)) / math.log(discount)
    positive: npt.NDArray[np.float64] = np.maximum(cost, 0.0)
    return positive


def is_doubted(known: npt.NDArray[np.int8]) -> npt.NDArray[np.bool_]:
    """Mark the doubted cells of a remembered map: occupied when seen last, a while ago."""
    return (known > 0) & (known < BLOCKED)


def caution_factor(
    known: npt.NDArray[np.int8], parameters: Parameters,
) -> npt.NDArray[np.float64]:
    """
    Return what scales the length of a step into each cell: unseen ground counts as longer.

    A doubted wall counts as so many cells more as the confidence in it is.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.

    """
    factor: npt.NDArray[np.float64] = np.where(known < 0, 1.0 + parameters.caution, 1.0)
    return np.where(is_doubted(known), 1.0 + known, factor)


def rules_of(parameters: Parameters) -> StepRules:
    """
    Return the rules of a step on the remembered map.

    Ground that was never seen counts as free there, or no way around would ever be found; what a
    robot keeps out of is what its local grid calls unknown when it is about to enter it.
    """
    return StepRules(parameters.corner_cutting, False, parameters.moves)


def ground_of(known: npt.NDArray[np.int8], parameters: Parameters) -> Ground:
    """Return what a way over a remembered map is planned on."""
    return Ground(known, caution_factor(known, parameters), rules_of(parameters))


def prices_in_q(
    q: npt.NDArray[np.floating], cost: npt.NDArray[np.float64],
    otherwise: npt.NDArray[np.float64], discount: float,
) -> npt.NDArray[np.float64]:
    """
    Return what scales the length of a step into each cell, as a rehearsed Q-matrix has it.

    ``Q(s, a) = discount ** (length(a) * factor(s') + cost(s'))``: so it says at what price it was
    made, and a way round something is sought at the same. The field of a trial that is to look
    around makes ground cheap that is worth a look, and leads through walls that may have opened.

    Parameters
    ----------
    q : ndarray, shape (n_rows, n_cols, 8)
    cost : ndarray of float64, shape (n_rows, n_cols), [cells]
        Cost to go of the same Q-matrix.
    otherwise : ndarray of float64, shape (n_rows, n_cols)
        What counts where it says nothing, or the same but for rounding.
    discount : float

    """
    rows, cols = cost.shape
    prices = np.full((rows + 2, cols + 2), -np.inf)
    with np.errstate(divide='ignore', invalid='ignore'):
        through = np.where(q > _NOTHING_IN_Q, np.log(q) / math.log(discount), np.nan)
        ahead = np.pad(np.where(np.isfinite(cost), cost, np.nan), 1, constant_values=np.nan)
        for heading in range(N_HEADINGS):
            top, left = 1 + STEP_ROW[heading], 1 + STEP_COL[heading]
            there = slice(top, top + rows), slice(left, left + cols)
            price = (through[:, :, heading] - ahead[there]) / STEP_LENGTH[heading]
            prices[there] = np.fmax(prices[there], price)
    said = prices[1:-1, 1:-1]
    differs = np.isfinite(said) & (np.abs(said - otherwise) > _SAME_PRICE)
    return np.where(differs, np.maximum(said, _LEAST_PRICE), otherwise)


def options_of(parameters: Parameters) -> Options:
    """Return how a trial decides."""
    return Options(
        parameters.profile == 'full' and parameters.rehearsal, float(parameters.effective_window),
        float(parameters.power), parameters.oscillation_limit, N_ONLINE_BACKUPS,
        float(parameters.learning_rate), float(parameters.discount), parameters.map_memory > 0)


def trial_on(
    field: ControlField, known: npt.NDArray[np.int8], parameters: Parameters,
) -> TrialState:
    """
    Return the state of a trial on a field before its first decision.

    Parameters
    ----------
    field : ControlField
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map; decisions write into it.
    parameters : Parameters

    """
    shape, options = field.grid.shape, options_of(parameters)
    q, cost, factor = np.empty((*shape, N_HEADINGS)), np.zeros(shape), np.empty(shape)
    headings = np.empty(shape, dtype=np.int8)
    for rows in _slices(shape):
        q[rows] = field.q[rows]
        headings[rows] = headings_from_vectors(field.vx[rows], field.vy[rows])
        factor[rows] = caution_factor(known[rows], parameters)
        if options.rehearsed:
            cost[rows] = cost_from_q(q[rows], parameters.discount)
    if options.rehearsed:
        cost[field.goal] = 0.0
        for rows in _slices(shape):
            around = slice(max(rows.start - 1, 0), rows.stop + 1)
            prices = prices_in_q(
                q[around], cost[around], caution_factor(known[around], parameters),
                parameters.discount)
            first = rows.start - around.start
            factor[rows] = prices[first:first + rows.stop - rows.start]
    return new_trial(Ground(known, factor, rules_of(parameters)), headings, field.goal, q, cost)


def _slices(shape: tuple[int, int]) -> Iterator[slice]:
    """Return slices of a map's rows; between two of them a thread gives Python's lock on."""
    n = max(_SLICE // shape[1], 1)
    for row in range(0, shape[0], n):
        yield slice(row, min(row + n, shape[0]))


class TrialPolicy:
    """
    Decides, cell by cell, from field, Q-matrix, local grid and the remembered map.

    Everything it changes (Q-matrix, remembered map, counts) is its own and ends with the trial:
    the learner arrives at the same from the decisions it publishes.

    Parameters
    ----------
    field : ControlField
        What the learner handed over.
    parameters : Parameters
        How to decide.
    rng : numpy.random.Generator
        For exploration.
    trial : int
        Number written into the decisions.
    state : TrialState, optional
        Of `trial_on`, if it is there; it becomes the trial's own.

    """

    def __init__(self, field: ControlField, parameters: Parameters, rng: np.random.Generator,
                 trial: int, state: TrialState | None = None) -> None:
        self.field = field
        self._parameters = parameters
        self._options = options_of(parameters)
        self._rng = rng
        self._trial = trial
        self.state = state or trial_on(field, field.known.copy(), parameters)
        self.n_steps = 0
        self.n_reinforcements = 0
        self.n_decisions = 0

    def replace_field(self, field: ControlField, state: TrialState | None = None) -> None:
        """
        Go on with a refreshed field; what the local grid has shown in this trial is kept.

        Where its workspace is another one, every place has kept its own.

        Parameters
        ----------
        field : ControlField
        state : TrialState, optional
            Of `trial_on`, if it is there; it becomes the trial's own.

        Raises
        ------
        ValueError
            If the field is not of the same lattice.

        """
        before = self.state
        if field.grid != self.field.grid:
            before = moved_state(before, self.field.grid, field.grid)
        new = state or trial_on(field, field.known.copy(), self._parameters)
        seen = np.flatnonzero(before.seen)
        new.ground.known.reshape(-1)[seen] = before.ground.known.reshape(-1)[seen]
        new.ground.factor.reshape(-1)[seen] = 1.0  # there is nothing left to look at
        self.field = field
        self.state = new._replace(
            counts=before.counts, entered=before.entered, punished=before.punished,
            seen=before.seen, n_doubted=before.n_doubted)

    def at_goal(self, row: int, col: int) -> bool:
        """Return whether a cell is the goal."""
        return (row, col) == self.field.goal

    def heading(self, row: int, col: int) -> int:
        """Return the heading of the field in a cell, -1 for none."""
        return int(self.state.headings[row, col])

    @property
    def doubts(self) -> bool:
        """Return whether remembered walls are doubted where no way is left."""
        return self._options.doubts

    def decide(self, row: int, col: int, blocked: int, unknown: int, stamp: float) -> Choice:
        """
        Decide the next step.

        Parameters
        ----------
        row, col : int
            The robot's cell.
        blocked, unknown : int
            Masks of its 3x3 local grid.
        stamp : float, [s]
            Written into the decisions.

        Returns
        -------
        Choice

        Raises
        ------
        ValueError
            If the cell lies outside the workspace.

        """
        if not self.field.grid.contains(row, col):
            raise ValueError(f'cell ({row}, {col}) lies outside the workspace')
        if self.n_steps >= self._parameters.step_limit:
            return self._give_up(f'the step limit of {self._parameters.step_limit} is reached')
        # Kept out of until it is seen, which it may be from another cell.
        kept_out = blocked | unknown if self._parameters.unknown_is_blocked else blocked
        decision = decide(
            row, col, kept_out, unknown & ~kept_out, self.state, self._options, self._rng)
        log = self._empty_log()
        n = write_decision(log, 0, row, col, decision, blocked, self.n_steps)
        rows = self._publish(log[:n], unknown, stamp)
        self.n_reinforcements += n_rewards(decision)
        if decision.heading < 0:
            return self._give_up(self._no_way(), rows)
        self.n_steps += 1
        return Choice(int(decision.heading), Kind(decision.kind), '', rows)

    def observe(self, row: int, col: int, cells: npt.NDArray[np.int8]) -> None:
        """
        Remember what is seen from a cell, be it far from it; decisions go on from there.

        Parameters
        ----------
        row, col : int
            The robot's cell.
        cells : ndarray of int8, shape (n, n)
            Its local grid, see `remember_cells`.

        """
        if not self.field.grid.contains(row, col):
            return
        state, reach = self.state, len(cells) // 2
        around = (slice(max(row - reach, 0), row + reach + 1),
                  slice(max(col - reach, 0), col + reach + 1))
        before = state.ground.known[around].copy()
        remember_cells(state.ground.known, state.seen, row, col, cells)
        after = state.ground.known[around]
        state.ground.factor[around][is_doubted(before) & ~is_doubted(after)] = 1.0
        if ((before == BLOCKED) & (after == 0)).any():
            search_anew(state.flood)  # a way may have opened

    def taught(self, row: int, col: int, heading: int, blocked: int, unknown: int,
               stamp: float) -> npt.NDArray[np.void]:
        """
        Note a step that a person drove; it earns nothing here and becomes a prototype later.

        Returns
        -------
        ndarray of DECISION_DTYPE, shape (1,)
            The row to publish.

        """
        take_in_local_grid(self.state, row, col, blocked, unknown)
        self.n_steps += 1
        log = self._empty_log()
        n = write_row(log, 0, Transition(row, col, heading, row + STEP_ROW[heading],
                                         col + STEP_COL[heading], 0.0),
                      Kind.TAUGHT, blocked, self.n_steps)
        return self._publish(log[:n], unknown, stamp)

    def allowed(self, row: int, col: int) -> int:
        """Return the mask of the steps that local grid and remembered map allow from a cell."""
        return int(allowed_steps(self.state.ground.known, row, col, self.state.ground.rules))

    @property
    def doubt(self) -> str:
        """Say which walls are doubted because no way was left; empty while there is one."""
        n = int(self.state.n_doubted[0])
        return '' if not n else (
            f'no way is left on the remembered map: the robot doubts the {counted(n, "wall")} '
            f'that it has not seen in this trial and goes to look')

    def _no_way(self) -> str:
        """Say why no step is left to try."""
        n = int(self.state.n_doubted[0])
        if not self._options.doubts:
            return 'no way to the goal is left on the remembered map'
        doubted = f', {counted(n, "doubted wall")} among it' if n else ''
        return f'no way to the goal is left: this trial has seen what is closed{doubted}'

    @staticmethod
    def _empty_log() -> npt.NDArray[np.int32]:
        return np.zeros((2, len(LOGGED)), dtype=np.int32)

    def _publish(
        self, log: npt.NDArray[np.int32], unknown: int, stamp: float,
    ) -> npt.NDArray[np.void]:
        table = decisions_from_log(log, self._trial, self.field.revision)
        table['unknown'], table['stamp'] = unknown, stamp
        self.n_decisions += len(table)
        return table

    def _give_up(self, reason: str, rows: npt.NDArray[np.void] | None = None) -> Choice:
        rows = np.zeros(0, dtype=DECISION_DTYPE) if rows is None else rows
        return Choice(-1, Kind.AVOID, reason, rows)
