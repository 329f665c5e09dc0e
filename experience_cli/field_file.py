"""A field in a file that others can follow: NumPy's .npz."""

from pathlib import Path

import numpy as np

from control_field.grid import Grid
from control_field.headings import UNIT
from control_field.learning.learner import Refresh
from experience_cli.output import write_output


def save_field(path: Path, refresh: Refresh, grid: Grid) -> None:
    """
    Write field and prototypes.

    Arrays: ``vx``, ``vy`` (rows x cols, row 0 at the lowest y), ``centres`` (n, 2) [m],
    ``actions`` (n, 2) unit vectors, ``q`` (n,), ``origin`` (2,) [m], ``resolution`` [m],
    ``q_matrix`` (rows, cols, 8), ``known`` (rows, cols), ``goal`` (2,) row and column,
    ``revision`` (from how many bags it was learnt), ``demonstrated`` (n,).

    Raises
    ------
    UserError
        If the file cannot be written.

    """
    field, prototypes = refresh.field, refresh.prototypes
    write_output(path, lambda file: np.savez_compressed(
        file, vx=field.vx, vy=field.vy, centres=grid.world_from_cells(prototypes.cells),
        actions=UNIT[prototypes.headings], q=prototypes.q,
        origin=np.array([grid.origin_x, grid.origin_y]), resolution=np.array(grid.resolution),
        q_matrix=field.q, known=field.known, goal=np.array(field.goal),
        revision=np.array(field.revision), demonstrated=prototypes.demonstrated))
