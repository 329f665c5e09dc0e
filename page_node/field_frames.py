"""Fields and prototypes as the page draws them: header and arrays of big frames."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.homeward import leads_home
from control_field.kernels.steps import StepRules
from control_field.records import CellFlag, ControlField, Prototypes

#: Bits of `flags` beside those of `CellFlag`.
HOME: Final = 16
HEADING: Final = 32
#: Of a robot that moves in all eight headings, and cuts no corner.
USUAL_RULES: Final = StepRules(corner_cutting=False, unknown_is_blocked=False, moves=8)

Frame = tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]


def field_frame(field: ControlField, rules: StepRules = USUAL_RULES) -> Frame:
    """
    Return header and arrays of a field: where it points, what is known, who gets home.

    ``angle`` is in 256ths of a turn, counter-clockwise from +x; ``flags`` are those of `CellFlag`,
    `HOME` where following it reaches the goal, `HEADING` where it points anywhere; ``known`` is
    the remembered map. A field of nothing learnt has no goal.
    """
    turns = np.arctan2(field.vy, field.vx) / (2.0 * np.pi)
    points = (field.vx != 0.0) | (field.vy != 0.0)
    flags = field.flags | points * np.uint8(HEADING)
    if not field.is_void:
        flags |= leads_home(field, rules) * np.uint8(HOME)
        flags[field.goal] |= CellFlag.GOAL
    return {**_place(field.grid), 'revision': field.revision}, {
        'angle': (np.round(256.0 * np.nan_to_num(turns)).astype(np.int64) % 256).astype(np.uint8),
        'flags': flags, 'known': field.known}


def ground_frame(grid: Grid, known: npt.NDArray[np.int8]) -> Frame:
    """Return header and arrays of a field that points nowhere, for ground that is known."""
    nothing = np.zeros(grid.shape, dtype=np.uint8)
    return {**_place(grid), 'revision': -1}, {
        'angle': nothing, 'flags': nothing, 'known': known}


def prototypes_frame(prototypes: Prototypes, grid: Grid) -> Frame:
    """Return header and arrays of prototypes, whose cells are those of a grid."""
    xy = grid.world_from_cells(prototypes.cells).astype(np.float32)
    return {}, {
        'x': xy[:, 0], 'y': xy[:, 1], 'q': prototypes.q.astype(np.float32),
        'heading': prototypes.headings, 'demonstrated': prototypes.demonstrated.astype(np.uint8)}


def _place(grid: Grid) -> dict[str, Any]:
    return {'rows': grid.n_rows, 'cols': grid.n_cols, 'resolution': grid.resolution,
            'origin': [grid.origin_x, grid.origin_y], 'frame': grid.frame_id}
