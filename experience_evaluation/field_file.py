"""The field file: enough for somebody else to follow the flow and check every number."""

import io

import numpy as np
import numpy.typing as npt

from control_field.headings import UNIT
from experience_evaluation.environment import Environment
from experience_evaluation.methods.method import FieldMethod, Method, Task

Columns = dict[str, npt.NDArray[np.generic]]


def field_columns(method: Method, task: Task, environment: Environment,
                  demonstrated: npt.NDArray[np.int8]) -> Columns:
    """
    Return what is written of a method as it stands, by name.

    ``vx, vy`` (n_rows, n_cols), row 0 at the lowest y; ``centres`` (n, 2) [m]; ``actions`` (n, 2)
    unit vectors; ``q, weights`` (n,); ``q_matrix`` (n_rows, n_cols, 8); ``known`` (n_rows,
    n_cols): the remembered map; ``shown`` (n_rows, n_cols): demonstrated headings, -1 for none;
    ``reachable`` (n_rows, n_cols): free cells of the true world with a way to the goal; ``goal``
    (x, y) [m], ``origin`` (x, y) [m], ``resolution`` [m], ``power``, ``window`` [cells],
    and the rules of a step: ``corner_cutting``, ``moves``.

    Parameters
    ----------
    method : Method
    task : Task
    environment : Environment
        What is true now.
    demonstrated : ndarray of int8, shape (n_rows, n_cols)
        Demonstrated headings, for a method that does not remember them itself.

    """
    grid, parameters = task.grid, task.parameters
    columns: Columns = {
        'goal': np.array(grid.world_from_cell(*task.goal)),
        'origin': np.array([grid.origin_x, grid.origin_y]),
        'resolution': np.array(grid.resolution), 'power': np.array(parameters.power),
        'window': np.array(parameters.effective_window),
        'corner_cutting': np.array(parameters.corner_cutting),
        'moves': np.array(parameters.moves), 'reachable': environment.reachable,
        'shown': demonstrated}
    return columns | (_of_field(method) if isinstance(method, FieldMethod) else _of_other(method))


def _of_field(method: FieldMethod) -> Columns:
    refresh = method.refresh
    field, prototypes = refresh.field, refresh.prototypes
    return {
        'vx': field.vx, 'vy': field.vy, 'q_matrix': field.q, 'known': field.known,
        'centres': field.grid.world_from_cells(prototypes.cells),
        'actions': UNIT[prototypes.headings], 'q': prototypes.q,
        'weights': refresh.composition.weights, 'shown': method.learner.memory.demonstrated}


def _of_other(method: Method) -> Columns:
    headings = method.headings()
    unit = np.where(headings[..., np.newaxis] >= 0, UNIT[headings], 0.0)
    values = getattr(method, 'q', np.zeros((headings.size, 8)))
    return {
        'vx': unit[..., 0], 'vy': unit[..., 1],
        'q_matrix': np.asarray(values).reshape(*headings.shape, 8),
        'known': getattr(method, 'known', np.full(headings.shape, -1, dtype=np.int8)),
        'centres': np.zeros((0, 2)), 'actions': np.zeros((0, 2)), 'q': np.zeros(0),
        'weights': np.zeros(0)}


def npz_bytes(columns: Columns) -> bytes:
    """Return the content of a field file (``.npz``)."""
    content = io.BytesIO()
    np.savez_compressed(content, **columns)  # type: ignore[arg-type, unused-ignore]
    return content.getvalue()
