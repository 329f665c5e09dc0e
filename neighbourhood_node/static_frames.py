"""The static transforms of a running robot: where the laser is mounted."""

import struct

import numpy as np

from msgs_bridge.messages.poses import MAX_PLACE, QUATERNION_TOLERANCE
from msgs_bridge.sensing.frame_tree import BASES, Edge, Transforms, transforms_in
from msgs_bridge.sensing.laser_mount import Mount, mount_from_transform
from msgs_bridge.sensing.rigid_motions import Motions

#: Greatest number of frames; a robot has some tens.
_MAX_FRAMES = 1000


class StaticFrames:
    """The static transforms that have arrived."""

    def __init__(self) -> None:
        """Start with none."""
        self._tree = Transforms()
        #: Number of messages.
        self.n_messages = 0

    def update(self, message: bytes) -> None:
        """
        Take in a TFMessage, serialised.

        Raises
        ------
        ValueError
            If it is none.

        """
        try:
            found = list(transforms_in(message))
        except (struct.error, UnicodeDecodeError):
            raise ValueError('tf_static: these bytes are no transforms') from None
        for stamp, parent, child, values in found:
            shift, turn = np.array([values[:3]]), np.array([values[3:]])
            length = float(np.linalg.norm(turn))
            if not (np.abs(shift).max() <= MAX_PLACE
                    and abs(length - 1.0) <= QUATERNION_TOLERANCE):
                raise ValueError(f'tf_static: where {child[:80]!r} sits is no place')
            if child in self._tree.edges or len(self._tree.edges) < _MAX_FRAMES:
                at = np.array([stamp], dtype=np.int64)
                self._tree.edges[child] = Edge(
                    parent, child, at, at, Motions(shift, turn / length))
        self.n_messages += 1

    def mount(self, laser: str, base: str) -> Mount | None:
        """Return where a laser sits on the robot; None if nothing says so."""
        laser = laser.lstrip('/')
        for each in dict.fromkeys(filter(None, [base.lstrip('/'), *self._tree.bases()])):
            if each == laser:
                return Mount()
            found = self._tree.fixed(laser, each)
            if found is not None:
                return mount_from_transform(found.matrix())._replace(z=self._height(laser))
        return None

    def _height(self, laser: str) -> float:
        """Return the laser's height above the floor, where base_footprint is; 0 if not known."""
        floor = [each for each in self._tree.bases() if each.rpartition('/')[2] == BASES[0]]
        found = self._tree.fixed(laser, floor[0]) if floor else None
        return 0.0 if found is None else max(float(np.round(found.shift[0, 2], 6)), 0.0)
