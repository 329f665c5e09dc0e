"""What has come into the way of a trial, and whether it is waited for. ROS-free."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import StepRules
from control_field.kernels.waiting import comes_into_the_way
from control_field.local_grid import BLOCKED, FREE
from control_field.robot.patience import Patience
from control_field_node.observation import Observation

Cell = tuple[int, int]
_STEPS: Final = tuple(zip(STEP_ROW.tolist(), STEP_COL.tolist(), strict=True))


class WayWatch:
    """
    Remembers where there was room in a trial, and tells what is in the way there now.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map; it is copied.
    rules : StepRules
    patience : float, [s]
        How long is waited; 0: never.

    Attributes
    ----------
    n_gone : int
        How many cells something has gone from, be it that it came or was there from the start.

    """

    def __init__(self, known: npt.NDArray[np.int8], rules: StepRules, patience: float) -> None:
        """Start with what is remembered."""
        self.n_gone = 0
        self._room = known.copy()
        self._came = np.zeros(known.shape, dtype=np.bool_)
        self._rules = rules
        self._patience = Patience(patience)
        self._last: Observation | None = None

    def learn(self, known: npt.NDArray[np.int8]) -> None:
        """Take over from a refreshed map what was not seen before."""
        fresh = (self._room < 0) & (known >= 0)
        self._room[fresh] = known[fresh]

    def look(self, observation: Observation) -> None:
        """Take in what is observed; where there was room, there may be again."""
        if observation is self._last:
            return
        self._last = observation
        self._room[observation.cell] = FREE
        for cell, is_blocked in observation.around():
            self.n_gone += not is_blocked and (
                bool(self._came[cell]) or self._room[cell] == BLOCKED)
            self._came[cell] = is_blocked and (self._came[cell] or self._room[cell] == FREE)
            if not is_blocked:
                self._room[cell] = FREE
            elif self._room[cell] != FREE:
                self._room[cell] = BLOCKED

    def forgive(self) -> npt.NDArray[np.bool_]:
        """Return where something has come and was not seen to go; it is waited for once more."""
        self._room[self._came] = FREE
        return self._came

    def is_to_wait(
        self, stamp: float, cell: Cell, heading: int, observation: Observation,
    ) -> bool:
        """
        Return whether to wait before a step, or in the middle of it.

        Parameters
        ----------
        stamp : float, [s]
        cell : tuple of int
            Where the step begins.
        heading : int
            Of the step; -1 for none.
        observation : Observation

        """
        if not observation.blocked:
            return self._patience.lasts(stamp, None)
        blocked = {there for there, is_blocked in observation.around() if is_blocked}
        mask = sum(1 << k for k, (d_row, d_col) in enumerate(_STEPS)
                   if (cell[0] + d_row, cell[1] + d_col) in blocked)
        is_in_the_way = heading >= 0 and comes_into_the_way(
            self._room, *cell, heading, mask, self._rules)
        if not is_in_the_way:
            return self._patience.lasts(stamp, None)
        if self._patience.lasts(stamp, (cell, heading)):
            return True
        for there in blocked:  # what has stood for so long stays
            self._room[there] = BLOCKED
        return False
