"""
The neighbourhood from a laser scan: geometry, with poses and scan passed in.

A cell is *blocked* when a return lies in it, or so near its centre that the robot's disc would
touch it there; *free* when enough of its area lies in front of the returns and near to a ray
(rays that are far apart show nothing of what is between them); else *unknown*.
"""

from dataclasses import dataclass, replace
import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE, middle_of, UNKNOWN
from control_field.poses import Placement
from control_field.robot.footprint import Footprint
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.scan import Floats, Scan

#: Points looked at along a side of a cell, of the nine around the robot and of those beyond.
_N_POINTS: Final = 5
_N_FAR: Final = 3
#: Cells around those looked at, so that what lies beside them can explain a return as well.
_RIM: Final = 2


@dataclass(frozen=True)
class Body:
    """
    What stands between a scan and the cells.

    Parameters
    ----------
    radius : float, [m]
        Of the robot's disc; returns within it are the robot's own parts, unless there is a
        footprint.
    accuracy : float, [m]
        How far a return may be off along its ray. So near an edge of a cell it is taken to be
        beyond it, where the surface is that it came from.
    seen_share : float, 0 to 1
        Share of a cell that must be seen before it is free.
    footprint : Footprint, optional
        The robot's outline; returns on it are its own parts.

    """

    radius: float
    accuracy: float = 0.02
    seen_share: float = 0.5
    footprint: Footprint | None = None

    def covers(self, x: Floats, y: Floats, robot: Placement) -> npt.NDArray[np.bool_]:
        """Return which points, [m], the robot covers that stands somewhere."""
        x, y = x - robot.x, y - robot.y
        if self.footprint is None:
            return np.asarray(np.hypot(x, y) <= self.radius)
        c, s = math.cos(robot.yaw), math.sin(robot.yaw)
        ahead, left = c * x + s * y, c * y - s * x
        on_piece = [np.all([nx * ahead + ny * left <= d for nx, ny, d in piece.sides], axis=0)
                    for piece in self.footprint.pieces]
        return np.asarray(np.any(on_piece, axis=0))


class Extent(NamedTuple):
    """
    How much a local grid shows.

    Parameters
    ----------
    n : int, [cells]
        Its side, odd.
    k : int
        Finer cells along a side of each cell, odd.
    radius : float, [m]
        What lies farther away is not seen, but for the cells around the robot's.

    """

    n: int = 3
    k: int = 1
    radius: float = math.inf


NINE: Final = Extent()


def neighbourhood_from_scan(
    scan: Scan, robot: Placement, laser: Mount, cell: tuple[int, int], grid: Grid, body: Body,
    extent: Extent = NINE,
) -> npt.NDArray[np.int8]:
    """
    Return what a scan shows of a cell and those around it.

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
    extent : Extent
        How much to look at; the nine in the middle are the same for every ``n``.

    Returns
    -------
    ndarray of int8, shape (n * k, n * k)
        0 free, 100 blocked, -1 unknown; row 0 at the lowest y. Finer cells make up what one cell
        would be: where that is free they all are but for returns, and where it is blocked by a
        return near its centre, the one in the middle is.

    Raises
    ------
    ValueError
        If the laser is tilted by more than `laser_mount.MAX_TILT`.

    """
    if laser.problem:
        raise ValueError(laser.problem)
    look = _Look(scan, robot, _Eye.of(scan, robot, laser), body)
    cells = bounded(look.at(_patch(cell, grid, 3), _N_POINTS), cell, grid)
    if extent.n > 3:
        near, scan = cells, _within(scan, extent.radius)
        look = _Look(scan, robot, _Eye.of(scan, robot, laser), body)
        cells = bounded(look.at(_patch(cell, grid, extent.n), _N_FAR), cell, grid)
        middle_of(cells)[:] = near
    if extent.k == 1:
        return cells
    fine = look.finer(cells, _patch(cell, grid, extent.n), extent.k)
    outside = bounded(np.full_like(cells, FREE), cell, grid) == BLOCKED
    fine[outside.repeat(extent.k, axis=0).repeat(extent.k, axis=1)] = BLOCKED
    return fine


def _within(scan: Scan, radius: float) -> Scan:
    """Return a scan that shows nothing beyond a distance [m]."""
    return replace(scan, reach=np.minimum(scan.reach, radius),
                   is_return=scan.is_return & (scan.reach <= radius))


class _Patch(NamedTuple):
    """A square of ``n`` x ``n`` cells: its lower left corner and the side of a cell, [m]."""

    x: float
    y: float
    side: float
    n: int


def _patch(cell: tuple[int, int], grid: Grid, n: int) -> _Patch:
    """Return the square of cells around one."""
    return _Patch(*corner_of(cell, grid, n), grid.resolution, n)


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
    reach = len(cells) // 2
    rows = np.arange(cell[0] - reach, cell[0] + reach + 1)[:, np.newaxis]
    cols = np.arange(cell[1] - reach, cell[1] + reach + 1)[np.newaxis, :]
    inside = (rows >= 0) & (rows < grid.n_rows) & (cols >= 0) & (cols < grid.n_cols)
    return np.where(inside, cells, BLOCKED).astype(np.int8)


