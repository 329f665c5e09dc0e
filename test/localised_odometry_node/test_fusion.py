"""Odometry in the map's frame: where it leads, that it never jumps; the node on real topics."""

from dataclasses import replace
import math

from geometry_msgs.msg import PoseWithCovarianceStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
import pytest

from control_field.poses import Placement
from localised_odometry_node.fusion import LocalisedOdometry, LocalisedSettings
from msgs_bridge.messages.poses import (
    initialpose_from_pose, odometry_from_pose, Pose, pose_from_odometry)
from msgs_bridge.node import qos
import ros_helpers

MODULE = 'localised_odometry_node.node'
DT = 0.05
places = st.builds(
    Placement, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-math.pi, math.pi))


def odom(k, x=0.0, y=0.0, yaw=0.0):
    return Pose(100.0 + k * DT, x, y, yaw, 0.1, 0.2)


def in_map(origin, pose, frame_id='map'):
    """Return what a localisation says of a pose if odometry begins at `origin` of the map."""
    x, y, yaw = origin.compose(Placement(pose.x, pose.y, pose.yaw))
    return Pose(pose.stamp, x, y, math.remainder(yaw, math.tau), frame_id=frame_id)


def drive(k):
    """Return a way that bends."""
    return odom(k, 0.01 * k, math.sin(0.01 * k), math.atan(math.cos(0.01 * k)))


def apart(a, b):
    return math.hypot(a.x - b.x, a.y - b.y), abs(math.remainder(a.yaw - b.yaw, math.tau))


@given(places, places)
def test_a_place_seen_from_another_leads_back(one, other):
    again = other.compose(one.seen_from(other))
    assert apart(again, one) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))


