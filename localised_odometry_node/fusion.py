"""
Odometry in the frame of a map: the wheels say how the robot moves, a localisation where it is.

Between two poses of the localisation the robot moves as its odometry says. Where they differ, the
difference is made up for slowly, so that whoever drives by it sees no jump; a large one (the robot
was found somewhere else) at once.
"""

from collections import deque
from dataclasses import dataclass, replace
import math
from typing import Final

from control_field.parameters import check_fields, parameter
from control_field.poses import Placement
from msgs_bridge.messages.poses import check_frame, Pose

#: Settings that topics are made from: they hold from start to end.
FIXED: Final = ('pose_topic', 'frame_id')
#: Odometry that is kept: poses of a localisation come later than that of their time.
_N_KEPT: Final = 400
#: How far odometry may leap between two messages beside what its speed makes, [m] and [rad].
_SLACK: Final = 0.1
_REMEDY: Final = 'localisations tell it when the robot moves: drive a little, or set its pose'
#: The origin: seen from here, a place is itself.
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
        'amcl_pose', 'PoseWithCovarianceStamped of the localisation; /tf: the transform from '
        'frame_id to the frame of odometry, as AMCL and slam_toolbox publish it (where tf2_msgs '
        'is installed)')
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
    speed_max: float = parameter(
        1.5, 'faster than this no wheel is: odometry was reset, and a pose has to come first',
        unit='m/s', low=0.01, high=100.0)
    turn_max: float = parameter(
        8.0, 'the same for turning', unit='rad/s', low=0.01, high=100.0)
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
        #: What was wrong with the newest odometry and the newest pose; empty if nothing was.
        self.odometry_refusal = self.pose_refusal = ''
        #: How often, and how far the last time, [m], the localisation found the robot elsewhere.
        self.n_leaps, self.last_leap = 0, 0.0
        self._begin_anew()

    def _begin_anew(self) -> None:
        #: The last odometry, and how far the wheels had driven by then, [m].
        self._kept: deque[tuple[Pose, float]] = deque(maxlen=_N_KEPT)
        #: Where the origin of odometry lies in the map: as it is used, and by the last pose.
        self._used: Placement | None = None
        self._seen: Placement | None = None
        #: Stamp of that pose, and how far the wheels had driven by then.
        self._seen_at, self._seen_after = -math.inf, 0.0

    @property
    def odometry_frame(self) -> str:
        """Return the frame of the newest odometry, empty if there is none."""
        return self._kept[-1][0].frame_id if self._kept else ''

    @property
    def problem(self) -> str:
        """Return why nothing is published, empty if something is."""
        topic = self.settings.pose_topic
        if self.odometry_refusal:
            return f'odometry arrives but does not count: {self.odometry_refusal}'
        if not self._kept:
            return 'no odometry has arrived yet'
        driven = self._kept[-1][1] - self._seen_after
        if self._seen is not None and driven <= self.settings.trusted_distance:
            return ''
        if self.pose_refusal:
            return f'poses arrive on {topic} but do not count: {self.pose_refusal}'
        if self._seen is None:
            since = ' since odometry was reset' * math.isfinite(self._seen_at)
            return f'no {_word(topic)} has arrived on {topic}{since} ({_REMEDY})'
        return (f'no {_word(topic)} has arrived on {topic} for {driven:.1f} m, must be one every '
                f'{self.settings.trusted_distance:g} m')

    def on_pose(self, pose: Pose) -> None:
        """
        Take in a pose of the localisation; one that is older than the last is passed over.

        Raises
        ------
        ValueError
            If it is in another frame, or there is no odometry of its time.

        """
        settings = self.settings
        check_frame(pose.frame_id, settings.frame_id, settings.pose_topic)
        if not self._kept:
            raise ValueError(f'{settings.pose_topic}: {self.problem}')
        then, driven = min(self._kept, key=lambda entry: abs(entry[0].stamp - pose.stamp))
        off = abs(then.stamp - pose.stamp)
        if off > settings.timeout:
            raise ValueError(
                f'{settings.pose_topic}: its stamp is {off:.2f} s off the nearest odometry, must '
                f'be at most {settings.timeout:g} s ({_REMEDY})')
        if pose.stamp > self._seen_at:
            self._seen = _place(pose).compose(_ORIGIN.seen_from(_place(then)))
            self._seen_at, self._seen_after = pose.stamp, driven

    def on_origin(self, stamp: float, origin: Placement) -> None:
        """
        Take in where odometry begins in the map, as `/tf` says.

        Parameters
        ----------
        stamp : float, [s]
            Of the transform; localisations date it ahead, so it is not compared with odometry. One
            older than the last is passed over; one at 0 is fixed and holds for ever.
        origin : Placement

        Raises
        ------
        ValueError
            If there is no odometry.

        """
        if not self._kept:
            raise ValueError(f'{self.settings.pose_topic}: {self.problem}')
        if stamp and stamp <= self._seen_at:
            return
        self._seen, self._seen_after = origin, self._kept[-1][1] if stamp else math.inf
        self._seen_at = stamp or self._seen_at

    def place(self, odometry: Pose) -> Pose | None:
        """
        Return where the robot is in the map; None as long as nobody knows.

        Parameters
        ----------
        odometry : Pose
            What the wheels say. A late one is passed over. One whose stamp goes back by more than
            `timeout`, or a step that no wheel can make, begins anew: a pose has to come first.

        Raises
        ------
        ValueError
            If it is in the frame of the map already.

        """
        settings = self.settings
        if odometry.frame_id.lstrip('/') == settings.frame_id.lstrip('/'):
            raise ValueError(f'odom: frame is {odometry.frame_id[:80]!r} already, must be that of '
                             f'the wheels')
        last, driven = self._kept[-1] if self._kept else (odometry, 0.0)
        dt = odometry.stamp - last.stamp
        if -settings.timeout <= dt < 0.0:
            return None
        step = math.hypot(odometry.x - last.x, odometry.y - last.y)
        turn = abs(math.remainder(odometry.yaw - last.yaw, math.tau))
        if dt < 0.0 or step > settings.speed_max * dt + _SLACK or (
                turn > settings.turn_max * dt + _SLACK):
            self._begin_anew()
            # Poses of the localisation before belong to the odometry before.
            self._seen_at, step = odometry.stamp if dt >= 0.0 else -math.inf, 0.0
        self._kept.append((odometry, driven + step))
        if self._seen is None or self.problem:
            return None
        here = _place(odometry)
        there = self._seen.compose(here)
        if self._used is not None:
            there = self._towards(self._used.compose(here), there, dt)
        self._used = there.compose(_ORIGIN.seen_from(here))
        return replace(odometry, x=there.x, y=there.y, yaw=math.remainder(there.yaw, math.tau),
                       frame_id=settings.frame_id)

    def _towards(self, believed: Placement, seen: Placement, dt: float) -> Placement:
        """Return the next place on the way from the believed one to the right one."""
        settings, dx, dy = self.settings, seen.x - believed.x, seen.y - believed.y
        turn, distance = math.remainder(seen.yaw - believed.yaw, math.tau), math.hypot(dx, dy)
        if distance > settings.jump_distance or abs(turn) > settings.jump_turn:
            self.n_leaps, self.last_leap = self.n_leaps + 1, distance
            return seen
        share = min(1.0, settings.catch_up_speed * dt / distance) if distance else 1.0
        most = settings.catch_up_turn * dt
        return Placement(believed.x + share * dx, believed.y + share * dy,
                         believed.yaw + max(-most, min(most, turn)))


def is_tf(topic: str) -> bool:
    """Return whether a pose topic stands for transforms."""
    return topic.lstrip('/') == 'tf'


def _word(topic: str) -> str:
    """Return what arrives on a pose topic."""
    return 'transform of odometry' if is_tf(topic) else 'pose'


def _place(pose: Pose) -> Placement:
    return Placement(pose.x, pose.y, pose.yaw)
