"""Compiling or loading the kernels before the first person waits for them."""

import numpy as np

from control_field.grid import Grid
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import DECISION_DTYPE, Demonstration, Kind, Outcome, Trial


def warm_up_kernels(parameters: Parameters) -> None:
    """
    Learn a drive of five cells and a trial with everything in it, and forget them.

    With an empty cache numba compiles for about ten seconds, else it loads for half a one.
    """
    cells = np.array([(1, col) for col in range(1, 6)], dtype=np.int32)
    none, stamps = np.zeros(len(cells), dtype=np.uint8), np.arange(5.0)
    learner = Learner(Grid(7, 7, 1.0), parameters)
    learner.add_demonstration(Demonstration(cells, stamps, none, none.copy(), 1))
    rows = np.zeros(4, dtype=DECISION_DTYPE)
    rows['row'], rows['col'] = 1, (1, 2, 2, 3)
    rows['next_row'], rows['next_col'] = (1, 1, 2, 2), (2, 2, 3, 4)
    rows['action'], rows['reward'] = (0, 0, 1, 0), (0, -1, 1, 0)
    rows['kind'] = (Kind.FIELD, Kind.BLOCKED, Kind.AVOID, Kind.FIELD)
    rows['blocked'] = (0, 1, 1, 0)
    for outcome in (Outcome.GOAL, Outcome.GAVE_UP):
        learner.add_trial(Trial(rows.copy(), outcome, 2))
    learner.next_starts(1, np.random.default_rng(0))
    learner.trial_field(exploring=True)
