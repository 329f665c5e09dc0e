"""
How a localisation mends where the robot is while it drives on.

The wheels' frame drifts, and every few seconds the localisation puts it right by some decimetres:
the robot has not leapt, its place was off a little more with every metre since. Such corrections
are spread over the way before them; what is farther, or comes too often, stays the leap it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.words import counted

Floats = npt.NDArray[np.float64]

#: Smaller steps are drift, larger ones are no correction, [m].
SLIGHT, LARGEST = 0.05, 0.5
#: Over so many seconds before it a correction is spread, at no more than this pace, [m/s].
_SPREAD, _PACE = 5.0, 0.5
#: Less is no way, [m].
_STANDING: Final = 0.02


@dataclass(frozen=True)
class Correction:
    """
    A step by which a localisation mended the robot's place.

    Parameters
    ----------
    at : float, [s]
        When it came.
    step : tuple of 3 floats, [m]

    """

    at: float
    step: tuple[float, float, float]

    @property
    def size(self) -> float:
        """Return how far it is, [m]."""
        return float(np.linalg.norm(self.step))


def spread(
    seconds: Floats, way: Floats, steps: Sequence[Correction],
) -> tuple[Floats, list[Correction]]:
    """
    Spread corrections over what was driven before them.

    Parameters
    ----------
    seconds : ndarray, shape (n,), [s]
        Of the poses, not decreasing.
    way : ndarray, shape (n,), [m]
        How far the wheels had come by then.
    steps : sequence of Correction
        In order of time.

    Returns
    -------
    added : ndarray, shape (n, 3), [m]
        What is to be added to the poses, each as of before the next correction.
    spread : list of Correction
        Those that were spread; the others stay leaps.

    """
    added, done = np.zeros((len(seconds), 3)), []
    last = float(seconds[0])
    for each in steps:
        start, last = max(last, each.at - _SPREAD), each.at
        if each.size > min(LARGEST, _PACE * (each.at - start)):
            continue
        first, end = np.searchsorted(seconds, (start, each.at))
        if end > first:
            added[first:end] += np.outer(_shares(seconds, way, first, end, each.at), each.step)
        done.append(each)
    return added, done


def _shares(seconds: Floats, way: Floats, first: int, end: int, at: float) -> Floats:
    """Return which share of a correction the poses before it get: as the wheels have turned."""
    driven = way[first:end] - way[first]
    if driven[-1] > _STANDING:
        return np.asarray(driven / driven[-1])
    if first == 0:  # it has not moved at all yet: it was there from the first
        return np.ones(end - first)
    return np.asarray((seconds[first:end] - seconds[first]) / max(at - seconds[first], 1e-9))


def said_of(corrections: Sequence[Correction], what: str, start: float) -> list[str]:
    """Say what was mended, how often, by how much and when; seconds count from ``start``."""
    if not corrections:
        return []
    most = max(corrections, key=lambda each: each.size)
    how_often, when = counted(len(corrections), 'time'), most.at - start
    return [(f'{what} was corrected {how_often} while the robot drove on, by up to '
             f'{most.size:.2f} m (at {when:.2f} s): spread over the way of the {_SPREAD:.0f} s '
             f'before')]
