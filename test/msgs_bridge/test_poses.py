"""Poses and stamps: round trips, and what is refused."""

import math

from builtin_interfaces.msg import Time
from hypothesis import given
from hypothesis import strategies as st
import pytest

from bridge_helpers import poses, spoil
from msgs_bridge.messages.poses import (
    check_frame, covariance_from_variances, initialpose_from_pose, odometry_from_pose, Pose,
    pose_from_initialpose, pose_from_odometry, pose_from_pose_stamped, pose_stamped_from_pose,
    seconds_from_stamp, stamp_from_seconds, variances_from_covariance, yaw_from_quaternion)

POSE = Pose(1.5, 2.0, 3.0, 0.5, 0.1, 0.2)


def is_same_place(first, second):
    return (first.x, first.y, first.frame_id) == (second.x, second.y, second.frame_id) and abs(
        math.remainder(first.yaw - second.yaw, math.tau)) < 1e-12 and (
        abs(first.stamp - second.stamp) <= 5e-10 + 1e-15 * second.stamp)


@given(poses)
def test_odometry_round_trip(pose):
    read = pose_from_odometry(odometry_from_pose(pose))
    assert is_same_place(read, pose)
    assert (read.v, read.w) == (pose.v, pose.w)


@given(poses)
def test_poses_without_velocity_round_trip(pose):
    for read in (pose_from_pose_stamped(pose_stamped_from_pose(pose)),
                 pose_from_initialpose(initialpose_from_pose(pose))):
        assert is_same_place(read, pose)
        assert (read.v, read.w) == (0.0, 0.0)


@given(st.integers(0, 4_000_000), st.integers(0, 999_999_999))
def test_a_stamp_of_simulated_time_survives_seconds(sec, nanosec):
    assert stamp_from_seconds(
        seconds_from_stamp(Time(sec=sec, nanosec=nanosec))) == Time(sec=sec, nanosec=nanosec)


@given(st.integers(4_000_000, 2**31 - 2), st.integers(0, 999_999_999))
def test_seconds_of_the_present_survive_a_stamp(sec, nanosec):
    seconds = seconds_from_stamp(Time(sec=sec, nanosec=nanosec))
    assert seconds_from_stamp(stamp_from_seconds(seconds)) == seconds


def test_nanoseconds_round_up_into_the_next_second():
    assert stamp_from_seconds(1.9999999999) == Time(sec=2, nanosec=0)


@pytest.mark.parametrize('seconds', [-1e-9, math.nan, math.inf, 2.0**31])
def test_no_stamp(seconds):
    with pytest.raises(ValueError, match='is no stamp'):
        stamp_from_seconds(seconds)


@pytest.mark.parametrize(('sec', 'nanosec'), [(-1, 0), (0, 1_000_000_000), (1, 2**32 - 1)])
def test_a_stamp_that_is_none_is_refused(sec, nanosec):
    msg = odometry_from_pose(POSE)
    msg.header.stamp.sec, msg.header.stamp.nanosec = sec, nanosec
    with pytest.raises(ValueError, match='odom: stamp is'):
        pose_from_odometry(msg)


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('name', [
    'pose.pose.position.x', 'pose.pose.position.y', 'pose.pose.orientation.w',
    'twist.twist.linear.x', 'twist.twist.angular.z'])
def test_what_is_not_finite_is_refused(name, value):
    msg = odometry_from_pose(POSE)
    spoil(msg, name, value)
    with pytest.raises(ValueError, match=r'odom: .* is \(.*must be'):
        pose_from_odometry(msg)


@pytest.mark.parametrize('quaternion', [
    (0, 0, 0, 0), (0, 0, 0, 0.98), (0, 0, 1.02, 0), (1e200, 0, 0, 1), (0, 0, math.nan, 1)])
def test_what_is_no_rotation_is_refused(quaternion):
    with pytest.raises(ValueError, match='quaternion of length 1'):
        yaw_from_quaternion(*quaternion)


@given(st.floats(-3.1, 3.1), st.floats(0.991, 1.009))
def test_a_length_that_is_nearly_one_does_not_change_the_yaw(yaw, length):
    read = yaw_from_quaternion(0, 0, length * math.sin(yaw / 2), length * math.cos(yaw / 2))
    assert read == pytest.approx(yaw, abs=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_the_yaw_of_a_robot_that_leans_is_that_of_its_heading(yaw, pitch, roll):
    (sy, cy), (sp, cp), (sr, cr) = (
        (math.sin(angle / 2), math.cos(angle / 2)) for angle in (yaw, pitch, roll))
    read = yaw_from_quaternion(
        sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)
    assert read == pytest.approx(yaw, abs=1e-9)


def test_frames_are_compared():
    check_frame('/odom', 'odom', 'odom')
    with pytest.raises(ValueError, match="odom: frame is 'map', must be 'odom'"):
        check_frame('map', 'odom', 'odom')


def test_covariances_are_where_they_belong():
    msg = odometry_from_pose(POSE, 'body', (1, 2, 3), (4, 5, 6))
    assert msg.child_frame_id == 'body'
    assert [msg.pose.covariance[i] for i in (0, 7, 35)] == [1, 2, 3]
    assert [msg.twist.covariance[i] for i in (0, 7, 35)] == [4, 5, 6]
    assert sum(msg.pose.covariance) == 6
    assert variances_from_covariance(msg.twist.covariance, 'odom') == (4, 5, 6)
    assert variances_from_covariance(
        initialpose_from_pose(POSE, (7, 8, 9)).pose.covariance, 'initialpose') == (7, 8, 9)
    assert variances_from_covariance([0.0] * 36, 'odom') == (0, 0, 0)


@pytest.mark.parametrize('place', [0, 1, 2])
@pytest.mark.parametrize('value', [-1e-9, math.nan, math.inf])
def test_variances_that_are_none_are_refused(place, value):
    variances = [1.0, 1.0, 1.0]
    variances[place] = value
    with pytest.raises(ValueError, match='amcl_pose: covariance is'):
        variances_from_covariance(covariance_from_variances(variances), 'amcl_pose')


@pytest.mark.parametrize('x', [1e300, -1.7e308, 1.1e9])
def test_a_place_that_no_cell_has_is_refused(x):
    msg = odometry_from_pose(Pose(1.0, 0.0, 0.0, 0.0))
    msg.pose.pose.position.x = x
    with pytest.raises(ValueError, match='within 1e'):
        pose_from_odometry(msg)
