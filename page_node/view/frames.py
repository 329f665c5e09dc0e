"""Frames for the page: what has arrived, as numbers and arrays that a browser draws."""

from collections.abc import Mapping, Sequence
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from msgs_bridge.messages.poses import Pose

#: Most discs that are drawn: whoever publishes more draws no people.
_MOST_DISCS: Final = 500

Arrays = Mapping[str, npt.NDArray[Any]]
Content = dict[str, Any]


def robot_frame(pose: Pose, radius: float) -> Content:
    """Return where the robot is, how fast, and how large."""
    return {'stamp': round(pose.stamp, 3), 'x': round(pose.x, 4), 'y': round(pose.y, 4),
            'yaw': round(pose.yaw, 4), 'v': round(pose.v, 4), 'w': round(pose.w, 4),
            'radius': radius}


def local_grid_frame(grid: Grid, cells: npt.NDArray[np.int8]) -> Content:
    """Return a local grid, its lower left corner and its cells row by row."""
    return {'rows': grid.n_rows, 'cols': grid.n_cols, 'resolution': grid.resolution,
            'x0': grid.origin_x, 'y0': grid.origin_y, 'cells': cells.ravel().tolist()}


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