class TestLocalisedOdometry:

    @given(places)
    def test_one_pose_carries_all_the_odometry_that_follows(self, origin):
        localised = LocalisedOdometry(LocalisedSettings())
        assert localised.place(drive(0)) is None
        localised.on_pose(in_map(origin, drive(0)))
        for k in range(1, 60):
            placed = localised.place(drive(k))
            assert max(apart(placed, in_map(origin, drive(k)))) < 1e-6
            assert (placed.stamp, placed.v, placed.w) == (drive(k).stamp, 0.1, 0.2)
            assert placed.frame_id == 'map'

    @given(places, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.4, 0.4))
    def test_a_small_difference_is_made_up_for_without_a_jump(self, origin, dx, dy, turn):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.place(drive(0))
        localised.on_pose(in_map(origin, drive(0)))
        before = localised.place(drive(1))
        seen = in_map(origin, drive(1))
        found = Placement(seen.x + dx, seen.y + dy, seen.yaw + turn)
        here = Placement(drive(1).x, drive(1).y, drive(1).yaw)
        better = found.compose(Placement(0.0, 0.0, 0.0).seen_from(here))
        localised.on_pose(in_map(better, drive(1)))
        for k in range(2, 200):
            placed = localised.place(drive(k))
            step, turned = apart(placed, before)
            driven, bent = apart(drive(k), drive(k - 1))
            assert step <= driven + 0.1 * DT + 1e-9
            assert turned <= bent + 0.3 * DT + 1e-9
            before = placed
        assert max(apart(before, in_map(better, drive(199)))) < 1e-6

    @pytest.mark.parametrize('far', [Placement(0.6, 0.0, 0.0), Placement(0.0, 0.0, 1.0)])
    def test_who_is_found_elsewhere_is_there_at_once(self, far):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.place(odom(0))
        localised.on_pose(in_map(Placement(0.0, 0.0, 0.0), odom(0)))
        localised.place(odom(1))
        localised.on_pose(in_map(far, odom(1)))
        assert max(apart(localised.place(odom(2)), far)) < 1e-9

    def test_a_pose_of_long_ago_belongs_to_the_odometry_of_then(self):
        localised = LocalisedOdometry(LocalisedSettings())
        for k in range(40):
            localised.place(drive(k))
        origin = Placement(3.0, -4.0, 2.0)
        localised.on_pose(in_map(origin, drive(12)))
        assert max(apart(localised.place(drive(40)), in_map(origin, drive(40)))) < 1e-6

    @pytest.mark.parametrize(('pose', 'words'), [
        (Pose(100.0, 0.0, 0.0, 0.0, frame_id='odom'), "amcl_pose: frame is 'odom', must be 'map'"),
        (Pose(90.0, 0.0, 0.0, 0.0, frame_id='map'), r'amcl_pose: its stamp is 10\.00 s off'),
    ])
    def test_what_cannot_be_used_is_refused(self, pose, words):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.place(odom(0))
        with pytest.raises(ValueError, match=words):
            localised.on_pose(pose)
        assert localised.place(odom(1)) is None
        assert localised.problem.startswith('no pose has arrived on amcl_pose (')

    def test_before_any_odometry_a_pose_says_nothing(self):
        localised = LocalisedOdometry(LocalisedSettings())
        assert localised.problem == 'no odometry has arrived yet'
        with pytest.raises(ValueError, match='no odometry has arrived'):
            localised.on_pose(in_map(Placement(0.0, 0.0, 0.0), odom(0)))

    def test_what_was_refused_is_not_called_absent(self):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.odometry_refusal = "odom: frame is 'map' already"
        assert localised.problem == (
            "odometry arrives but does not count: odom: frame is 'map' already")
        localised.odometry_refusal, localised.pose_refusal = '', "amcl_pose: frame is 'world'"
        localised.place(odom(0))
        assert localised.problem == (
            "poses arrive on amcl_pose but do not count: amcl_pose: frame is 'world'")

    def test_wheels_alone_are_trusted_for_a_while_only(self):
        localised = LocalisedOdometry(LocalisedSettings(trusted_distance=1.0))
        localised.place(odom(0))
        localised.on_pose(in_map(Placement(0.0, 0.0, 0.0), odom(0)))
        said = [localised.place(odom(k, 0.1 * k)) for k in range(1, 20)]
        assert [pose is not None for pose in said] == [True] * 10 + [False] * 9
        assert localised.problem.startswith('no pose has arrived on amcl_pose for 1.9 m')
        localised.on_pose(in_map(Placement(0.0, 0.0, 0.0), odom(19, 1.9)))
        assert localised.place(odom(20, 2.0)) is not None

    def test_late_odometry_is_passed_over_and_a_new_run_begins_anew(self):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.place(odom(0))
        localised.on_pose(in_map(Placement(1.0, 0.0, 0.0), odom(0)))
        assert localised.place(odom(4)).x == pytest.approx(1.0)
        assert localised.place(odom(2)) is None
        assert localised.place(odom(5)).x == pytest.approx(1.0)
        assert localised.place(odom(-20)) is None
        assert localised.problem.startswith('no pose has arrived on amcl_pose (')

    @pytest.mark.parametrize('reset', [(0.0, 0.0, 0.0), (5.0, 0.4, 0.0), (5.0, 0.0, 2.0)])
    def test_odometry_that_is_reset_leaves_the_robot_nowhere_until_it_is_seen_again(self, reset):
        localised = LocalisedOdometry(LocalisedSettings())
        localised.place(odom(0, 5.0))
        localised.on_pose(in_map(Placement(1.0, 0.0, 0.0), odom(0, 5.0)))
        assert localised.place(odom(1, 5.0)) is not None
        assert localised.place(odom(2, *reset)) is None
        localised.on_pose(in_map(Placement(1.0, 0.0, 0.0), odom(1, 5.0)))  # of before
        assert localised.place(odom(3, *reset)) is None
        found = Placement(7.0, 7.0, 0.5)
        localised.on_pose(in_map(found, odom(3, *reset)))
        expected = in_map(found, odom(4, *reset))
        assert max(apart(localised.place(odom(4, *reset)), expected)) < 1e-9

    def test_an_older_pose_neither_moves_the_robot_nor_makes_up_for_the_way_since(self):
        localised = LocalisedOdometry(LocalisedSettings(trusted_distance=1.02))
        for k in range(20):
            localised.place(odom(k, 0.05 * k))
        localised.on_pose(in_map(Placement(0.0, 0.0, 0.0), odom(9, 0.45)))
        localised.on_pose(in_map(Placement(0.2, 0.0, 0.0), odom(2, 0.1)))
        assert localised.place(odom(20, 1.0)).x == pytest.approx(1.0)
        said = [localised.place(odom(k, 0.05 * k)) is not None for k in range(21, 35)]
        assert said == [True] * 9 + [False] * 5  # a metre after the pose, not after it arrived

    def test_odometry_in_the_map_already_is_refused(self):
        localised = LocalisedOdometry(LocalisedSettings())
        with pytest.raises(ValueError, match="odom: frame is 'map' already"):
            localised.place(Pose(1.0, 0.0, 0.0, 0.0, frame_id='map'))


