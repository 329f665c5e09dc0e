"""What has come into the way of a trial, and whether it is waited for. ROS-free."""

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.kernels.decision import TrialState
from control_field.kernels.steps import StepRules
from control_field.kernels.waiting import (
    GIVE_UP, look_again, look_ahead, n_looks, new_record, take_in, WAIT)
from control_field.robot.other_workspace import moved_record
from control_field.robot.patience import SteadyTime
from control_field_node.inputs.observation import Observation


class WayWatch:
    """
    Keeps the `WayRecord` of a trial by what is observed, and asks it.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map; it is copied.
    rules : StepRules
    patience : float, [s]
        How long is waited; 0: never.

    """

    def __init__(self, known: npt.NDArray[np.int8], rules: StepRules, patience: float) -> None:
        """Start with what is remembered."""
        self._record = new_record(known)
        self._rules = rules
        self._patience = patience
        self._time = SteadyTime()
        self._last: Observation | None = None

    @property
    def n_looks(self) -> int:
        """Return how often the trial has looked again since it last looked at everything."""
        return n_looks(self._record)

    def learn(self, known: npt.NDArray[np.int8]) -> None:
        """Take over from a refreshed map what was not seen before."""
        room = self._record.room
        fresh = (room < 0) & (known >= 0)
        room[fresh] = known[fresh]

    def move(self, old: Grid, new: Grid) -> None:
        """Go on in another workspace of the same lattice."""
        self._record = moved_record(self._record, old, new)
        self._last = None

    def look(self, observation: Observation) -> None:
        """Take in what is observed."""
        if observation is not self._last:
            self._last = observation
            take_in(self._record, *observation.cell, observation.cells)

    def is_to_wait(self, stamp: float, cell: tuple[int, int], heading: int) -> bool:
        """
        Return whether to wait before a step, or in the middle of it.

        Parameters
        ----------
        stamp : float, [s]
        cell : tuple of int
            Where the step begins.
        heading : int
            Of the step; -1 for none.

        """
        return look_ahead(self._record, self._time.at(stamp), self._patience, *cell, heading,
                          self._rules) == WAIT

    def looks_again(self, state: TrialState) -> bool:
        """Return whether a trial to which no way is left goes on, and looks; see `look_again`."""
        return look_again(
            self._record, self._patience, state.ground.known, state.seen) != GIVE_UP
