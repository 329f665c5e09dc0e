"""
Laser scans that were checked.

Ranges mean what REP-117 says: +inf is free up to the greatest range, -inf is something too near to
measure, NaN and whatever lies outside the limits of the sensor says nothing.
"""

from dataclasses import dataclass
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from msgs_bridge.messages.poses import seconds_from_stamp

#: Longest scan, and how many more or fewer ranges than its angles say a scan may have: drivers
#: differ by one, and some by as many as the motor's speed makes it.
MAX_RANGES: Final = 100_000
_SLACK: Final = 0.02
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
