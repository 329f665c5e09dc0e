"""
The 3x3 neighbourhood from a laser scan: geometry, with poses and scan passed in.

A cell is *blocked* when a return lies in it, or so near its centre that the robot's disc would
touch it there; *free* when enough of its area lies in front of the returns and near to a ray
(rays that are far apart show nothing of what is between them); else *unknown*. Ranges mean what
REP-117 says: +inf is free up to the greatest range, -inf is something too near to measure, NaN and
whatever lies outside the limits of the sensor says nothing.
"""

from dataclasses import dataclass
import math
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from control_field.poses import Placement
from msgs_bridge.messages.poses import seconds_from_stamp
from msgs_bridge.sensing.laser_mount import Mount

#: Longest scan, and how many more or fewer ranges than its angles say a scan may have: drivers
#: differ by one, and some by as many as the motor's speed makes it.
MAX_RANGES: Final = 100_000
_SLACK: Final = 0.02
#: Points looked at along a side of a cell.
_N_POINTS: Final = 5
#: Cells around the nine, so that what lies beside them can explain a return as well.
_RIM: Final = 2

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scan:
    """
    A laser scan that was checked.

    Parameters
    ----------
    stamp : float, [s]
        Of the first ray.
    angle_min : float, [rad]
        Of the first ray, in the laser's frame.
    angle_increment : float, [rad]
        From ray to ray, not 0; negative for a laser that turns clockwise.
    reach : ndarray of float64, shape (n,), [m]
        How far each ray is known to be free; 0 where it says nothing.
    is_return : ndarray of bool, shape (n,)
        Whether the ray ended at something, at ``reach``.

    """

    stamp: float
    angle_min: float
    angle_increment: float
    reach: Floats
    is_return: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Body:
    """
    What stands between a scan and the cells.

    Parameters
    ----------
    radius : float, [m]
        Of the robot's disc; returns within it are the robot's own parts.
    accuracy : float, [m]
        How far a return may be off along its ray. So near an edge of a cell it is taken to be
        beyond it, where the surface is that it came from.
    seen_share : float, 0 to 1
        Share of a cell that must be seen before it is free.

    """

    radius: float
    accuracy: float = 0.02
    seen_share: float = 0.5


def scan_from_message(msg: Any, zero_is_no_return: bool = False, name: str = 'scan') -> Scan:
    """
    Read a LaserScan message.

    Parameters
    ----------
    msg : LaserScan
        What arrived.
    zero_is_no_return : bool
        Whether the driver writes 0 where REP-117 wants +inf.
    name : str
        What an error calls it.

    Raises
    ------
    ValueError
        If an angle is not finite, the increment is 0 or turns more than once, the number of
        ranges is not what the angles say, or a limit is no distance; the message names it.

    """
    with np.errstate(invalid='ignore'):  # a signalling NaN is one like any other
        ranges = np.asarray(msg.ranges, dtype=np.float64)
    _check_angles(name, msg, len(ranges))
    low, high = float(msg.range_min), float(msg.range_max)
    if not (0.0 <= low < math.inf and low < high):
        raise ValueError(f'{name}: ranges reach from {low} to {high} m, must be 0 or more, '
                         f'and the first below the second')
    try:
        stamp = seconds_from_stamp(msg.header.stamp)
    except ValueError as error:
        raise ValueError(f'{name}: {error}') from None
    clear = np.isposinf(ranges) | (zero_is_no_return & (ranges == 0.0))
    near = np.isneginf(ranges)
    valid = (ranges >= low) & (ranges <= high) & np.isfinite(ranges)
    reach = np.select([clear, near, valid], [np.full_like(ranges, high), low, ranges], 0.0)
    return Scan(stamp, float(msg.angle_min), float(msg.angle_increment), reach, near | valid)


def _check_angles(name: str, msg: Any, n_ranges: int) -> None:
    first, last, step = float(msg.angle_min), float(msg.angle_max), float(msg.angle_increment)
    if not all(map(math.isfinite, (first, last, step))) or step == 0.0:
        raise ValueError(f'{name}: angles are {first} to {last} by {step} rad, must be finite '
                         f'and by more than 0')
    if not 1 <= n_ranges <= MAX_RANGES:
        raise ValueError(f'{name}: has {n_ranges} ranges, must have 1 to {MAX_RANGES}')
    expected, slack = (last - first) / step + 1.0, max(2.0, _SLACK * n_ranges)
    if abs(n_ranges - expected) > slack:
        raise ValueError(f'{name}: has {n_ranges} ranges, must have {expected:.0f} by its angles '
                         f'({first:g} to {last:g} by {step:g} rad)')
    if (n_ranges - 1 - slack) * abs(step) > math.tau:
        raise ValueError(f'{name}: turns by {(n_ranges - 1) * abs(step):.3f} rad, must be at most '
                         f'{math.tau:.3f}')


