"""Occupancy grids: the robot's local grid, and whole maps."""

from dataclasses import dataclass
import math
from typing import Any, Final

from nav_msgs.msg import OccupancyGrid
import numpy as np
import numpy.typing as npt

from control_field.grid import cell_side, Grid
from control_field.local_grid import (
    BLOCKED, cells_from_fine, FREE, is_local_grid_size, MAX_SIDE, middle_of, SUBDIVISIONS, UNKNOWN)
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


#: Bytes that cells may consist of.
_STATES: Final = frozenset(np.array([FREE, BLOCKED, UNKNOWN], dtype=np.int8).tobytes())


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
    cells : ndarray of int8, shape (n, n)
        0 free, 100 blocked, -1 unknown; row 0 at the lowest y; n odd, 3 to 61.
    frame_id : str
        The frame of the grid that ``row, col`` belong to.
    fine : ndarray of int8, shape (n * k, n * k), optional
        The same in finer cells, k of them along a side of a cell: 3 or 5.

    Raises
    ------
    ValueError
        If a shape or a state is another.

    """

    stamp: float
    row: int
    col: int
    cells: npt.NDArray[np.int8]
    frame_id: str = 'odom'
    fine: npt.NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        """Check shapes and states."""
        n = len(self.cells)
        if self.cells.shape != (n, n) or not is_local_grid_size(n):
            raise ValueError(f'neighbourhood: shape is {self.cells.shape}, must be square, of an '
                             f'odd number from 3 to {MAX_SIDE}')
        _check_states(self.cells)
        if self.fine is not None:
            if self.fine.shape not in [(n * k, n * k) for k in SUBDIVISIONS]:
                raise ValueError(f'neighbourhood: shape of the finer cells is {self.fine.shape}, '
                                 f'must be 3 or 5 times {self.cells.shape}')
            _check_states(self.fine)

    @property
    def nine(self) -> npt.NDArray[np.int8]:
        """Return the 3x3 in the middle, which decisions go by."""
        return middle_of(self.cells)

    @property
    def finest(self) -> npt.NDArray[np.int8]:
        """Return the same 3x3 as finely as it is seen, shape (3 * k, 3 * k)."""
        if self.fine is None:
            return self.nine
        n, k = len(self.fine), len(self.fine) // len(self.cells)
        low = (n - 3 * k) // 2
        return self.fine[low:low + 3 * k, low:low + 3 * k]

    @property
    def is_wide(self) -> bool:
        """Return whether it shows more than the cells around the robot's."""
        return len(self.cells) > 3


def _check_states(cells: npt.NDArray[np.int8]) -> None:
    """Refuse states that a local grid does not have."""
    if cells.dtype == np.int8 and _STATES.issuperset(cells.tobytes()):
        return
    other = cells[~np.isin(cells, (FREE, BLOCKED, UNKNOWN))]
    what = other.flat[0] if other.size else cells.dtype
    raise ValueError(f'neighbourhood: a cell is {what}, must be 0, 100 or -1 (int8)')


def grid_from_neighbourhood(neighbourhood: Neighbourhood, grid: Grid) -> OccupancyGrid:
    """Write a neighbourhood as an OccupancyGrid on the cells of ``grid``, or on finer ones."""
    cells = neighbourhood.cells if neighbourhood.fine is None else neighbourhood.fine
    n, reach = len(cells), len(neighbourhood.cells) // 2
    local = Grid(
        n, n, grid.resolution * len(neighbourhood.cells) / n,
        grid.origin_x + (neighbourhood.col - reach) * grid.resolution,
        grid.origin_y + (neighbourhood.row - reach) * grid.resolution, neighbourhood.frame_id)
    return map_from_occupancy(cells, local, neighbourhood.stamp)


def cells_of_local_grid(msg: Any, robot_radius: float | None = None) -> Grid:
    """
    Return the cells of a local grid as a workspace of their own.

    Parameters
    ----------
    msg : OccupancyGrid
    robot_radius : float, optional, [m]
        Its cells, or 3 or 5 of them along a side, are cells of this robot, as nearly as may be;
        by default they are cells.

    Raises
    ------
    ValueError
        If the size, data length, resolution or origin is wrong.

    """
    local, _ = _read(msg, 'neighbourhood')
    k = _divided(local, None if robot_radius is None else cell_side(robot_radius))
    return Grid(local.n_rows // k, local.n_rows // k, local.resolution * k, local.origin_x,
                local.origin_y, local.frame_id)


