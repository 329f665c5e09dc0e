"""The decisions of a trial as a table."""

import numpy as np
import numpy.typing as npt

from control_field.kernels.decision import LOGGED
from control_field.records import DECISION_DTYPE


def decisions_from_log(
    log: npt.NDArray[np.int32], trial: int, revision: int,
) -> npt.NDArray[np.void]:
    """
    Return the decisions of a log as a table; a decision's stamp is its step.

    Parameters
    ----------
    log : ndarray of int32, shape (n, 9)
        Columns of `LOGGED`.
    trial, revision : int
        Number of the trial, and of the field.

    Returns
    -------
    ndarray of DECISION_DTYPE, shape (n,)

    """
    table = np.zeros(len(log), dtype=DECISION_DTYPE)
    for index, name in enumerate(LOGGED):
        table[name] = log[:, index]
    table['trial'], table['revision'], table['stamp'] = trial, revision, table['step']
    return table
