"""Where a laser sits on the robot, in full: also turned upside down, or a little tilted."""

import math
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

#: How far the plane of the rays may be from level, [rad]: farther, they soon pass over what stands
#: in the way, or meet the floor.
MAX_TILT: Final = math.radians(10.0)
#: A ray of a tilted laser that ends lower than this has met the floor, [m].
_FLOOR: Final = 0.02

Floats = npt.NDArray[np.float64]


class Mount(NamedTuple):
    """
    Where a laser sits on the robot, and how it is turned.

    Parameters
    ----------
    x, y : float, [m]
        Ahead and to the left of the robot's middle.
    yaw : float, [rad]
        Counter-clockwise, after roll and pitch (REP-103: about fixed axes x, y, z in this order).
    z : float, [m]
        Above the floor; 0 where nobody knows.
    roll, pitch : float, [rad]
        About the robot's x and y axis; a roll of pi is upside down.

    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0

    @property
    def rotation(self) -> Floats:
        """Return the matrix that turns the laser's axes into the robot's, shape (3, 3)."""
        (cr, sr), (cp, sp), (cy, sy) = (
            (math.cos(angle), math.sin(angle)) for angle in (self.roll, self.pitch, self.yaw))
        return np.array([
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr]])

    @property
    def tilt(self) -> float:
        """Return the angle between the plane of the rays and the floor, 0 to pi/2, [rad]."""
        return math.acos(min(abs(math.cos(self.pitch) * math.cos(self.roll)), 1.0))

    @property
    def problem(self) -> str:
        """Return why such a laser shows no cells; empty if it does."""
        if self.tilt <= MAX_TILT + 1e-9:
            return ''
        return (f'the laser is tilted by {math.degrees(self.tilt):.0f} degrees (roll '
                f'{self.roll:g}, pitch {self.pitch:g} rad), must be at most '
                f'{math.degrees(MAX_TILT):.0f}: its rays do not stay in the plane it drives in')

    def is_floor(self, angles: Floats, ranges: Floats) -> npt.NDArray[np.bool_]:
        """
        Return which rays of a tilted laser end at the floor; none where its height is not known.

        Parameters
        ----------
        angles : ndarray, shape (n,), [rad]
            In the laser's plane.
        ranges : ndarray, shape (n,), [m]

        """
        if self.z <= 0.0 or self.tilt < 1e-6:
            return np.zeros(len(ranges), dtype=np.bool_)
        rise = self.rotation[2, 0] * np.cos(angles) + self.rotation[2, 1] * np.sin(angles)
        return np.asarray(self.z + ranges * rise < _FLOOR)


def mount_from_transform(matrix: Any) -> Mount:
    """Return the mount of a homogeneous transform from the laser's to the robot's frame, 4 x 4."""
    turn = np.asarray(matrix, dtype=np.float64)
    x, y, z = turn[:3, 3].tolist()
    pitch = math.asin(min(max(-float(turn[2, 0]), -1.0), 1.0))
    return Mount(x, y, math.atan2(turn[1, 0], turn[0, 0]), z,
                 math.atan2(turn[2, 1], turn[2, 2]), pitch)
