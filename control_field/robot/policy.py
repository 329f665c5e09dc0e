"""What the robot does in one trial (Case 1): the decisions between cell and cell."""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors, STEP_COL, STEP_ROW
from control_field.kernels import decision as trial_kernels
from control_field.kernels.steps import allowed_steps, remember_local_grid
from control_field.parameters import Parameters
from control_field.records import ControlField, DECISION_DTYPE, Kind

#: Backups that one decision may spend on rehearsing around the robot: about 10 ms in Python.
N_ONLINE_BACKUPS: Final = 400


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


def caution_factor(
    known: npt.NDArray[np.int8], parameters: Parameters,
) -> npt.NDArray[np.float64]:
    """
    Return what scales the length of a step into each cell: unseen ground counts as longer.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.

    """
    return np.where(known < 0, 1.0 + parameters.caution, 1.0)


def rules_of(parameters: Parameters) -> tuple[bool, bool, int]:
    """
    Return the rules of a step on the remembered map, as the kernels take them.

    Ground that was never seen counts as free there, or no way around would ever be found; what a
    robot keeps out of is what its local grid calls unknown when it is about to enter it.
    """
    return parameters.corner_cutting, False, parameters.moves


def options_of(parameters: Parameters) -> tuple[bool, float, float, int, int]:
    """Return the options of a choice as the kernels take them."""
    rehearsed = parameters.profile == 'full' and parameters.rehearsal
    return (rehearsed, parameters.effective_window, parameters.power,
            parameters.oscillation_limit, N_ONLINE_BACKUPS)


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

    """

    def __init__(self, field: ControlField, parameters: Parameters, rng: np.random.Generator,
                 trial: int) -> None:
        self._parameters = parameters
        self._rng = rng
        self._trial = trial
        shape = field.grid.shape
        self._known = field.known.copy()
        self._counts = np.zeros((*shape, 8), dtype=np.int32)
        self._entered = np.zeros(shape, dtype=np.int32)
        self._punished = np.zeros(shape, dtype=np.uint8)
        self.n_steps = 0
        self.n_reinforcements = 0
        self.n_decisions = 0
        self._take(field)

    def _take(self, field: ControlField) -> None:
        self.field = field
        self._headings = headings_from_vectors(field.vx, field.vy)
        self._q = field.q.astype(np.float64)
        rehearsed = options_of(self._parameters)[0]
        self._factor = caution_factor(self._known, self._parameters)
        self._cost = cost_from_q(self._q, self._parameters.discount) if rehearsed else (
            np.zeros(field.grid.shape))
        if rehearsed:
            self._cost[field.goal] = 0.0

    def replace_field(self, field: ControlField) -> None:
        """
        Go on with a refreshed field; what the local grid has shown in this trial is kept.

        Raises
        ------
        ValueError
            If the field is of another grid.

        """
        if field.grid != self.field.grid:
            raise ValueError(f'the field is of grid {field.grid}, the trial of {self.field.grid}')
        fresh = (self._known < 0) & (field.known >= 0)
        self._known[fresh] = field.known[fresh]
        self._take(field)

    def at_goal(self, row: int, col: int) -> bool:
        """Tell whether a cell is the goal."""
        return (row, col) == self.field.goal

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
        parameters = self._parameters
        # Kept out of until it is seen, which it may be from another cell.
        kept_out = blocked | unknown if parameters.unknown_is_blocked else blocked
        heading, kind, occupied, reward = trial_kernels.decide(
            row, col, kept_out, unknown & ~kept_out, self._headings, self._known, self._q,
            self._cost, self._factor, self._counts, self._entered, self._punished, self.field.goal,
            (parameters.learning_rate, parameters.discount), options_of(parameters),
            rules_of(parameters), self._rng)
        rows = []
        if occupied >= 0:
            rows.append(self._row(row, col, occupied, -1, Kind.BLOCKED, blocked, unknown, stamp))
        if heading < 0:
            return self._give_up('no way to the goal is left on the remembered map', rows)
        rows.append(self._row(row, col, heading, reward, Kind(kind), blocked, unknown, stamp))
        self.n_steps += 1
        return Choice(int(heading), Kind(kind), '', self._publish(rows))

    def taught(self, row: int, col: int, heading: int, blocked: int, unknown: int,
               stamp: float) -> npt.NDArray[np.void]:
        """
        Note a step that a person drove; it earns nothing here and becomes a prototype later.

        Returns
        -------
        ndarray of DECISION_DTYPE, shape (1,)
            The row to publish.

        """
        remember_local_grid(self._known, row, col, blocked, unknown)
        self.n_steps += 1
        return self._publish(
            [self._row(row, col, heading, 0, Kind.TAUGHT, blocked, unknown, stamp)])

    def allowed(self, row: int, col: int) -> int:
        """Return the mask of the steps that local grid and remembered map allow from a cell."""
        return int(allowed_steps(self._known, row, col, rules_of(self._parameters)))

    def _row(self, row: int, col: int, action: int, reward: int, kind: Kind, blocked: int,
             unknown: int, stamp: float) -> tuple[object, ...]:
        moved = kind != Kind.BLOCKED
        next_row = row + int(STEP_ROW[action]) * moved
        next_col = col + int(STEP_COL[action]) * moved
        return (stamp, self._trial, self.n_steps, self.field.revision, row, col, next_row,
                next_col, action, reward, kind, blocked, unknown)

    def _publish(self, rows: list[tuple[object, ...]]) -> npt.NDArray[np.void]:
        table = np.array(rows, dtype=DECISION_DTYPE)
        self.n_decisions += len(table)
        self.n_reinforcements += int((table['reward'] != 0).sum())
        return table

    def _give_up(self, reason: str, rows: list[tuple[object, ...]] | None = None) -> Choice:
        return Choice(-1, Kind.AVOID, reason, self._publish(rows or []))
