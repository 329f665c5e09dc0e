"""
Odometry in the frame of a map: the wheels say how the robot moves, a localisation where it is.

Between two poses of the localisation the robot moves as its odometry says. Where they differ, the
difference is made up for slowly, so that whoever drives by it sees no jump; a large one (the robot
was found somewhere else) at once.
"""

from dataclasses import dataclass, replace
import math
from typing import Final

from control_field.parameters import check_fields, parameter
from msgs_bridge.laser_sight import Placement
from msgs_bridge.neighbourhood_maker import PoseHistory
from msgs_bridge.poses import check_frame, Pose

#: Settings that topics are made from: they hold from start to end.
FIXED: Final = ('pose_topic', 'frame_id')
#: Nowhere: seen from here, a place is itself.
_ORIGIN: Final = Placement(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class LocalisedSettings:
    """
    Settings of `localised_odometry_node`; see the metadata of each field.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    pose_topic: str = parameter(
        'amcl_pose', 'PoseWithCovarianceStamped of the localisation')
    frame_id: str = parameter(
        'map', 'frame of the localisation, and of what is published: the frame_id of learner_node '
        'and neighbourhood_node')
    timeout: float = parameter(
        0.5, 'how far the stamp of a pose may be from that of any odometry', unit='s', low=0.01,
        high=60.0)
    catch_up_speed: float = parameter(
        0.1, 'how fast a difference is made up for', unit='m/s', low=0.001, high=10.0)
    catch_up_turn: float = parameter(
        0.3, 'how fast a difference in heading is made up for', unit='rad/s', low=0.001,
        high=10.0)
    jump_distance: float = parameter(
        0.5, 'difference from which it is made up for at once', unit='m', low=0.01, high=100.0)
    jump_turn: float = parameter(
        0.5, 'difference in heading from which it is made up for at once', unit='rad', low=0.01,
        high=math.pi)
    trusted_distance: float = parameter(
        3.0, 'how far the robot may drive by its wheels alone; then nothing is published until '
        'a pose comes', unit='m', low=0.1, high=1e4)

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)


class LocalisedOdometry:
    """
    Carries odometry into the frame of a localisation.

    Parameters
    ----------
    settings : LocalisedSettings

    """

    def __init__(self, settings: LocalisedSettings) -> None:
        """Start without a pose."""
        self.settings = settings
        self._odometry = PoseHistory()
        self._last: Pose | None = None
        #: Where the origin of odometry lies in the map: as it is used, and as it was last seen.
        self._used: Placement | None = None
        self._seen: Placement | None = None
        self._driven = 0.0

    @property
    def problem(self) -> str:
        """Say why nothing is published, empty if something is."""
        if self._last is None:
            return 'no odometry has arrived'
        if self._seen is None:
            return f'no pose has arrived on {self.settings.pose_topic}'
        if self._driven > self.settings.trusted_distance:
            return (f'no pose has arrived on {self.settings.pose_topic} for {self._driven:.1f} m, '
                    f'must be one every {self.settings.trusted_distance:g} m')
        return ''

    def saw_pose(self, pose: Pose) -> None:
        """
        Take in a pose of the localisation.

        Raises
        ------
        ValueError
            If it is in another frame, or there is no odometry of its time.

        """
        check_frame(pose.frame_id, self.settings.frame_id, self.settings.pose_topic)
        then = self._odometry.nearest(pose.stamp)
        if then is None or abs(then.stamp - pose.stamp) > self.settings.timeout:
            age = 'no odometry has arrived' if then is None else (
                f'its stamp is {abs(then.stamp - pose.stamp):.2f} s off the nearest odometry, '
                f'must be at most {self.settings.timeout:g} s')
            raise ValueError(f'{self.settings.pose_topic}: {age}')
        self._seen = _place(pose).compose(_ORIGIN.seen_from(_place(then)))
        self._driven = 0.0

    def place(self, odometry: Pose) -> Pose | None:
        """
        Return where the robot is in the map; None as long as nobody knows.

        Parameters
        ----------
        odometry : Pose
            What the wheels say. A late one is passed over; one whose stamp goes back by more than
            `timeout` begins anew: a pose has to come first.

        """
        last = self._last
        dt = 0.0 if last is None else odometry.stamp - last.stamp
        if -self.settings.timeout <= dt < 0.0:
            return None
        self._last = odometry
        self._odometry.add(odometry)
        if last is None or dt < 0.0:
            self._seen = self._used = None
        else:
            self._driven += math.hypot(odometry.x - last.x, odometry.y - last.y)
        if self._seen is None or self.problem:
            return None
        here = _place(odometry)
        there = self._seen.compose(here)
        if self._used is not None:
            there = self._towards(self._used.compose(here), there, dt)
        self._used = there.compose(_ORIGIN.seen_from(here))
        return replace(odometry, x=there.x, y=there.y, yaw=math.remainder(there.yaw, math.tau),
                       frame_id=self.settings.frame_id)

    def _towards(self, believed: Placement, seen: Placement, dt: float) -> Placement:
        """Return where the robot is said to be on the way from one place to the other."""
        settings, dx, dy = self.settings, seen.x - believed.x, seen.y - believed.y
        turn, distance = math.remainder(seen.yaw - believed.yaw, math.tau), math.hypot(dx, dy)
        if distance > settings.jump_distance or abs(turn) > settings.jump_turn:
            return seen
        share = min(1.0, settings.catch_up_speed * dt / distance) if distance else 1.0
        most = settings.catch_up_turn * dt
        return Placement(believed.x + share * dx, believed.y + share * dy,
                         believed.yaw + max(-most, min(most, turn)))


def _place(pose: Pose) -> Placement:
    return Placement(pose.x, pose.y, pose.yaw)
