"""
Where the robot is, from what its wheels say and what its 3x3 local grid shows: a particle filter.

Wheels slip and headings drift, so odometry alone goes astray. But the local grid changes exactly
when the robot crosses the edge of a cell, and the remembered map tells what it looks like from
each cell: beside anything blocked, every crossing is an anchor. Each particle is a pose, and how
much its wheels slip and its heading drifts; so an anchor also mends what comes after it, in the
open, where there is nothing to hold on to. Time and randomness are passed in, as everywhere in the
core.
"""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, UNKNOWN
from control_field.robot.measurement_model import (
    Cells, continuity, Floats, Indices, likelihood, OFFSETS)

Cell = tuple[int, int]

#: Share of the weight that a cell needs to be taken for sure, or to be taken into account at all.
_SURE, _PLAUSIBLE = 0.98, 0.02
#: How much of their spread copies of a particle are shaken by, so that they are different ones,
#: and by how much at least, [m].
_SHAKE, _ROUGHNESS = 0.5, 0.001
#: How far a pose from elsewhere may be off before it is ignored, in standard deviations, and
#: after how many such poses in a row it is taken instead.
_FAR, _PATIENCE = 4.0, 3
#: Way that counts as none, [m].
_STILL: Final = 1e-9
#: Room around the workspace in the map that local grids are compared with, in cells: it is
#: blocked.
_EDGE: Final = 3


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """
    How far the wheels may be trusted: standard deviations.

    Parameters
    ----------
    slip : float
        Of the share of their travel that the wheels lose, before anything is known about it.
    drift : float, [rad/m]
        Of the turn that goes unnoticed, likewise.
    heading_noise : float, [rad/sqrt(m)]
        Of what remains random about the heading.
    distance_noise : float, [sqrt(m)]
        Of what remains random about the distance.
    turning_radius : float, [m/rad]
        What a turn on the spot drives the wheels: half of the distance between them.

    """

    slip: float = 0.04
    drift: float = 0.0175
    heading_noise: float = 0.03
    distance_noise: float = 0.003
    turning_radius: float = 0.08


@dataclass(frozen=True, slots=True)
class Estimate:
    """
    The most likely pose of the robot.

    Parameters
    ----------
    x, y, yaw : float, [m], [rad]
    row, col : int
        The cell around which the local grid is cut.
    std : float, [m]
        Standard deviation of the place along the axis where it is greater.
    sure : float
        Share of the particle filter in that cell.

    """

    x: float
    y: float
    yaw: float
    row: int
    col: int
    std: float
    sure: float