def neighbourhood_from_scan(
    scan: Scan, robot: Placement, laser: Mount, cell: tuple[int, int], grid: Grid, body: Body,
) -> npt.NDArray[np.int8]:
    """
    Return what a scan shows of a cell and the eight around it.

    Parameters
    ----------
    scan : Scan
        What the laser measured.
    robot : Placement
        Where the robot was then, in the frame of ``grid``.
    laser : Mount
        Where the laser sits on the robot, and how it is turned: upside down, left is right.
    cell : tuple of int
        ``(row, col)`` in the middle; it may lie outside the workspace.
    grid : Grid
        The workspace; what lies outside it is blocked.
    body : Body
        The robot's size, and how far the scan is trusted.

    Returns
    -------
    ndarray of int8, shape (3, 3)
        0 free, 100 blocked, -1 unknown; row 0 at the lowest y.

    Raises
    ------
    ValueError
        If the laser is tilted by more than `laser_mount.MAX_TILT`.

    """
    if laser.problem:
        raise ValueError(laser.problem)
    eye = _Eye.of(scan, robot, laser)
    cells = np.where(_seen(scan, robot, eye, cell, grid, body), FREE, UNKNOWN).astype(np.int8)
    cells[_hit(scan, robot, eye, cell, grid, body)] = BLOCKED
    return bounded(cells, cell, grid)


class _Eye(NamedTuple):
    """
    Where the laser is in the world, and how its own plane lies on that of the cells.

    Parameters
    ----------
    x, y : float, [m]
    plane : ndarray, shape (2, 2)
        Takes ``x, y`` of the laser's own plane to those of the cells.
    is_return : ndarray of bool, shape (n,)
        Which rays met something other than the floor.

    """

    x: float
    y: float
    plane: Floats
    is_return: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, scan: Scan, robot: Placement, laser: Mount) -> '_Eye':
        """Place a laser in the world."""
        x, y, yaw = robot.compose(Placement(laser.x, laser.y, laser.yaw))
        steps = np.arange(len(scan.reach), dtype=np.float64)
        angles: Floats = np.asarray(scan.angle_min + steps * scan.angle_increment)
        return cls(x, y, laser._replace(yaw=yaw).rotation[:2, :2],
                   scan.is_return & ~laser.is_floor(angles, scan.reach))


def bounded(
    cells: npt.NDArray[np.int8], cell: tuple[int, int], grid: Grid,
) -> npt.NDArray[np.int8]:
    """Return a neighbourhood with what lies outside the workspace blocked."""
    rows = np.arange(cell[0] - 1, cell[0] + 2)[:, np.newaxis]
    cols = np.arange(cell[1] - 1, cell[1] + 2)[np.newaxis, :]
    inside = (rows >= 0) & (rows < grid.n_rows) & (cols >= 0) & (cols < grid.n_cols)
    return np.where(inside, cells, BLOCKED).astype(np.int8)


def corner_of(cell: tuple[int, int], grid: Grid) -> tuple[float, float]:
    """Return the lower left corner of the nine cells around one, [m]."""
    return (grid.origin_x + (cell[1] - 1) * grid.resolution,
            grid.origin_y + (cell[0] - 1) * grid.resolution)


# What is free


def _seen(
    scan: Scan, robot: Placement, eye: _Eye, cell: tuple[int, int], grid: Grid, body: Body,
) -> npt.NDArray[np.bool_]:
    """Return which of the nine cells are seen enough: their points lie in front of a return."""
    along = (np.arange(3 * _N_POINTS) + 0.5) / _N_POINTS * grid.resolution
    low_x, low_y = corner_of(cell, grid)
    x, y = np.meshgrid(low_x + along, low_y + along)
    across, along = np.einsum('ij,jkl->ikl', np.linalg.inv(eye.plane), [x - eye.x, y - eye.y])
    distance = np.hypot(across, along)
    ray, off = _ray_of(scan, np.arctan2(along, across))
    is_seen = (ray >= 0) & (distance <= scan.reach[ray])
    is_seen &= distance * off <= grid.resolution / _N_POINTS
    is_seen |= np.hypot(x - robot.x, y - robot.y) <= body.radius
    share: Floats = is_seen.reshape(3, _N_POINTS, 3, _N_POINTS).mean(axis=(1, 3))
    return share >= body.seen_share


