"""Many rigid motions at once: put one behind another, turned round, looked up in between."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


class Motions(NamedTuple):
    """
    Where a frame is in another one, many times.

    Parameters
    ----------
    shift : ndarray, shape (n, 3), [m]
    turn : ndarray, shape (n, 4)
        Quaternions ``x, y, z, w`` of length 1.

    """

    shift: Floats
    turn: Floats

    def then(self, inner: 'Motions') -> 'Motions':
        """Return where a frame is that ``inner`` places in this one; n or 1 on either side."""
        return Motions(self.shift + rotated(self.turn, inner.shift),
                       _product(self.turn, inner.turn))

    def inverse(self) -> 'Motions':
        """Return where the outer frame is in the inner one."""
        back = self.turn * [-1.0, -1.0, -1.0, 1.0]
        return Motions(-rotated(back, self.shift), back)

    def at(self, index: npt.NDArray[np.int64] | slice) -> 'Motions':
        """Return some of them."""
        return Motions(self.shift[index], self.turn[index])

    def between(self, stamps: Floats, wanted: Floats) -> 'Motions':
        """
        Return them at other times, in between straight; before the first and after the last as it.

        Parameters
        ----------
        stamps : ndarray, shape (n,), [s]
            Of these, increasing.
        wanted : ndarray, shape (m,), [s]

        """
        above = np.clip(np.searchsorted(stamps, wanted), 1, max(len(stamps) - 1, 1))
        above = np.minimum(above, len(stamps) - 1)
        below = np.maximum(above - 1, 0)
        span = np.maximum(stamps[above] - stamps[below], 1e-12)
        share = np.clip((wanted - stamps[below]) / span, 0.0, 1.0)[:, np.newaxis]
        first, second = self.turn[below], self.turn[above]
        same = np.where((first * second).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
        turn = (1.0 - share) * first + share * same * second
        return Motions((1.0 - share) * self.shift[below] + share * self.shift[above],
                       turn / np.linalg.norm(turn, axis=1, keepdims=True))

    @property
    def yaw(self) -> Floats:
        """Return how they are turned about z, shape (n,), [rad]."""
        x, y, z, w = self.turn.T
        yaw: Floats = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
        return yaw

    def matrix(self, index: int = 0) -> Floats:
        """Return one of them as a homogeneous matrix, shape (4, 4)."""
        found = np.eye(4)
        found[:3, :3] = rotated(self.turn[index], np.eye(3)).T
        found[:3, 3] = self.shift[index]
        return found


STILL = Motions(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]))


def rotated(turn: Floats, vectors: Floats) -> Floats:
    """Return vectors turned by quaternions; n or 1 on either side."""
    axis, real = turn[..., :3], turn[..., 3:]
    across = 2.0 * np.cross(axis, vectors)
    turned: Floats = vectors + real * across + np.cross(axis, across)
    return turned


def _product(first: Floats, second: Floats) -> Floats:
    axis1, w1, axis2, w2 = first[..., :3], first[..., 3:], second[..., :3], second[..., 3:]
    axis = w1 * axis2 + w2 * axis1 + np.cross(axis1, axis2)
    real = w1 * w2 - (axis1 * axis2).sum(axis=-1, keepdims=True)
    product: Floats = np.concatenate([axis, real], axis=-1)
    return product