class TestProcess:

    @pytest.mark.parametrize('profile', [qos.SENSOR, qos.LATCHED], ids=['sensor', 'latched'])
    def test_odometry_and_poses_in_localised_odometry_out(self, ros_node, tmp_path, profile):
        seen = ros_helpers.collect(ros_node, Odometry, 'a/localised_odom', qos.SENSOR)
        odometry = ros_node.create_publisher(Odometry, 'a/odom', qos.ODOMETRY_PUB)
        poses = ros_node.create_publisher(PoseWithCovarianceStamped, 'a/amcl_pose', profile)
        origin, k = Placement(3.0, -4.0, 2.0), 0
        with ros_helpers.start_node(MODULE, tmp_path, namespace='/a') as process:
            def tick(words='', send=True):
                nonlocal k
                k += 1
                pose = drive(k) if send is not None else replace(drive(k), frame_id='map')
                odometry.publish(odometry_from_pose(pose, 'base_link'))
                if send:
                    poses.publish(initialpose_from_pose(in_map(origin, drive(k))))
                return words in process.stderr if words else seen

            wait = {'node': ros_node, 'processes': [process]}
            ros_helpers.wait_until(
                lambda: 'nothing is published: no odometry has arrived' in process.stderr, **wait)
            ros_helpers.wait_until(
                lambda: tick('refused: odom: frame is', send=None), **wait)
            ros_helpers.wait_until(lambda: tick('', send=False) or k > 20, **wait)
            assert not seen
            ros_helpers.wait_until(tick, what='localised odometry', **wait)
            ros_helpers.wait_until(lambda: tick('the robot is localised'), **wait)
            poses.publish(initialpose_from_pose(in_map(origin, drive(k), 'world')))
            ros_helpers.wait_until(
                lambda: "amcl_pose: frame is 'world', must be 'map'" in process.stderr, **wait)
        assert 'Traceback' not in process.stderr
        assert 'incompatible QoS' not in process.stderr
        placed = pose_from_odometry(seen[-1])
        j = round((placed.stamp - 100.0) / DT)
        assert max(apart(placed, in_map(origin, drive(j)))) < 0.05
        assert (seen[-1].header.frame_id, seen[-1].child_frame_id) == ('map', 'base_link')
        assert (seen[-1].twist.twist.linear.x, seen[-1].twist.twist.angular.z) == (0.1, 0.2)

    def test_a_mistake_is_one_line_and_exit_code_2(self, quiet_domain, tmp_path):
        command = ros_helpers.node_command(MODULE, tmp_path)
        process = ros_helpers.run(
            [*command, '--ros-args', '-p', 'catch_up_speed:=0.0'], tmp_path)
        assert process.popen.returncode == 2
        [line] = process.stderr.splitlines()
        assert line.startswith('localised_odometry_node: ')
        assert 'catch_up_speed' in line
