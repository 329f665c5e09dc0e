"""Poses of the robot: Odometry, PoseStamped, PoseWithCovarianceStamped, and their stamps."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, Final

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

#: How far a quaternion's length may be from 1; it is normalised then, and refused beyond.
QUATERNION_TOLERANCE: Final = 0.01
#: Farther from the origin is nowhere, [m]: cells there have no numbers.
MAX_PLACE: Final = 1e9
#: Variances of x, y and yaw where the sender names none, [m^2, m^2, rad^2].
DEFAULT_VARIANCES: Final = (1e-4, 1e-4, 1e-4)
#: Who has to have the frame of the odometry.
FRAME_OWNERS: Final = 'learner_node and neighbourhood_node'
_MAX_SECONDS: Final = 2**31 - 1


@dataclass(frozen=True, slots=True)
class Pose:
    """
    Where the robot is and how it moves.

    Parameters
    ----------
    stamp : float, [s]
        Of the message it came from.
    x, y : float, [m]
        In ``frame_id``.
    yaw : float, [rad]
        Counter-clockwise from +x, -pi to pi.
    v, w : float, [m/s, rad/s]
        Forward and turning speed; 0 where the message carries none.
    frame_id : str
        The frame of x, y and yaw.

    """

    stamp: float
    x: float
    y: float
    yaw: float
    v: float = 0.0
    w: float = 0.0
    frame_id: str = 'odom'


def seconds_from_stamp(stamp: Any) -> float:
    """
    Return the seconds of a Time message.

    Raises
    ------
    ValueError
        If it is before 0 or its nanoseconds make a second or more.

    """
    sec, nanosec = stamp.sec, stamp.nanosec
    if sec < 0 or nanosec >= 1_000_000_000:
        raise ValueError(
            f'stamp is {sec} s {nanosec} ns, must be 0 s or more and below 1000000000 ns')
    return float(sec + nanosec * 1e-9)


def stamp_from_seconds(seconds: float) -> Time:
    """
    Return the Time message of float seconds, rounded to the nearest nanosecond.

    Seconds -> stamp -> seconds gives the same float; stamp -> seconds -> stamp the same stamp up
    to about 50 days. Who answers a message of the present era copies its stamp instead.

    Raises
    ------
    ValueError
        If it is not finite, negative, or more than a Time holds.

    """
    if not 0.0 <= seconds <= _MAX_SECONDS:
        raise ValueError(f'{seconds} s is no stamp, must be 0 to {_MAX_SECONDS}')
    whole = math.floor(seconds)
    nanoseconds = round((seconds - whole) * 1e9)
    return Time(sec=whole + nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def check_frame(frame_id: str, expected: str, name: str, nodes: str = '') -> None:
    """
    Compare a message's frame with the one it must be in; see `problem_with_frame`.

    Raises
    ------
    ValueError
        If they differ; the message names ``name`` and both frames.

    """
    if problem := problem_with_frame(frame_id, expected, name, nodes):
        raise ValueError(problem)


def problem_with_frame(frame_id: str, expected: str, name: str, nodes: str = '') -> str:
    """
    Say that a message is in another frame, a leading slash aside; empty if it is not.

    Parameters
    ----------
    frame_id, expected : str
        What it is and what it must be.
    name : str
        What the message is called.
    nodes : str
        Whose parameter `frame_id` is to be set if the message is right.

    """
    if frame_id.lstrip('/') == expected.lstrip('/'):
        return ''
    remedy = f' (set frame_id:={ascii(frame_id[:80])[1:-1]} of {nodes})'
    return f'{name}: frame is {frame_id[:80]!r}, must be {expected!r}' + (
        remedy if nodes and frame_id else '')


def yaw_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """
    Return the yaw of a rotation, [rad], -pi to pi.

    Raises
    ------
    ValueError
        If the quaternion is not finite or its length is not 1 within `QUATERNION_TOLERANCE`.

    """
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(length - 1.0) <= QUATERNION_TOLERANCE:
        raise ValueError(f'orientation is ({x}, {y}, {z}, {w}), must be a quaternion of length 1')
    # Both arguments are homogeneous in the quaternion, so its length cancels out.
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def _check_finite(name: str, value: tuple[float, ...], what: str) -> None:
    if not all(map(math.isfinite, value)):
        raise ValueError(f'{name}: {what} is {value}, must be finite')


def _pose(name: str, header: Any, pose: Any, v: float = 0.0, w: float = 0.0) -> Pose:
    position, turn = pose.position, pose.orientation
    x, y = position.x, position.y
    if not (abs(x) <= MAX_PLACE and abs(y) <= MAX_PLACE):
        raise ValueError(f'{name}: position is ({x}, {y}), must be finite and within '
                         f'{MAX_PLACE:g} m')
    _check_finite(name, (v, w), 'velocity')
    try:
        yaw = yaw_from_quaternion(turn.x, turn.y, turn.z, turn.w)
        stamp = seconds_from_stamp(header.stamp)
    except (ValueError, OverflowError) as error:
        raise ValueError(f'{name}: {error}') from None
    return Pose(stamp, x, y, yaw, v, w, header.frame_id)


def pose_from_odometry(msg: Any) -> Pose:
    """
    Read an Odometry message.

    Raises
    ------
    ValueError
        If a coordinate or a speed is not finite, the place beyond `MAX_PLACE`, the orientation no
        rotation, or the stamp none.

    """
    twist = msg.twist.twist
    return _pose('odom', msg.header, msg.pose.pose, twist.linear.x, twist.angular.z)


def pose_from_pose_stamped(msg: Any, name: str = 'goal_pose') -> Pose:
    """
    Read a PoseStamped message; see `pose_from_odometry` for what is refused.

    Parameters
    ----------
    msg : PoseStamped
        What arrived.
    name : str
        What an error calls it.

    """
    return _pose(name, msg.header, msg.pose)


def pose_from_initialpose(msg: Any, name: str = 'initialpose') -> Pose:
    """Read a PoseWithCovarianceStamped message; like `pose_from_pose_stamped`."""
    return _pose(name, msg.header, msg.pose.pose)


def _fill(header: Any, target: Any, pose: Pose) -> None:
    header.stamp = stamp_from_seconds(pose.stamp)
    header.frame_id = pose.frame_id
    target.position.x = float(pose.x)
    target.position.y = float(pose.y)
    target.orientation.z = math.sin(pose.yaw / 2.0)
    target.orientation.w = math.cos(pose.yaw / 2.0)


def covariance_from_variances(variances: Sequence[float]) -> list[float]:
    """Return the 6x6 covariance, row by row, of variances of x, y and yaw."""
    covariance = [0.0] * 36
    covariance[0], covariance[7], covariance[35] = map(float, variances)
    return covariance


def variances_from_covariance(
    covariance: Sequence[float], name: str,
) -> tuple[float, float, float]:
    """
    Return the variances of x, y [m^2] and yaw [rad^2] of a 6x6 covariance, row by row.

    Raises
    ------
    ValueError
        If one is negative or not finite; the message begins with ``name``.

    """
    x, y, yaw = (float(covariance[i]) for i in (0, 7, 35))
    if not (0.0 <= x < math.inf and 0.0 <= y < math.inf and 0.0 <= yaw < math.inf):
        raise ValueError(f'{name}: covariance is ({x}, {y}, {yaw}) for x, y and yaw, must be '
                         f'finite and not negative')
    return x, y, yaw


def odometry_from_pose(
    pose: Pose, child_frame_id: str = 'base_footprint',
    pose_variances: Sequence[float] = DEFAULT_VARIANCES,
    twist_variances: Sequence[float] = DEFAULT_VARIANCES,
) -> Odometry:
    """
    Write an Odometry message.

    Parameters
    ----------
    pose : Pose
        Where the robot is and how it moves.
    child_frame_id : str
        The robot's body, the frame of v and w.
    pose_variances, twist_variances : sequence of 3 floats
        Of x, y and yaw, and of their speeds.

    """
    msg = Odometry(child_frame_id=child_frame_id)
    _fill(msg.header, msg.pose.pose, pose)
    msg.pose.covariance = covariance_from_variances(pose_variances)
    msg.twist.twist.linear.x = float(pose.v)
    msg.twist.twist.angular.z = float(pose.w)
    msg.twist.covariance = covariance_from_variances(twist_variances)
    return msg


def pose_stamped_from_pose(pose: Pose) -> PoseStamped:
    """Write a PoseStamped message; v and w have no place in it."""
    msg = PoseStamped()
    _fill(msg.header, msg.pose, pose)
    return msg


def initialpose_from_pose(
    pose: Pose, variances: Sequence[float] = DEFAULT_VARIANCES,
) -> PoseWithCovarianceStamped:
    """Write a PoseWithCovarianceStamped message; v and w have no place in it."""
    msg = PoseWithCovarianceStamped()
    _fill(msg.header, msg.pose.pose, pose)
    msg.pose.covariance = covariance_from_variances(variances)
    return msg
