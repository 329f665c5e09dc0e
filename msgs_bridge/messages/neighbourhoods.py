"""Occupancy grids: the robot's 3x3 local grid, and whole maps."""

from dataclasses import dataclass
from typing import Any, Final

from nav_msgs.msg import OccupancyGrid
import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from msgs_bridge.messages.poses import (
    check_frame, MAX_PLACE, seconds_from_stamp, stamp_from_seconds, yaw_from_quaternion)

#: How far a neighbourhood may lie off the workspace's cells, in cells, and its resolution off
#: the workspace's, as a share. The message carries the resolution as float32.
ALIGNMENT_TOLERANCE: Final = 0.01
RESOLUTION_TOLERANCE: Final = 1e-4
#: How far a grid may be turned, [rad].
MAX_TURN: Final = 1e-3
#: Sides of cells that a grid may have, [m].
RESOLUTIONS: Final = (1e-5, 1e5)


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """
    What the robot observed around its cell.

    Parameters
    ----------
    stamp : float, [s]
        When.
    row, col : int
        The cell in the middle.
    cells : ndarray of int8, shape (3, 3)
        0 free, 100 blocked, -1 unknown; row 0 at the lowest y.
    frame_id : str
        The frame of the grid that ``row, col`` belong to.

    Raises
    ------
    ValueError
        If the shape or a state is another.

    """

    stamp: float
    row: int
    col: int
    cells: npt.NDArray[np.int8]
    frame_id: str = 'odom'

    def __post_init__(self) -> None:
        """Check the shape and the states."""
        if self.cells.shape != (3, 3):
            raise ValueError(f'neighbourhood: shape is {self.cells.shape}, must be (3, 3)')
        for state in self.cells.ravel().tolist():
            if state not in (FREE, BLOCKED, UNKNOWN):
                raise ValueError(f'neighbourhood: a cell is {state}, must be 0, 100 or -1')


def grid_from_neighbourhood(neighbourhood: Neighbourhood, grid: Grid) -> OccupancyGrid:
    """Write a neighbourhood as a 3x3 OccupancyGrid on the cells of ``grid``."""
    nine = Grid(
        3, 3, grid.resolution,
        grid.origin_x + (neighbourhood.col - 1) * grid.resolution,
        grid.origin_y + (neighbourhood.row - 1) * grid.resolution, neighbourhood.frame_id)
    return map_from_occupancy(neighbourhood.cells, nine, neighbourhood.stamp)


def cells_of_local_grid(msg: Any) -> Grid:
    """
    Return the nine cells of a 3x3 OccupancyGrid as a workspace of their own.

    Raises
    ------
    ValueError
        If the size, data length, resolution or origin is wrong.

    """
    nine, _ = _read(msg, 'neighbourhood')
    if nine.shape != (3, 3):
        raise ValueError(f'neighbourhood: size is {nine.n_rows} x {nine.n_cols}, must be 3 x 3')
    return nine


def neighbourhood_from_grid(msg: Any, grid: Grid) -> Neighbourhood:
    """
    Read a 3x3 OccupancyGrid that lies on the cells of ``grid``.

    Raises
    ------
    ValueError
        If the frame, size, resolution, data length, alignment, middle cell or a state is wrong;
        the message names what it is and what it must be.

    """
    name = 'neighbourhood'
    check_frame(msg.header.frame_id, grid.frame_id, name)
    size = msg.info.height, msg.info.width
    if size != (3, 3):
        raise ValueError(f'{name}: size is {size[0]} x {size[1]}, must be 3 x 3')
    nine, cells = _read(msg, name)
    if abs(nine.resolution - grid.resolution) > RESOLUTION_TOLERANCE * grid.resolution:
        raise ValueError(
            f'{name}: resolution is {nine.resolution:.7g} m, must be {grid.resolution:.7g} m')
    col = _cell(nine.origin_x - grid.origin_x, grid.resolution, name) + 1
    row = _cell(nine.origin_y - grid.origin_y, grid.resolution, name) + 1
    if not grid.contains(row, col):
        raise ValueError(f'{name}: its middle is cell ({row}, {col}), '
                         f'must be in the workspace of {grid.n_rows} x {grid.n_cols}')
    return Neighbourhood(_stamp(msg, name), row, col, cells, grid.frame_id)