def _divided(local: Grid, side: float | None) -> int:
    """Return how many of its cells make up a side of one that is as large as it should be."""
    ways = [k for k in SUBDIVISIONS
            if local.n_rows % k == 0 and is_local_grid_size(local.n_rows // k)]
    _check_size_of(local.shape, ways[0] if ways else 1)
    return ways[0] if side is None else min(
        ways, key=lambda k: abs(math.log(local.resolution * k / side)))


def lattice_from_local_grid(msg: Any, side: float) -> Grid:
    """
    Return cells that a local grid lies on, or that 3 or 5 of its own make up along a side.

    Parameters
    ----------
    msg : OccupancyGrid
    side : float, [m]
        How large they should be; what is nearest to it is taken.

    Returns
    -------
    Grid
        A cell of them.

    Raises
    ------
    ValueError
        If the size, data length, resolution or origin is wrong.

    """
    local, _ = _read(msg, 'neighbourhood')
    k = _divided(local, side)
    # A third that was rounded to single precision, thrice, is the whole again.
    resolution = local.resolution if k == 1 else float(f'{local.resolution * k:.6g}')
    return Grid(1, 1, resolution, local.origin_x, local.origin_y, local.frame_id).lattice


def neighbourhood_from_grid(msg: Any, grid: Grid, bounded: bool = True) -> Neighbourhood:
    """
    Read a local grid that lies on the cells of ``grid``, or on finer ones, 3 or 5 a side.

    A cell is blocked if one of its finer ones is, else unknown if one of them is, else free.

    Parameters
    ----------
    msg : OccupancyGrid
    grid : Grid
        The workspace, or any rectangle of its cells.
    bounded : bool
        Whether the robot's cell must be one of the workspace; else it may lie anywhere.

    Raises
    ------
    ValueError
        If the frame, size, resolution, data length, alignment, middle cell or a state is wrong;
        the message names what it is and what it must be.

    """
    name = 'neighbourhood'
    check_frame(msg.header.frame_id, grid.frame_id, name)
    size = msg.info.height, msg.info.width
    if size[0] != size[1] or size[0] > MAX_SIDE * SUBDIVISIONS[-1]:
        _check_size_of(size, 1)
    local, cells = _read(msg, name)
    k = _subdivision(local.resolution, grid)
    _check_size_of(size, k)
    reach = size[0] // k // 2
    col = _cell(local.origin_x - grid.origin_x, grid.resolution, name) + reach
    row = _cell(local.origin_y - grid.origin_y, grid.resolution, name) + reach
    if bounded and not grid.contains(row, col):
        raise ValueError(f'{name}: its middle is cell ({row}, {col}), '
                         f'must be in the workspace of {grid.n_rows} x {grid.n_cols}')
    _check_states(cells)
    return Neighbourhood(_stamp(msg, name), row, col, cells_from_fine(cells, k), grid.frame_id,
                         cells if k > 1 else None)


def _subdivision(resolution: float, grid: Grid) -> int:
    """Return how many cells of a resolution [m] lie along a side of the workspace's."""
    for k in SUBDIVISIONS:
        if abs(resolution * k - grid.resolution) <= RESOLUTION_TOLERANCE * grid.resolution:
            return k
    raise ValueError(f'neighbourhood: resolution is {resolution:.7g} m, must be '
                     f'{grid.resolution:.7g} m, or a third or a fifth of it')


def _check_size_of(size: tuple[int, int], k: int) -> None:
    """Refuse a local grid that has no middle cell, or is too large."""
    rows, cols = size
    if rows != cols or rows % k or not is_local_grid_size(rows // k):
        of = f', each of {k} x {k} finer ones' if k > 1 else ''
        raise ValueError(f'neighbourhood: size is {rows} x {cols}, must be square, of an odd '
                         f'number of cells from 3 to {MAX_SIDE}{of}')


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
