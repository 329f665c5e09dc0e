"""Where the laser is mounted, as `/tf_static` says; logs what that is taken from."""

import math
from typing import Final

from rclpy.node import Node

from msgs_bridge.node import qos
from msgs_bridge.node.tf_type import transforms_type
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.live_frames import LiveFrames
from neighbourhood_node.neighbourhood import NeighbourhoodMaker

_TOPIC: Final = '/tf_static'
_PARAMETERS: Final = 'laser_x, laser_y, laser_z, laser_roll, laser_pitch and laser_yaw'
#: How far the mounts of parameters and `/tf_static` may be apart, [m] and [rad].
_MAX_DISTANCE, _MAX_ANGLE = 0.02, 0.1
#: Longer names of frames are cut off, [characters].
_MAX_NAME: Final = 80


class LaserMountFinder:
    """
    Finds the laser's mount in `/tf_static`, and tells it to a NeighbourhoodMaker.

    Parameters
    ----------
    node : Node
    maker : NeighbourhoodMaker

    """

    def __init__(self, node: Node, maker: NeighbourhoodMaker) -> None:
        """Subscribe, if there is a type to subscribe with."""
        self._logger = node.get_logger()  # type: ignore[no-untyped-call]
        self._maker, self._frames = maker, LiveFrames()
        self._laser = self._base = ''
        #: The last line that was logged.
        self.last_logged = ''
        kind = transforms_type()
        self._why_not = '' if kind else f'{_TOPIC} is not heard, tf2_msgs is not installed'
        if kind:
            node.create_subscription(
                kind, _TOPIC, self.on_static_transforms, qos.STATIC_FRAMES, raw=True)

    def on_static_transforms(self, message: bytes) -> None:
        """Take in what came on `/tf_static`."""
        try:
            self._frames.update(message)
        except ValueError as error:
            self._log(f'{error}; it is left out')
        self._find()

    def on_frames(self, laser: str = '', base: str = '') -> None:
        """Take in the frame of a scan, or that of the robot's middle in odometry."""
        before = self._laser, self._base
        self._laser = laser[:_MAX_NAME] or self._laser
        self._base = base[:_MAX_NAME] or self._base
        if (self._laser, self._base) != before:
            self._find()

    def _find(self) -> None:
        if self._laser:
            self._maker.found = self._frames.mount(self._laser, self._base)

    def log(self) -> None:
        """Log once what the mount is taken from, and what does not agree."""
        if not (self._laser and self._base):
            return
        found, given = self._maker.found, self._maker.settings.laser
        if found is None and given == Mount() and self._laser != self._base:
            why = self._why_not or f'nothing says on {_TOPIC} where it sits'
            self._log(f"the laser {self._laser!r} is taken to sit in the robot's middle: {why}; "
                      f'if it does not, set {_PARAMETERS}')
        elif found is not None and given == Mount() != found:
            self._log(f'the laser {self._laser!r} sits at {text_of(found)}, as {_TOPIC} says',
                      is_good=True)
        elif found is not None and not are_alike(found, given):
            self._log(f'{_PARAMETERS} say that the laser sits at {text_of(given)}, {_TOPIC} says '
                      f'at {text_of(found)}: the parameters count')

    def _log(self, what: str, is_good: bool = False) -> None:
        if what != self.last_logged:
            self.last_logged = what
            if is_good:
                self._logger.info(what)
            else:
                self._logger.warning(what)


def text_of(mount: Mount) -> str:
    """Return a mount as people read it."""
    turn = ', '.join(f'{round(math.degrees(angle))}' for angle in (
        mount.roll, mount.pitch, mount.yaw))
    return (f'({mount.x:.3f}, {mount.y:.3f}, {mount.z:.3f}) m, turned by {turn} degrees (roll, '
            f'pitch, yaw)')


def are_alike(first: Mount, second: Mount) -> bool:
    """Return whether two places of a laser are the same, but for its height and rounding."""
    turned = math.acos(min(max(
        (float((first.rotation * second.rotation).sum()) - 1.0) / 2.0, -1.0), 1.0))
    distance = math.hypot(first.x - second.x, first.y - second.y)
    return distance <= _MAX_DISTANCE and turned <= _MAX_ANGLE
