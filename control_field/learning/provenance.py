"""Who had which say in a heading of the field: equation 7 taken apart again."""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import N_HEADINGS, UNIT
from control_field.kernels.interpolation import (
    Attraction, distance_weight, mean_vector, sees, Sums)
from control_field.learning.compose import ATTRACTION_STRENGTH
from control_field.learning.doubt import cautious
from control_field.learning.interpolation import weight_from_q
from control_field.parameters import Parameters
from control_field.records import ControlField, Prototypes

#: A field holds its vectors as float32: sums that differ less are the same.
TOLERANCE: Final = 1e-5


@dataclass(frozen=True, eq=False)
class Voices:
    """
    What a heading was averaged from.

    Parameters
    ----------
    indices : ndarray of int64, shape (k,)
        Which prototypes, strongest first.
    distances : ndarray of float64, shape (k,), [cells]
        From their centres.
    weights : ndarray of float64, shape (k,)
        w_i of eq. 7; 1 for the prototype whose centre the cell is.
    attraction : int
        Heading of the attraction, -1 for none.
    attraction_weight : float
        Its weight beside them.
    vector : tuple of float
        sum(w_i v_i) / sum(w_i), the attraction among them.

    """

    indices: npt.NDArray[np.int64]
    distances: npt.NDArray[np.float64]
    weights: npt.NDArray[np.float64]
    attraction: int
    attraction_weight: float
    vector: tuple[float, float]

    @property
    def shares(self) -> npt.NDArray[np.float64]:
        """Return the prototypes' shares, shape (k,); with the attraction's they add up to 1."""
        total = self.weights.sum() + self.attraction_weight
        return self.weights / total if total > 0.0 else self.weights

    @property
    def attraction_share(self) -> float:
        """Return the attraction's share."""
        total = float(self.weights.sum()) + self.attraction_weight
        return self.attraction_weight / total if total > 0.0 else 0.0


def vector_at(field: ControlField, row: int, col: int) -> tuple[float, float]:
    """Return the averaged vector of a cell, before it was made a unit vector."""
    length = float(field.coherence[row, col])
    return length * float(field.vx[row, col]), length * float(field.vy[row, col])


def voices_at(
    field: ControlField, prototypes: Prototypes, parameters: Parameters, row: int, col: int,
    known: npt.NDArray[np.int8] | None = None, weights: npt.NDArray[np.float64] | None = None,
) -> Voices | None:
    """
    Take the heading of a cell apart.

    A field does not hold its attraction; of the headings it may have, the one is found with which
    everything adds up to the field's own vector.

    Parameters
    ----------
    field : ControlField
    prototypes : Prototypes
        Of that field.
    parameters : Parameters
        It was made with.
    row, col : int
        The cell.
    known : ndarray of int8, shape (n_rows, n_cols), optional
        Map that the windows were cut by, if not the field's own with doubted walls as walls.
    weights : ndarray of float64, shape (n,), optional
        Weight of each prototype, if not that of its Q-value.

    Returns
    -------
    Voices or None
        None if nothing adds up: the field was not made of these prototypes.

    """
    centre = np.flatnonzero((prototypes.cells == (row, col)).all(axis=1))
    if len(centre):
        voices = [_alone(prototypes, centre)]
    else:
        known = cautious(field.known).planned if known is None else known
        if weights is None:
            weights = weight_from_q(prototypes.q, parameters.weight_floor)
        spoken = _in_window(prototypes, weights, parameters, row, col, known)
        attracted = parameters.profile == 'full' and parameters.pull
        headings = range(-1, N_HEADINGS) if attracted else [-1]
        voices = [_together(prototypes, *spoken, attraction) for attraction in headings]
    recorded = vector_at(field, row, col)
    best = min(voices, key=lambda found: math.dist(found.vector, recorded))
    return best if math.dist(best.vector, recorded) <= TOLERANCE else None


def _alone(prototypes: Prototypes, centre: npt.NDArray[np.int64]) -> Voices:
    """Return the voice of the prototype whose centre a cell is: exactly its action."""
    x, y = UNIT[prototypes.headings[centre[0]]].tolist()
    return Voices(centre, np.zeros(1), np.ones(1), -1, 0.0, (x, y))


def _in_window(
    prototypes: Prototypes, own: npt.NDArray[np.float64], parameters: Parameters, row: int,
    col: int, known: npt.NDArray[np.int8],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the prototypes whose window holds a cell: index, distance and weight."""
    distances = np.hypot(*(prototypes.cells - (row, col)).T.astype(np.float64))
    window, visible = parameters.effective_window, False
    if parameters.profile == 'full':
        window = min(window, max(known.shape))
        visible = parameters.visible_windows
    elif len(distances):
        window = max(window, float(distances.min()))
    inside = distances <= window
    if visible:
        for index in np.flatnonzero(inside).tolist():
            r, c = prototypes.cells[index].tolist()
            inside[index] = sees(known, r, c, row, col)
    found = np.flatnonzero(inside)
    weights = np.array([distance_weight(own[i], distances[i], parameters.power) for i in found])
    order = np.argsort(-weights, kind='stable')
    return found[order], distances[found[order]], weights[order]


def _together(
    prototypes: Prototypes, indices: npt.NDArray[np.int64], distances: npt.NDArray[np.float64],
    weights: npt.NDArray[np.float64], attraction: int,
) -> Voices:
    """Average prototypes and attraction, as the field does at every cell."""
    totals = *(weights @ UNIT[prototypes.headings[indices]]), weights.sum()
    x, y = mean_vector(0, 0, Sums(*(np.array([[total]]) for total in totals)), Attraction(
        np.array([[attraction]], dtype=np.int8), ATTRACTION_STRENGTH))
    return Voices(indices, distances, weights, attraction,
                  ATTRACTION_STRENGTH if attraction >= 0 else 0.0, (float(x), float(y)))
