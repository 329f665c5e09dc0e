"""How fast a drive is, and how fast a single step of it may be."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: At most so many times poses gone wrong are left out rather than another drive.
MOST_SPIKES: Final = 3
#: A single step may be so much faster than this drive usually is, but always so fast, [m/s].
_HASTE, _SLOWEST_BOUND = 2.0, 0.2
#: It may be as fast as the drive is for so long, [s], where no step is slower than this share.
_SUSTAINED, _EVEN = 2.0, 0.5
#: Way from pose to pose that is motion, and that is more than noise, [m].
_MOVING, _DRIVEN = 1e-3, 0.02


def period(stamps: Floats) -> float:
    """Return the usual time from pose to pose, [s]; 0 if all are of one time."""
    dt = np.diff(stamps)
    return float(np.median(dt[dt > 0.0])) if (dt > 0.0).any() else 0.0


def speed_bound(stamps: Floats, xy: Floats, speed_max: float) -> float:
    """
    Return how fast a step may be, [m/s]: no faster than the robot, nor than this drive ever is.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    speed_max : float, [m/s]

    """
    dt, way = np.diff(stamps), np.hypot(*np.diff(xy, axis=0).T)
    moving = np.sort((way / np.maximum(dt, 1e-9))[(dt > 0.0) & (way > _MOVING)])
    # The few fastest may be leaps themselves; of a handful of steps the middle one counts.
    n_driven = int((way > _DRIVEN).sum())  # a robot that waits for minutes drives no slower later
    rank = len(moving) - 1 - max(2 * MOST_SPIKES, math.ceil(0.02 * n_driven))
    usual = float(moving[max(rank, len(moving) // 2)]) if len(moving) else 0.0
    return min(speed_max, max(_HASTE * usual, _sustained(stamps, xy), _SLOWEST_BOUND))


def _sustained(stamps: Floats, xy: Floats) -> float:
    """Return how fast it drives for seconds together, step by step, [m/s]: no leap does."""
    usual = period(stamps)
    lag = max(math.ceil(_SUSTAINED / usual), 2) if usual > 0.0 else len(stamps)
    if len(stamps) <= lag:
        return 0.0
    speed = np.hypot(*(xy[lag:] - xy[:-lag]).T) / np.maximum(
        stamps[lag:] - stamps[:-lag], _SUSTAINED)
    steps = np.hypot(*np.diff(xy, axis=0).T) / np.maximum(np.diff(stamps), 1e-9)
    slowest = np.lib.stride_tricks.sliding_window_view(steps, lag).min(axis=1)
    return float(speed[slowest >= _EVEN * speed].max(initial=0.0))