def _ray_of(scan: Scan, bearing: Floats) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return the ray nearest to a bearing in the laser's frame, -1 for none, and how far off."""
    step, n = abs(scan.angle_increment), len(scan.reach)
    turn = (bearing - scan.angle_min) * math.copysign(1.0, scan.angle_increment) % math.tau
    with np.errstate(over='ignore'):  # a step may be too small to divide by
        ray = np.minimum(np.rint(turn / step), n).astype(np.int64)
        # Just before the first ray is just after a whole turn.
        ray = np.where(np.rint((turn - math.tau) / step) == 0, 0, ray)
    off: Floats = np.abs((turn - ray * step + math.pi) % math.tau - math.pi)
    return np.where(ray < n, ray, -1), off


# What is blocked


def _hit(
    scan: Scan, robot: Placement, eye: _Eye, cell: tuple[int, int], grid: Grid, body: Body,
) -> npt.NDArray[np.bool_]:
    """Return which of the nine cells hold a return, or one so near that the disc touches it."""
    side = grid.resolution
    low = np.array(corner_of(cell, grid))
    points, rays = _returns(scan, eye)
    own = np.hypot(*(points - (robot.x, robot.y)).T) <= body.radius
    near = ((points > low - side) & (points < low + 4 * side)).all(axis=1) & ~own
    points, rays = points[near], rays[near]
    deeper = points + body.accuracy * rays
    centres = low + (np.stack(np.meshgrid(*[np.arange(3)] * 2), axis=-1) + 0.5) * side
    apart = np.linalg.norm(centres[:, :, np.newaxis] - deeper, axis=-1)
    blocked: npt.NDArray[np.bool_] = (apart < body.radius).any(axis=-1)
    return blocked | _holds((points - low) / side, rays, min(body.accuracy / side, 0.25))


def _returns(scan: Scan, eye: _Eye) -> tuple[Floats, Floats]:
    """Return where the rays ended that met something, and their directions, shape (n, 2) each."""
    index = np.flatnonzero(eye.is_return)
    angle = scan.angle_min + index * scan.angle_increment
    rays = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ eye.plane.T
    places = np.array([eye.x, eye.y]) + scan.reach[index, np.newaxis] * rays
    return places, rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _holds(places: Floats, rays: Floats, slack: float) -> npt.NDArray[np.bool_]:
    """
    Return which of the nine cells hold a return.

    Near an edge a return belongs to the cell behind it, as seen along its ray. Near a corner it
    could belong to several: to one that is blocked anyway, or else to the one behind the edge
    that is nearer.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        ``x, y`` in cells from the lower left corner of the nine.
    rays : ndarray, shape (n, 2)
        Directions.
    slack : float
        What near means, in cells.

    """
    edge = np.rint(places)
    off = np.abs(places - edge)
    on_edge = off < slack + 1e-9
    behind = np.where(rays > 0.0, edge, edge - 1.0)
    at_corner = on_edge[:, 0] & on_edge[:, 1]
    on_edge &= ~at_corner[:, np.newaxis] | (off == off.min(axis=1, keepdims=True))
    col_row = np.where(on_edge, behind, np.floor(places)).astype(np.int64)
    held = _marked(col_row[~at_corner])
    col, row = edge[at_corner].T.astype(np.int64) + _RIM
    around = np.stack([held[row - i, col - j] for i in (0, 1) for j in (0, 1)])
    unexplained = ~np.any(around, axis=0)
    both: npt.NDArray[np.bool_] = held | _marked(col_row[at_corner][unexplained])
    return both[_RIM:-_RIM, _RIM:-_RIM]


def _marked(col_row: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return the nine cells and a rim around them, with these cells marked."""
    held = np.zeros((3 + 2 * _RIM, 3 + 2 * _RIM), dtype=np.bool_)
    held[col_row[:, 1] + _RIM, col_row[:, 0] + _RIM] = True
    return held