def occupancy_from_map(msg: Any, name: str = 'map') -> tuple[Grid, npt.NDArray[np.int8]]:
    """
    Read an OccupancyGrid of any size.

    Parameters
    ----------
    msg : OccupancyGrid
        What arrived.
    name : str
        What an error calls it.

    Returns
    -------
    grid : Grid
        Its cells, in its own frame.
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        -1 unknown, 0 to 100 otherwise, as it was sent.

    Raises
    ------
    ValueError
        If sizes, data length, resolution, origin or a value is wrong.

    """
    grid, occupancy = _read(msg, name)
    low, high = int(occupancy.min()), int(occupancy.max())
    if low < -1 or high > 100:
        raise ValueError(f'{name}: values reach from {low} to {high}, must be -1 to 100')
    return grid, occupancy


def map_from_occupancy(
    occupancy: npt.NDArray[np.int8], grid: Grid, stamp: float = 0.0,
) -> OccupancyGrid:
    """
    Write an OccupancyGrid.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked, -1 unknown.
    grid : Grid
        Its cells.
    stamp : float, [s]
        Of the header and of the map's making.

    Raises
    ------
    ValueError
        If the shape is not the grid's.

    """
    if occupancy.shape != grid.shape:
        raise ValueError(f'occupancy has shape {occupancy.shape}, must be {grid.shape}')
    msg = OccupancyGrid()
    msg.header.frame_id = grid.frame_id
    msg.header.stamp = msg.info.map_load_time = stamp_from_seconds(stamp)
    msg.info.resolution = float(grid.resolution)
    msg.info.height, msg.info.width = grid.shape
    msg.info.origin.position.x = float(grid.origin_x)
    msg.info.origin.position.y = float(grid.origin_y)
    msg.data.frombytes(np.ascontiguousarray(occupancy, dtype=np.int8).tobytes())
    return msg


def _read(msg: Any, name: str) -> tuple[Grid, npt.NDArray[np.int8]]:
    """Check everything about an OccupancyGrid but its values."""
    height, width, n_data = msg.info.height, msg.info.width, len(msg.data)
    if not n_data or height * width != n_data:
        raise ValueError(f'{name}: {n_data} cells of data, must be {height} x {width}, at least 1')
    origin = msg.info.origin
    try:
        turn = origin.orientation
        yaw = yaw_from_quaternion(turn.x, turn.y, turn.z, turn.w)
        if abs(yaw) > MAX_TURN:
            raise ValueError(f'origin is turned by {yaw:.3f} rad, must be 0')
        grid = Grid(height, width, _short_float(msg.info.resolution),
                    origin.position.x, origin.position.y, msg.header.frame_id)
        _check_size(grid)
    except ValueError as error:
        raise ValueError(f'{name}: {error}') from None
    cells = np.array(msg.data, dtype=np.int8).reshape(height, width)
    return grid, cells


def _check_size(grid: Grid) -> None:
    """Refuse a grid whose cells have no numbers that can be computed with."""
    low, high = RESOLUTIONS
    if not low <= grid.resolution <= high:
        raise ValueError(f'resolution is {grid.resolution:g} m, must be {low:g} to {high:g}')
    if not (abs(grid.origin_x) <= MAX_PLACE and abs(grid.origin_y) <= MAX_PLACE):
        raise ValueError(f'origin is ({grid.origin_x:g}, {grid.origin_y:g}) m, must be within '
                         f'{MAX_PLACE:g} m')


def _short_float(value: float) -> float:
    """Return the shortest decimal that has the same float32: 0.25, not 0.2500000037."""
    return float(str(np.float32(value)))


def _cell(offset: float, resolution: float, name: str) -> int:
    cells = offset / resolution
    nearest = round(cells)
    if abs(cells - nearest) > ALIGNMENT_TOLERANCE:
        raise ValueError(f'{name}: origin lies {cells - nearest:+.3f} cells off those of the '
                         f'workspace, must lie on them')
    return nearest


def _stamp(msg: Any, name: str) -> float:
    try:
        return seconds_from_stamp(msg.header.stamp)
    except ValueError as error:
        raise ValueError(f'{name}: {error}') from None
