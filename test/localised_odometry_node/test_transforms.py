"""Odometry in the map's frame by `/tf`: what AMCL and slam_toolbox publish, and what is odd."""

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.parameter import Parameter

from control_field.poses import Placement
from localised_odometry_node.fusion import LocalisedOdometry, LocalisedSettings
from localised_odometry_node.node import LocalisedOdometryNode
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.node.tf_type import transforms_type
from msgs_bridge.sensing.live_frames import LiveFrames
import ros_helpers
from strategies import few
from transform_messages import transforms_message, type_of_transforms

BY_TF = LocalisedSettings(pose_topic='/tf')


def odom(k, x=None):
    return Pose(100.0 + 0.05 * k, 0.01 * k if x is None else x, 0.0, 0.0, 0.1, 0.0)


def node_of(ros_node, **parameters):
    return LocalisedOdometryNode(context=ros_node.context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])


class TestFrames:
    def test_the_origin_of_odometry_through_a_frame_between(self):
        frames = LiveFrames('/tf')
        assert frames.origin('odom', 'map') is None
        told = frames.update(transforms_message(
            ('map', 'earth_odom', 1.0, 2.0, math.pi / 2), ('odom', 'base_link', 9.0, 9.0, 0.0),
            stamp=7.5))
        assert told == ['earth_odom', 'base_link']
        assert frames.origin('odom', 'map') is None
        frames.update(transforms_message(('earth_odom', 'odom', 3.0, 0.0, 0.0), stamp=0.0))
        stamp, origin = frames.origin('/odom', '/map')
        assert (stamp, *origin) == pytest.approx((7.5, 1.0, 5.0, math.pi / 2))
        assert frames.above('odom') == {'odom', 'earth_odom', 'map'}
        assert frames.origin('odom', 'base_link') is None

    def test_the_newest_counts_and_what_is_no_place_is_refused(self):
        frames = LiveFrames('/tf')
        for x in (1.0, 2.0):
            frames.update(transforms_message(('map', 'odom', x, 0.0, 0.0), stamp=x))
        assert frames.origin('odom', 'map')[1].x == 2.0
        with pytest.raises(ValueError, match=r"/tf: where 'odom' sits is no place"):
            frames.update(transforms_message(('map', 'odom', math.nan, 0.0, 0.0)))


class TestFusion:
    def test_odometry_is_carried_by_the_newest_transform(self):
        localised = LocalisedOdometry(BY_TF)
        with pytest.raises(ValueError, match=r'^/tf: no odometry'):
            localised.on_origin(99.0, Placement(0.0, 0.0, 0.0))
        assert localised.place(odom(0)) is None
        assert 'no transform of odometry has arrived on /tf' in localised.problem
        localised.on_origin(101.0, Placement(5.0, 0.0, math.pi / 2))  # dated a second ahead
        placed = localised.place(odom(1))
        assert (placed.x, placed.y, placed.frame_id) == (
            pytest.approx(5.0), pytest.approx(0.01), 'map')
        localised.on_origin(100.9, Placement(9.0, 0.0, 0.0))  # older: passed over
        assert localised.place(odom(2)).x == pytest.approx(5.0)
        assert localised.n_leaps == 0
        localised.on_origin(101.1, Placement(9.0, 0.0, math.pi / 2))
        assert localised.place(odom(3)).x == pytest.approx(9.0)
        assert (localised.n_leaps, localised.last_leap) == (1, pytest.approx(4.0))

    def test_one_that_comes_no_more_is_said_and_a_fixed_one_holds(self):
        for stamp in (101.0, 0.0):
            localised = LocalisedOdometry(BY_TF)
            localised.place(odom(0))
            localised.on_origin(stamp, Placement(1.0, 0.0, 0.0))
            placed = [localised.place(odom(k)) for k in range(1, 400)]
            assert (placed[-1] is None) == bool(stamp)
            assert bool(localised.problem) == bool(stamp)
            if stamp:
                assert 'no transform of odometry has arrived on /tf for 4.0 m' in (
                    localised.problem)

    @given(st.lists(st.floats(-2.0, 2.0), max_size=8))
    @few
    def test_small_corrections_are_made_up_for_without_a_jump(self, corrections):
        localised = LocalisedOdometry(BY_TF)
        localised.place(odom(0))
        localised.on_origin(100.0, Placement(0.0, 0.0, 0.0))
        last = localised.place(odom(1))
        for k, off in enumerate(corrections, 2):
            localised.on_origin(100.0 + k, Placement(0.2 * off, 0.0, 0.0))
            placed = localised.place(odom(k))
            assert abs(placed.x - last.x) < 0.01 + 0.1 * 0.05 + 1e-9 or localised.n_leaps
            last = placed


class TestNode:
    def test_without_tf2_msgs_it_says_what_to_do(self, ros_node):
        if transforms_type() is not None:
            pytest.skip('tf2_msgs is installed')
        with pytest.raises(ValueError, match='takes tf2_msgs'):
            node_of(ros_node, pose_topic='/tf')

    def test_transforms_in_localised_odometry_out(self, ros_node, monkeypatch):
        kind = type_of_transforms(monkeypatch)
        node, seen = node_of(ros_node, pose_topic='/tf'), []
        monkeypatch.setattr(node._publisher, 'publish', seen.append)
        try:
            node._on_odometry(odometry_from_pose(odom(0), 'base_link'))
            node._look()
            assert not seen
            said = dict(ros_node.get_topic_names_and_types())
            ros_helpers.wait_until(
                lambda: dict(ros_node.get_topic_names_and_types()).get('/tf') == [
                    'tf2_msgs/msg/TFMessage'], node=ros_node, what=f'/tf among {sorted(said)}')
            node._on_transforms(transforms_message(
                ('base_link', 'wheel', 0.0, 0.2, 0.0), ('odom', 'base_link', 0.0, 0.0, 0.0)))
            node._on_odometry(odometry_from_pose(odom(1), 'base_link'))
            assert not seen
            assert kind is transforms_type()
            node._on_transforms(transforms_message(
                ('map', 'odom', 3.0, 4.0, math.pi / 2), stamp=101.0))
            node._on_odometry(odometry_from_pose(odom(2), 'base_link'))
            assert seen[-1].header.frame_id == 'map'
            assert seen[-1].pose.pose.position.y == pytest.approx(4.02)
            node._on_transforms(b'none')
            assert 'no transforms' in node._localised.pose_refusal
        finally:
            node.destroy_node()