class ParticleFilter:
    """
    A cloud of particles: poses, each with its own idea of how its wheels slip and drift.

    Evidence says something about places only. Particles whose place is unlikely are set to likely
    ones; what goes with the place (heading, slip, drift) follows as far as the cloud shows that it
    goes with it (Anderson 2003, "A local least squares framework for ensemble filtering"). So the
    sharpest evidence leaves as many ideas of the wheels as there are particles; a plain particle
    filter keeps a handful of them, and was measured to lead the robot half a metre astray.

    Parameters
    ----------
    grid : Grid
        The workspace.
    motion_noise : MotionNoise
        How far the wheels may be trusted.
    rng : numpy.random.Generator
    n : int
        Number of particles.

    """

    def __init__(self, grid: Grid, motion_noise: MotionNoise, rng: np.random.Generator,
                 n: int = 1000) -> None:
        """Draw the wheels' errors of every particle; `place` says where the robot is."""
        self.grid = grid
        self.motion_noise = motion_noise
        self._rng = rng
        self._n = n
        rows, cols = grid.shape
        self._map = np.full((rows + 2 * _EDGE, cols + 2 * _EDGE), BLOCKED, np.int8)
        self.remember(np.full(grid.shape, UNKNOWN, np.int8))
        spread = self._normal(3)
        self._slip = motion_noise.slip * spread[0]
        self._turn_slip = 0.25 * motion_noise.slip * spread[1]
        self._drift = motion_noise.drift * spread[2]
        self.place(grid.origin_x, grid.origin_y, 0.0)

    def remember(self, known: Cells) -> None:
        """
        Take over a remembered map, shape (n_rows, n_cols): 0 free, 100 blocked, -1 unseen.

        A doubted wall (1 to 99) stands as long as more speaks for it than against it.
        """
        doubted = (known > 0) & (known < BLOCKED)
        state = np.where(known < BLOCKED // 2, UNKNOWN, BLOCKED)
        self._map[_EDGE:-_EDGE, _EDGE:-_EDGE] = np.where(doubted, state, known)

    def place(self, x: float, y: float, yaw: float, std: float = 0.005,
              yaw_std: float = 0.01) -> None:
        """Say where the robot is; what is known about its wheels is kept."""
        noise = self._normal(3)
        self._x, self._y = x + std * noise[0], y + std * noise[1]
        self._yaw = yaw + yaw_std * noise[2]
        self._local_grid: Cells | None = None
        self._n_far = 0
        self._shares: dict[Cell, float] = {}
        self._settle()

    def move(self, ahead: float, left: float, turn: float) -> None:
        """
        Move every particle by odometry.

        Parameters
        ----------
        ahead, left : float, [m]
            How far the robot has come, as seen from where it was.
        turn : float, [rad]
            Counter-clockwise.

        """
        distance = math.hypot(ahead, left)
        travel = distance + self.motion_noise.turning_radius * abs(turn)
        if travel == 0.0:
            return
        noise, motion_noise = self._normal(2), self.motion_noise
        kept = 1.0 - self._slip
        turned = (turn * (kept - self._turn_slip) + self._drift * (kept * distance)
                  + motion_noise.heading_noise * math.sqrt(travel) * noise[0])
        bearing = self._yaw + 0.5 * (turned - turn)
        if distance > _STILL:
            kept = kept + motion_noise.distance_noise * math.sqrt(travel) / distance * noise[1]
        cos, sin = np.cos(bearing), np.sin(bearing)
        self._x = self._x + kept * (ahead * cos - left * sin)
        self._y = self._y + kept * (ahead * sin + left * cos)
        self._yaw = self._yaw + turned
        self._shares.clear()

    def see(self, cells: Cells) -> None:
        """
        Take in a local grid, shape (3, 3): 0 free, -1 unknown, anything else blocked.

        It counts where it is new: for all particles if it has changed, else for those that come
        into another cell. So a robot that stands still does not become sure of anything.
        """
        cells = np.where((cells != 0) & (cells != UNKNOWN), BLOCKED, cells).astype(np.int8)
        last, before = self._local_grid, (self._rows, self._cols)
        self._settle()
        steps = self._rows - before[0], self._cols - before[1]
        if last is None or not np.array_equal(last, cells):
            news = np.ones(self._n, dtype=np.bool_)
        else:
            news = (steps[0] != 0) | (steps[1] != 0)
        if news.any():
            weights = np.ones(self._n)
            weights[news] = likelihood(
                self._map, cells, self._rows[news] + _EDGE, self._cols[news] + _EDGE)
            if last is not None:
                weights[news] *= continuity(last, cells, steps[0][news], steps[1][news])
            self._draw(weights)
        self._local_grid = cells
        self._note(cells)

    def _note(self, cells: Cells) -> None:
        """Write a local grid into the map, where there is no doubt where it belongs."""
        (row, col), share = self._likeliest()
        if share >= _SURE and self.grid.contains(row, col):
            rows, cols = self.grid.shape
            top, left = max(row - 1, 0), max(col - 1, 0)
            bottom, right = min(row + 2, rows), min(col + 2, cols)
            part = cells[top - row + 1:bottom - row + 1, left - col + 1:right - col + 1]
            kept = self._map[_EDGE + top:_EDGE + bottom, _EDGE + left:_EDGE + right]
            kept[part != UNKNOWN] = part[part != UNKNOWN]

    def localise(self, x: float, y: float, yaw: float,
                 variances: tuple[float, float, float]) -> bool:
        """
        Correct the particles by a pose from a localisation.

        A pose far off is ignored; the third of them in a row is taken.

        Parameters
        ----------
        x, y, yaw : float, [m], [rad]
        variances : tuple of float, [m^2], [m^2], [rad^2]
            Positive.

        Returns
        -------
        bool
            Whether it was taken.

        """
        off = np.stack([x - self._x, y - self._y, _wrapped(yaw - self._yaw)])
        spread = np.cov(off) + np.diag(variances)
        mean = off.mean(axis=1)
        if mean @ np.linalg.solve(spread, mean) > _FAR ** 2:
            self._n_far += 1
            if self._n_far < _PATIENCE:
                return False
            self.place(x, y, yaw, math.sqrt(max(variances[:2])), math.sqrt(variances[2]))
            return True
        self._n_far = 0
        news = off + np.sqrt(variances)[:, None] * self._normal(3)
        places = np.stack([self._x, self._y, self._yaw])
        self._x, self._y, self._yaw = places + _gain(places, places, spread) @ news
        self._recalibrate(_gain(self._calibration, places, spread) @ news)
        self._settle()
        return True

    def estimate(self) -> Estimate:
        """Return the most likely pose."""
        x, y = float(self._x.mean()), float(self._y.mean())
        first = float(self._yaw[0])
        yaw = math.remainder(first + float(_wrapped(self._yaw - first).mean()), math.tau)
        cell, share = self._likeliest()
        if share > 0.5:
            x, y = self._within(x, y, *cell)
        else:
            cell = self.grid.cell_from_world(x, y)
        return Estimate(x, y, yaw, *cell, float(max(self._x.std(), self._y.std())),
                        self._shares.get(cell, 0.0))

    def _likeliest(self) -> tuple[Cell, float]:
        """Return the cell that most particles are in, and their share."""
        if not self._shares:
            self._shares = self._count(*self._cells())
        return max(self._shares.items(), key=lambda item: item[1])

    def doubted(self, cells: Cells, row: int, col: int) -> Cells:
        """
        Return a local grid as far as it is sure where it belongs: free cells in doubt are unknown.

        Parameters
        ----------
        cells : ndarray of int8, shape (3, 3)
        row, col : int
            Its most likely place.

        """
        sure = cells.copy()
        self._likeliest()
        for (r, c), share in self._shares.items():
            if (r, c) == (row, col) or share < _PLAUSIBLE:
                continue
            for i, j in OFFSETS + 1:
                k, m = row + i - r, col + j - c
                agrees = 0 <= k < 3 and 0 <= m < 3 and cells[k, m] == cells[i, j]
                if not agrees and cells[i, j] == 0 and (i, j) != (1, 1):
                    sure[i, j] = UNKNOWN
        return sure

    @property
    def calibration(self) -> tuple[float, float]:
        """Return the slip and the drift [rad/m] that are most likely."""
        return float(self._slip.mean()), float(self._drift.mean())

    def _within(self, x: float, y: float, row: int, col: int) -> tuple[float, float]:
        """Return the point of a cell nearest to a point."""
        centre, half = self.grid.world_from_cell(row, col), 0.499 * self.grid.resolution
        return (min(max(x, centre[0] - half), centre[0] + half),
                min(max(y, centre[1] - half), centre[1] + half))

    def _settle(self) -> None:
        """Note in which cells the particles are: what they see next is compared with that."""
        self._rows, self._cols = self._cells()
        self._shares = self._count(self._rows, self._cols)

    def take_workspace(self, grid: Grid) -> None:
        """Go on in another workspace of the same lattice; `remember` says what is there."""
        if grid == self.grid:
            return
        rows, cols = self.grid.offset_to(grid) or (0, 0)
        self.grid = grid
        self._map = np.full(
            (grid.n_rows + 2 * _EDGE, grid.n_cols + 2 * _EDGE), BLOCKED, np.int8)
        self._rows += rows
        self._cols += cols
        self._shares.clear()

    def _cells(self) -> tuple[Indices, Indices]:
        side = self.grid.resolution
        return (np.floor((self._y - self.grid.origin_y) / side).astype(np.intp),
                np.floor((self._x - self.grid.origin_x) / side).astype(np.intp))

    def _count(self, rows: Indices, cols: Indices) -> dict[Cell, float]:
        """Return the cells that particles are in, and which share of them is in each."""
        top, left = int(rows.min()), int(cols.min())
        width = int(cols.max()) - left + 1
        counts = np.bincount((rows - top) * width + cols - left).tolist()
        return {(top + k // width, left + k % width): count / self._n
                for k, count in enumerate(counts) if count}

    def _draw(self, weights: Floats) -> None:
        """Set unlikely particles to likely places, and let the rest of them follow."""
        if weights.min() == weights.max():
            return
        shares = np.cumsum(weights / weights.sum())
        slots = (np.arange(self._n) + self._rng.random()) / self._n
        n_copies = np.bincount(np.minimum(np.searchsorted(shares, slots), self._n - 1),
                               minlength=self._n)
        spare = np.repeat(np.arange(self._n), np.maximum(n_copies - 1, 0))
        lost = np.flatnonzero(n_copies == 0)
        places = np.stack([self._x, self._y])
        gain = _gain(self._others, places, np.cov(places) + _ROUGHNESS ** 2 * np.eye(2))
        kept = places[:, np.repeat(np.arange(self._n), n_copies)]
        there = places[:, spare] + self._shaken(kept, len(lost))
        yaw_and_calibration = self._others
        yaw_and_calibration[:, lost] += gain @ (there - places[:, lost])
        self._x[lost], self._y[lost] = there
        self._yaw, self._slip, self._turn_slip, self._drift = yaw_and_calibration
        self._settle()

    def _shaken(self, kept: Floats, n: int) -> Floats:
        """Return small steps, shape (2, n), spread as the places that are kept."""
        spread = np.linalg.cholesky(np.cov(kept) * _SHAKE ** 2 + _ROUGHNESS ** 2 * np.eye(2))
        return spread @ self._rng.standard_normal((2, n))

    @property
    def _calibration(self) -> Floats:
        return np.stack([self._slip, self._turn_slip, self._drift])

    def _recalibrate(self, change: Floats) -> None:
        self._slip, self._turn_slip, self._drift = self._calibration + change

    @property
    def _others(self) -> Floats:
        """Return all that goes with a place, shape (4, number of particles)."""
        return np.stack([self._yaw, self._slip, self._turn_slip, self._drift])

    def _normal(self, n: int) -> Floats:
        """Return standard normal numbers, shape (n, number of particles), of mean exactly 0."""
        half = self._rng.standard_normal((n, (self._n + 1) // 2))
        return np.concatenate([half, -half], axis=1)[:, :self._n]


def _gain(what: Floats, seen: Floats, spread: Floats) -> Floats:
    """Return by how much ``what`` changes with what is seen: a least squares fit."""
    centred = seen - seen.mean(axis=1, keepdims=True)
    return np.linalg.solve(spread, centred @ what.T / (seen.shape[1] - 1)).T


def _wrapped(angles: Floats) -> Floats:
    """Return angles within half a turn of 0."""
    return angles - math.tau * np.round(angles / math.tau)