def corner_of(cell: tuple[int, int], grid: Grid, n: int = 3) -> tuple[float, float]:
    """Return the lower left corner of the ``n`` x ``n`` cells around one, [m]."""
    return (grid.origin_x + (cell[1] - n // 2) * grid.resolution,
            grid.origin_y + (cell[0] - n // 2) * grid.resolution)


class _Look(NamedTuple):
    """A scan, with all that is needed to place it."""

    scan: Scan
    robot: Placement
    eye: _Eye
    body: Body

    def at(self, patch: _Patch, n_points: int) -> npt.NDArray[np.int8]:
        """Return the states of some cells, by so many points along a side of each."""
        share = self.seen_shares(patch, n_points, patch.side / _N_POINTS)
        cells = np.where(share >= self.body.seen_share, FREE, UNKNOWN).astype(np.int8)
        deeper, held = self._returns_in(patch)
        cells[held | _touched(deeper, patch, self.body.radius)] = BLOCKED
        return cells

    def finer(
        self, cells: npt.NDArray[np.int8], patch: _Patch, k: int,
    ) -> npt.NDArray[np.int8]:
        """Divide cells into finer ones, k along a side; see `neighbourhood_from_scan`."""
        finer = patch._replace(side=patch.side / k, n=patch.n * k)
        seen = self.seen_shares(finer, 1, patch.side / _N_POINTS) > 0.0
        _, held = self._returns_in(finer)
        whole = cells.repeat(k, axis=0).repeat(k, axis=1)
        fine = np.where(held, BLOCKED, np.where(seen | (whole == FREE), FREE, UNKNOWN)).astype(
            np.int8)
        hit = np.asarray(held.reshape(patch.n, k, patch.n, k).any(axis=(1, 3)))
        hit[patch.n // 2, patch.n // 2] = True  # the robot's own, where it may be in the middle
        fine[k // 2::k, k // 2::k][(cells == BLOCKED) & ~hit] = BLOCKED
        return fine

    def seen_shares(self, patch: _Patch, n_points: int, spacing: float) -> Floats:
        """Return the share of each cell that lies in front of a return and near to a ray, [m]."""
        (scan, robot, eye, body), n = self, patch.n * n_points
        along = (np.arange(n) + 0.5) / n_points * patch.side
        x, y = np.meshgrid(patch.x + along, patch.y + along)
        across, along = np.einsum('ij,jkl->ikl', np.linalg.inv(eye.plane), [x - eye.x, y - eye.y])
        distance = np.hypot(across, along)
        ray, off = _ray_of(scan, np.arctan2(along, across))
        is_seen = (ray >= 0) & (distance <= scan.reach[ray])
        is_seen &= distance * off <= spacing
        is_seen |= body.covers(x, y, robot)
        share: Floats = is_seen.reshape(patch.n, n_points, patch.n, n_points).mean(axis=(1, 3))
        return share

    def _returns_in(self, patch: _Patch) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Return the returns in and around some cells [m], and which cells hold one."""
        (scan, robot, eye, body), side = self, patch.side
        low = np.array([patch.x, patch.y])
        points, rays = _returns(scan, eye)
        own = body.covers(points[:, 0], points[:, 1], robot)
        near = ((points > low - side) & (points < low + (patch.n + 1) * side)).all(axis=1) & ~own
        points, rays = points[near], rays[near]
        held = _holds((points - low) / side, rays, min(body.accuracy / side, 0.25), patch.n)
        return points + body.accuracy * rays, held


# What is free


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


def _touched(
    points: Floats, patch: _Patch, radius: float,
) -> npt.NDArray[np.bool_]:
    """Return in the centre of which cells a disc would touch one of some points, [m]."""
    place = (points - (patch.x, patch.y)) / patch.side
    reach = math.ceil(radius / patch.side + 0.5)
    span = np.arange(-reach, reach + 1)
    touched = np.zeros((patch.n, patch.n), dtype=np.bool_)
    col, row = (np.floor(place[:, [i]]).astype(np.int64) + span for i in (0, 1))
    off_x, off_y = (cells + 0.5 - place[:, [i]] for i, cells in enumerate((col, row)))
    rows, cols = np.broadcast_arrays(row[:, :, np.newaxis], col[:, np.newaxis, :])
    hit = np.hypot(off_y[:, :, np.newaxis], off_x[:, np.newaxis, :]) * patch.side < radius
    hit &= (rows >= 0) & (rows < patch.n) & (cols >= 0) & (cols < patch.n)
    touched[rows[hit], cols[hit]] = True
    return touched


def _returns(scan: Scan, eye: _Eye) -> tuple[Floats, Floats]:
    """Return where the rays ended that met something, and their directions, shape (n, 2) each."""
    index = np.flatnonzero(eye.is_return)
    angle = scan.angle_min + index * scan.angle_increment
    rays = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ eye.plane.T
    places = np.array([eye.x, eye.y]) + scan.reach[index, np.newaxis] * rays
    return places, rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _holds(places: Floats, rays: Floats, slack: float, n: int) -> npt.NDArray[np.bool_]:
    """
    Return which of ``n`` x ``n`` cells hold a return.

    Near an edge a return belongs to the cell behind it, as seen along its ray. Near a corner it
    could belong to several: to one that is blocked anyway, or else to the one behind the edge
    that is nearer.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        ``x, y`` in cells from their lower left corner.
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
    held = _marked(col_row[~at_corner], n)
    col, row = edge[at_corner].T.astype(np.int64) + _RIM
    around = np.stack([held[row - i, col - j] for i in (0, 1) for j in (0, 1)])
    unexplained = ~np.any(around, axis=0)
    both: npt.NDArray[np.bool_] = held | _marked(col_row[at_corner][unexplained], n)
    return both[_RIM:-_RIM, _RIM:-_RIM]


def _marked(col_row: npt.NDArray[np.int64], n: int) -> npt.NDArray[np.bool_]:
    """Return ``n`` x ``n`` cells and a rim around them, with these cells marked."""
    held = np.zeros((n + 2 * _RIM, n + 2 * _RIM), dtype=np.bool_)
    held[col_row[:, 1] + _RIM, col_row[:, 0] + _RIM] = True
    return held
