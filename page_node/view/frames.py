"""Frames for the page: what has arrived, as numbers and arrays that a browser draws."""

from collections.abc import Mapping, Sequence
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.records import CellFlag, ControlField, Prototypes
from msgs_bridge.messages.poses import Pose
from page_node.view.basin import cells_that_lead_home

#: Bits of a cell's flags on the page, beside those of `CellFlag`.
LEADS_HOME: Final = 16
HAS_HEADING: Final = 32
#: Most discs that are drawn: whoever publishes more draws no people.
_MOST_DISCS: Final = 500

Arrays = Mapping[str, npt.NDArray[Any]]
Content = dict[str, Any]


def robot_frame(pose: Pose, radius: float) -> Content:
    """Return where the robot is, how fast, and how large."""
    return {'stamp': round(pose.stamp, 3), 'x': round(pose.x, 4), 'y': round(pose.y, 4),
            'yaw': round(pose.yaw, 4), 'v': round(pose.v, 4), 'w': round(pose.w, 4),
            'radius': radius}


def sight_frame(grid: Grid, cells: npt.NDArray[np.int8]) -> Content:
    """Return a local grid, its lower left corner and its cells row by row."""
    return {'rows': grid.n_rows, 'cols': grid.n_cols, 'resolution': grid.resolution,
            'x0': grid.origin_x, 'y0': grid.origin_y, 'cells': cells.ravel().tolist()}


def field_frame(field: ControlField) -> tuple[Content, Arrays]:
    """
    Return a field: an angle a cell in 256ths of a turn, what is known of it, and flags.

    The flags are those of `CellFlag`, `LEADS_HOME` and `HAS_HEADING`; a field of nothing learnt
    has no goal.
    """
    turns = np.arctan2(field.vy, field.vx) / math.tau
    angle = (np.rint(turns * 256.0).astype(np.int64) % 256).astype(np.uint8)
    has_heading = (field.vx != 0.0) | (field.vy != 0.0)
    flags = field.flags | (has_heading * np.uint8(HAS_HEADING))
    if not field.is_void:
        flags |= cells_that_lead_home(field) * np.uint8(LEADS_HOME)
        flags[field.goal] |= CellFlag.GOAL
    content = {**_grid_content(field.grid), 'frame': field.grid.frame_id,
               'revision': field.revision}
    return content, {'angle': angle, 'flags': flags.astype(np.uint8), 'known': field.known}


def prototypes_frame(prototypes: Prototypes, grid: Grid) -> tuple[Content, Arrays]:
    """Return where prototypes are, [m], where each leads, what it is worth and who showed it."""
    xy = grid.world_from_cells(prototypes.cells).astype(np.float32)
    return {}, {'x': xy[:, 0].copy(), 'y': xy[:, 1].copy(), 'q': prototypes.q.astype(np.float32),
                'heading': prototypes.headings,
                'demonstrated': prototypes.demonstrated.astype(np.uint8)}


def truth_frame(grid: Grid, occupancy: npt.NDArray[np.int8]) -> tuple[Content, Arrays]:
    """Return the map of a simulator, which the robot does not know."""
    return _grid_content(grid), {'occupancy': occupancy}


def _grid_content(grid: Grid) -> Content:
    return {'rows': grid.n_rows, 'cols': grid.n_cols, 'resolution': grid.resolution,
            'origin': [grid.origin_x, grid.origin_y]}


def movers_frame(markers: Sequence[Any]) -> Content:
    """Return what moves as discs: x, y and radius, [m]."""
    discs = [(marker.pose.position.x, marker.pose.position.y, 0.5 * marker.scale.x)
             for marker in markers[:_MOST_DISCS] if marker.action == marker.ADD]
    return {'discs': [[round(value, 3) for value in disc] for disc in discs
                      if all(map(math.isfinite, disc))]}


def decision_frame(decisions: npt.NDArray[np.void], grid: Grid | None) -> Content:
    """Return the newest decision; with the place of its cell where the workspace is known."""
    newest = decisions[-1]
    row, col = int(newest['row']), int(newest['col'])
    place = {} if grid is None else dict(zip(('x', 'y'), grid.world_from_cell(row, col),
                                             strict=True))
    return {'row': row, 'col': col, 'heading': int(newest['action']), 'kind': int(newest['kind']),
            'reward': int(newest['reward']), **place}
