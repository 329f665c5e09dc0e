"""Equation 7 with windows and attraction; plain Python or compiled, as `kernels` says."""

import math
from typing import NamedTuple

import numpy as np

from control_field.headings import UNIT
from control_field.kernels.steps import (
    _BLOCKED, best_step, CellMap, FloatMap, Ground, IntMap, is_occupied, step_allowed, StepRules)


class Window(NamedTuple):
    """
    How far a prototype reaches, and how its weight falls off.

    Parameters
    ----------
    radius : float, [cells]
    power : float
        p of eq. 7.
    visible : bool
        Whether known walls cut it off.

    """

    radius: float
    power: float
    visible: bool


class Centres(NamedTuple):
    """
    Prototypes as the kernels take them.

    Parameters
    ----------
    cells : ndarray of int64, shape (n, 2)
    headings : ndarray of int8, shape (n,)
    weights : ndarray of float64, shape (n,)
        Of eq. 7, before the distance.

    """

    cells: IntMap
    headings: CellMap
    weights: FloatMap


class Sums(NamedTuple):
    """
    Numerator and denominator of eq. 7 at every cell: what the prototypes around it add up to.

    Parameters
    ----------
    x, y, weight : ndarray of float64, shape (n_rows, n_cols)

    """

    x: FloatMap
    y: FloatMap
    weight: FloatMap

    @classmethod
    def none(cls, shape: tuple[int, int]) -> 'Sums':
        """Return the sums of no prototype."""
        return cls(np.zeros(shape), np.zeros(shape), np.zeros(shape))


class Attraction(NamedTuple):
    """
    One more voice of eq. 7, like a prototype one cell away.

    Parameters
    ----------
    headings : ndarray of int8, shape (n_rows, n_cols)
        -1 for none.
    strength : float
        Its weight.

    """

    headings: CellMap
    strength: float


def sees(known: CellMap, row: int, col: int, r: int, c: int) -> bool:
    """Return whether the straight line between two cell centres crosses no known wall."""
    d_row, d_col = r - row, c - col
    n = 2 * max(abs(d_row), abs(d_col))
    for i in range(1, n):
        at_row = int(math.floor(row + d_row * i / n + 0.5))
        at_col = int(math.floor(col + d_col * i / n + 0.5))
        if known[at_row, at_col] == _BLOCKED:
            return False
    return True


def distance_weight(weight: float, distance: float, power: float) -> float:
    """Return w_i of eq. 7: a prototype's weight, falling off with the distance [cells] from it."""
    share: float = weight / distance ** power
    return share


def spread(
    sums: Sums, known: CellMap, row: int, col: int, heading: int, weight: float, window: Window,
) -> None:
    """Add one prototype's share of eq. 7 to its effective window (take it away: weight < 0)."""
    reach = int(window.radius)
    for r in range(max(0, row - reach), min(known.shape[0], row + reach + 1)):
        for c in range(max(0, col - reach), min(known.shape[1], col + reach + 1)):
            if r == row and c == col:
                continue
            d = math.hypot(r - row, c - col)
            if d > window.radius or (window.visible and not sees(known, row, col, r, c)):
                continue
            w = distance_weight(weight, d, window.power)
            sums.x[r, c] += w * UNIT[heading, 0]
            sums.y[r, c] += w * UNIT[heading, 1]
            sums.weight[r, c] += w


def add_windows(sums: Sums, known: CellMap, centres: Centres, window: Window) -> None:
    """Add the shares of several prototypes."""
    for i in range(centres.cells.shape[0]):
        spread(sums, known, centres.cells[i, 0], centres.cells[i, 1], centres.headings[i],
               centres.weights[i], window)


def heading_of(vx: float, vy: float) -> int:
    """Return the heading nearest to a direction, -1 for none; `headings.heading_from_vector`."""
    if vx * vx + vy * vy < 1e-18:
        return -1
    return int(math.floor(math.atan2(vy, vx) / (math.pi / 4) + 0.5)) % 8


def mean_vector(row: int, col: int, sums: Sums, attraction: Attraction) -> tuple[float, float]:
    """Return the averaged vector of eq. 7 at a cell that is no centre, the attraction included."""
    x, y, w = sums.x[row, col], sums.y[row, col], sums.weight[row, col]
    heading = attraction.headings[row, col]
    if heading >= 0:
        x += attraction.strength * UNIT[heading, 0]
        y += attraction.strength * UNIT[heading, 1]
        w += attraction.strength
    if w <= 0.0:
        return 0.0, 0.0
    return x / w, y / w


def field_vectors(
    sums: Sums, centre: CellMap, attraction: Attraction,
) -> tuple[FloatMap, FloatMap, CellMap]:
    """
    Return the field's vectors and their headings everywhere.

    Parameters
    ----------
    centre : ndarray of int8, shape (n_rows, n_cols)
        Heading of the prototype centred in a cell, -1 for none.

    Returns
    -------
    vx, vy : ndarray, shape (n_rows, n_cols)
        Averaged vectors, not normalised.
    headings : ndarray of int8, shape (n_rows, n_cols)

    """
    rows, cols = centre.shape
    vx, vy = np.zeros((rows, cols)), np.zeros((rows, cols))
    headings = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            heading = centre[row, col]
            if heading >= 0:
                vx[row, col], vy[row, col] = UNIT[heading, 0], UNIT[heading, 1]
                headings[row, col] = heading
                continue
            x, y = mean_vector(row, col, sums, attraction)
            vx[row, col], vy[row, col] = x, y
            headings[row, col] = heading_of(x, y)
    return vx, vy, headings


def attraction_from_cost(ground: Ground, cost: FloatMap, sums: Sums) -> CellMap:
    """Return the heading of least cost a cell, ties nearest to eq. 7's heading; -1 for none."""
    rows, cols = cost.shape
    attraction = np.full((rows, cols), -1, dtype=np.int8)
    keep_out = ground.rules.unknown_is_blocked
    for row in range(rows):
        for col in range(cols):
            if not is_occupied(ground.known, row, col, keep_out) and cost[row, col] > 0.0:
                toward = heading_of(sums.x[row, col], sums.y[row, col])
                attraction[row, col] = best_step(ground, cost, row, col, toward)
    return attraction


def attraction_to_nearest(known: CellMap, cells: IntMap, rules: StepRules) -> CellMap:
    """Return the allowed heading straightest towards the nearest prototype; -1 for none."""
    rows, cols = known.shape
    attraction = np.full((rows, cols), -1, dtype=np.int8)
    for row in range(rows):
        for col in range(cols):
            best, to_row, to_col = np.inf, 0, 0
            for i in range(cells.shape[0]):
                d = math.hypot(cells[i, 0] - row, cells[i, 1] - col)
                if d < best:
                    best, to_row, to_col = d, cells[i, 0] - row, cells[i, 1] - col
            if 0.0 < best < np.inf:
                heading = heading_of(float(to_col), float(to_row))
                if step_allowed(known, row, col, heading, rules):
                    attraction[row, col] = heading
    return attraction
