"""Equation 7 with windows and attraction; plain Python or compiled, as `kernels` says."""

import math
from typing import Final, NamedTuple

import numpy as np

from control_field.headings import UNIT
from control_field.kernels.rehearsal import best_steps, Masks
from control_field.kernels.steps import (
    _BLOCKED, best_of, BoolMap, CellMap, FloatMap, Ground, IntMap, step_allowed, StepRules)

#: Smaller to greater part of a direction that is clearly nearest to an axis: tan(22.5 degrees).
_CLEARLY: Final = 0.4142135


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


class View(NamedTuple):
    """
    Where prototypes count.

    Parameters
    ----------
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map.
    divisor : ndarray of float64, shape (n, n)
        Of `divisors`.
    wanted : ndarray of bool, shape (n_rows, n_cols)
        Cells whose sums are wanted.
    visible : bool
        Whether known walls cut a window off.

    """

    known: CellMap
    divisor: FloatMap
    wanted: BoolMap
    visible: bool


class Vectors(NamedTuple):
    """
    A field while it is made.

    Parameters
    ----------
    x, y : ndarray of float64, shape (n_rows, n_cols)
        Averaged vectors, not normalised.
    headings : ndarray of int8, shape (n_rows, n_cols)

    """

    x: FloatMap
    y: FloatMap
    headings: CellMap

    @classmethod
    def none(cls, shape: tuple[int, int]) -> 'Vectors':
        """Return a field without a heading."""
        return cls(np.zeros(shape), np.zeros(shape), np.full(shape, -1, dtype=np.int8))


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
    n = max(abs(d_row), abs(d_col))
    # The line is looked at in 2 n pieces; how far it is into a cell, in parts of one, 4 n each.
    in_row, in_col = 2 * n, 2 * n
    for _ in range(1, 2 * n):
        in_row += 2 * d_row
        in_col += 2 * d_col
        up, right = in_row // (4 * n), in_col // (4 * n)
        row, col = row + up, col + right
        in_row, in_col = in_row - 4 * n * up, in_col - 4 * n * right
        if known[row, col] == _BLOCKED:
            return False
    return True


def distance_weight(weight: float, distance: float, power: float) -> float:
    """Return w_i of eq. 7: a prototype's weight, falling off with the distance [cells] from it."""
    share: float = weight / distance ** power
    return share


def divisors(window: Window) -> FloatMap:
    """
    Return what a prototype's weight is divided by, by rows and columns from its centre.

    Returns
    -------
    ndarray of float64, shape (n, n)
        As `distance_weight` has it; inf on the centre and outside of the window.

    """
    side = int(window.radius) + 1
    divisor = np.full((side, side), np.inf)
    for row in range(side):
        for col in range(side):
            d = math.hypot(row, col)
            if 0.0 < d <= window.radius:
                divisor[row, col] = d ** window.power
    return divisor


def spread(
    sums: Sums, view: View, row: int, col: int, heading: int, weight: float,
) -> None:
    """Add one prototype's share of eq. 7 to its effective window (take it away: weight < 0)."""
    known, divisor, wanted, visible = view
    reach = divisor.shape[0] - 1
    bottom, top = max(0, row - reach), min(known.shape[0], row + reach + 1)
    left, right = max(0, col - reach), min(known.shape[1], col + reach + 1)
    walls = visible and has_wall(known, bottom, top, left, right)
    for r in range(bottom, top):
        for c in range(left, right):
            by = divisor[abs(r - row), abs(c - col)]
            if by == np.inf or not wanted[r, c] or (walls and not sees(known, row, col, r, c)):
                continue
            w = weight / by
            sums.x[r, c] += w * UNIT[heading, 0]
            sums.y[r, c] += w * UNIT[heading, 1]
            sums.weight[r, c] += w


def has_wall(known: CellMap, bottom: int, top: int, left: int, right: int) -> bool:
    """Return whether there is a known wall in a part of the map."""
    n = 0
    for r in range(bottom, top):
        for c in range(left, right):
            n += known[r, c] == _BLOCKED
    return n > 0


def add_windows(
    sums: Sums, known: CellMap, centres: Centres, window: Window, wanted: BoolMap,
) -> None:
    """Add the shares of several prototypes, to the cells where they are wanted."""
    view = View(known, divisors(window), wanted, window.visible)
    for i in range(centres.cells.shape[0]):
        spread(sums, view, centres.cells[i, 0], centres.cells[i, 1], centres.headings[i],
               centres.weights[i])


def windows_of(cells: BoolMap, window: Window) -> BoolMap:
    """Mark some cells and all within a window's reach of them, along rows and columns."""
    rows, cols = cells.shape
    reach = int(window.radius)
    marked = np.zeros((rows, cols), dtype=np.bool_)
    for row in range(rows):
        for col in range(cols):
            if cells[row, col]:
                marked[max(0, row - reach):min(rows, row + reach + 1),
                       max(0, col - reach):min(cols, col + reach + 1)] = True
    return marked


def heading_of(vx: float, vy: float) -> int:
    """Return the heading nearest to a direction, -1 for none; `headings.heading_from_vector`."""
    if vx * vx + vy * vy < 1e-18:
        return -1
    x, y = abs(vx), abs(vy)
    if y < _CLEARLY * x:
        return 0 if vx > 0.0 else 4
    if x < _CLEARLY * y:
        return 2 if vy > 0.0 else 6
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
    sums: Sums, centre: CellMap, attraction: Attraction, vectors: Vectors, wanted: BoolMap,
) -> None:
    """
    Write the field's vectors and their headings, where they are wanted.

    Parameters
    ----------
    centre : ndarray of int8, shape (n_rows, n_cols)
        Heading of the prototype centred in a cell, -1 for none.

    """
    rows, cols = centre.shape
    for row in range(rows):
        for col in range(cols):
            if not wanted[row, col]:
                continue
            heading = centre[row, col]
            if heading >= 0:
                x, y = UNIT[heading, 0], UNIT[heading, 1]
            else:
                x, y = mean_vector(row, col, sums, attraction)
                heading = heading_of(x, y)
            vectors.x[row, col], vectors.y[row, col] = x, y
            vectors.headings[row, col] = heading


def attraction_from_cost(ground: Ground, cost: FloatMap, sums: Sums) -> CellMap:
    """Return the heading of least cost a cell, ties nearest to eq. 7's heading; -1 for none."""
    headings, ties = best_steps(ground, cost)
    settle_ties(headings, headings, ties, ground, cost, sums, ties > 0)
    return headings


def settle_ties(
    attraction: CellMap, headings: CellMap, ties: Masks, ground: Ground, cost: FloatMap,
    sums: Sums, wanted: BoolMap,
) -> None:
    """
    Write the step nearest to eq. 7's heading among the `best_steps`, where it is wanted.

    Parameters
    ----------
    attraction : ndarray of int8, shape (n_rows, n_cols)
        Takes it.
    headings : ndarray of int8, shape (n_rows, n_cols)
    ties : ndarray of uint8, shape (n_rows, n_cols)
        Of `best_steps`.

    """
    for row in range(headings.shape[0]):
        for col in range(headings.shape[1]):
            if not wanted[row, col]:
                continue
            attraction[row, col] = headings[row, col]
            if ties[row, col]:
                toward = heading_of(sums.x[row, col], sums.y[row, col])
                if toward >= 0:
                    attraction[row, col] = best_of(
                        ties[row, col], ground.factor, cost, row, col, toward)


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
