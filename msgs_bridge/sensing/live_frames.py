"""The transforms of a running robot, as they come: where its laser is, where odometry begins."""

import math
import struct
from typing import Final

import numpy as np

from control_field.poses import Placement
from msgs_bridge.messages.poses import MAX_PLACE, QUATERNION_TOLERANCE
from msgs_bridge.sensing.frame_tree import BASES, Edge, Transforms, transforms_in
from msgs_bridge.sensing.laser_mount import Mount, mount_from_transform
from msgs_bridge.sensing.rigid_motions import Motions

#: Greatest number of frames; a robot has some tens.
_MAX_FRAMES: Final = 1000
#: How far from level a frame of odometry may be in a map, [rad].
_MAX_TILT: Final = math.radians(10.0)


class LiveFrames:
    """
    The newest of all transforms that have arrived.

    Parameters
    ----------
    topic : str
        Where they come from, for messages.

    """

    def __init__(self, topic: str = 'tf_static') -> None:
        """Start with none."""
        self._tree, self._topic = Transforms(), topic
        #: Number of messages.
        self.n_messages = 0

    def update(self, message: bytes) -> list[str]:
        """
        Take in a TFMessage, serialised; return the frames it told of.

        Raises
        ------
        ValueError
            If it is none.

        """
        try:
            found = list(transforms_in(message))
        except (struct.error, UnicodeDecodeError):
            raise ValueError(f'{self._topic}: these bytes are no transforms') from None
        for stamp, parent, child, values in found:
            shift, turn = np.array([values[:3]]), np.array([values[3:]])
            length = float(np.linalg.norm(turn))
            if not (np.abs(shift).max() <= MAX_PLACE
                    and abs(length - 1.0) <= QUATERNION_TOLERANCE):
                raise ValueError(f'{self._topic}: where {child[:80]!r} sits is no place')
            if child in self._tree.edges or len(self._tree.edges) < _MAX_FRAMES:
                at = np.array([stamp], dtype=np.int64)
                self._tree.edges[child] = Edge(
                    parent, child, at, at, Motions(shift, turn / length))
        self.n_messages += 1
        return [child for _, _, child, _ in found]

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

    def origin(self, odometry: str, top: str) -> tuple[float, Placement] | None:
        """
        Return where the frame of odometry is in that of a map, and since when, [s].

        Returns
        -------
        tuple of float and Placement, or None
            None if nothing joins the two. The stamp is the oldest on the way between them, fixed
            joints (stamp 0) left out; a localisation may date it ahead.

        Raises
        ------
        ValueError
            If it is not level.

        """
        odometry, top = odometry.lstrip('/'), top.lstrip('/')
        chain = self._tree.chain(odometry, top)
        found = self._tree.fixed(odometry, top) if chain else None
        if not chain or found is None:
            return None
        mount = mount_from_transform(found.matrix())
        if mount.tilt > _MAX_TILT:
            raise ValueError(f'{self._topic}: {odometry[:80]!r} is tilted by '
                             f'{math.degrees(mount.tilt):.0f} degrees in {top[:80]!r}')
        stamps = [int(edge.stamps_ns[0]) for edge in chain if edge.stamps_ns[0]]
        return min(stamps, default=0) * 1e-9, Placement(mount.x, mount.y, mount.yaw)

    def above(self, frame: str) -> set[str]:
        """Return a frame and all those above it."""
        return set(self._tree.above(frame.lstrip('/')))

    def _height(self, laser: str) -> float:
        """Return the laser's height above the floor, where base_footprint is; 0 if not known."""
        floor = [each for each in self._tree.bases() if each.rpartition('/')[2] == BASES[0]]
        found = self._tree.fixed(laser, floor[0]) if floor else None
        return 0.0 if found is None else max(float(np.round(found.shift[0, 2], 6)), 0.0)
