"""Where the laser sits, as `/tf_static` says live; and what is said where nobody can hear that."""

from contextlib import suppress
from functools import cache
import math
import struct
import sys
from types import ModuleType

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan
from visualization_msgs.msg import MarkerArray

from borrowed_type import borrowed_type
from control_field.local_grid import BLOCKED, FREE
from msgs_bridge.messages.poses import odometry_from_pose, Pose, stamp_from_seconds
from msgs_bridge.node import qos
from msgs_bridge.node.tf_type import transforms_type
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.live_frames import LiveFrames
from neighbourhood_node.laser_mount_finder import are_alike, LaserMountFinder
from neighbourhood_node.neighbourhood import NeighbourhoodMaker
from neighbourhood_node.settings import NeighbourhoodSettings
from robot_bags import LASER, quaternion, RobotBag
import ros_helpers
from strategies import few


def odometry(stamp):
    return odometry_from_pose(Pose(stamp, 2.625, 2.625, 0.0))


def scan(stamp):
    """Return what a laser in the middle of a cell sees of a wall 0.175 m ahead of it."""
    angles = 2.0 * math.pi / 360 * np.arange(360)
    with np.errstate(divide='ignore'):
        ranges = 0.175 / np.cos(angles)
    msg = LaserScan(angle_min=0.0, angle_max=float(angles[-1]), angle_increment=angles[1],
                    range_min=0.05, range_max=3.5)
    msg.ranges = np.where((ranges < 0.0) | (ranges > 3.5), np.inf, ranges).astype(np.float32)
    msg.header.stamp = stamp_from_seconds(stamp)
    msg.header.frame_id = 'base_scan'
    return msg


@pytest.fixture(scope='module')
def frames_message(tmp_path_factory):
    """Return what makes a TFMessage of edges: parent, child, x y z, roll pitch yaw."""
    bag = RobotBag(tmp_path_factory.mktemp('bag') / 'bag')
    bag.__exit__()

    def of(*edges):
        msg = bag.make_tf([bag.make(
            'geometry_msgs/TransformStamped', bag.header(1.0, parent), child,
            bag.make('geometry_msgs/Transform', bag.make('geometry_msgs/Vector3', x, y, z),
                     bag.make('geometry_msgs/Quaternion', *quaternion(*turn))))
            for parent, child, x, y, z, *turn in edges])
        return bytes(bag.store.serialize_cdr(msg, bag.tf_type))

    return of


@cache
def _borrowed():
    return borrowed_type('tf2_msgs', 'TFMessage', MarkerArray)


FOOT = 'base_footprint', 'base_link', 0.0, 0.0, 0.01, 0.0, 0.0, 0.0
LEFT = 'base_link', 'base_scan', 0.0, 0.0, 0.16, 0.0, 0.0, math.pi / 2
UPSIDE_DOWN = 'base_link', 'base_scan', 0.0, 0.0, 0.16, math.pi, 0.0, 0.0


def test_a_chain_of_joints_in_any_order_is_the_place(frames_message):
    frames = LiveFrames()
    assert frames.mount('base_scan', 'base_footprint') is None
    frames.update(frames_message((
        'base_link', '/base_scan', *LASER[:2], LASER.z - 0.01, *LASER[4:], LASER.yaw)))
    frames.update(frames_message(FOOT))
    for base in 'base_footprint', '/base_link', '':
        found = frames.mount('/base_scan', base)
        assert are_alike(found, LASER)
        assert found.z == pytest.approx(LASER.z)
    assert frames.mount('base_link', 'base_link') == Mount()
    assert frames.mount('camera', 'base_link') is None


@given(st.binary(max_size=300))
@few
def test_whatever_comes_is_taken_or_refused(data):
    frames = LiveFrames()
    for message in data, b'\0\1\0\0' + struct.pack('<I', 2) + data:
        with suppress(ValueError):
            frames.update(message)
    assert frames.mount('base_scan', 'base_link') is None


def test_a_place_that_is_none_is_refused(frames_message):
    frames = LiveFrames()
    with pytest.raises(ValueError, match=r'base_scan.* is no place'):
        frames.update(frames_message(('base_link', 'base_scan', math.nan, *LEFT[3:])))


class TestMaker:
    def made(self, message, **settings):
        """Return the local grid of a wall ahead of the laser, with what the frames say."""
        maker, frames = NeighbourhoodMaker(NeighbourhoodSettings(
            rows=20, cols=20, resolution=0.25, **settings)), LiveFrames()
        frames.update(message)
        maker.found = frames.mount('base_scan', 'base_footprint')
        maker.update(scan(1.0))
        return maker, maker.neighbourhood(odometry(1.02)).cells

    def test_the_frames_count_where_no_parameter_does(self, frames_message):
        # The laser looks to the left: what is ahead of it is in the row above.
        _, cells = self.made(frames_message(FOOT, LEFT))
        np.testing.assert_array_equal(cells, [[FREE] * 3, [FREE] * 3, [BLOCKED] * 3])
        _, cells = self.made(frames_message(FOOT, LEFT), laser_yaw=math.pi)
        np.testing.assert_array_equal(cells, [[BLOCKED, FREE, FREE]] * 3)

    def test_a_laser_that_is_tilted_too_far_shows_nothing(self, frames_message):
        maker, cells = self.made(frames_message(FOOT, (*LEFT[:5], 0.0, 0.6, 0.0)))
        assert maker.problem(1.02).startswith('as /tf_static says, the laser is tilted by 34')
        assert (cells != FREE).all()


class TestNode:
    def finder(self, node, **settings):
        maker = NeighbourhoodMaker(NeighbourhoodSettings(**settings))
        return LaserMountFinder(node, maker), maker

    def test_what_it_makes_of_the_place_is_said(self, ros_node, frames_message):
        finder, maker = self.finder(ros_node)
        finder.on_frames(laser='base_scan')
        finder.log()
        assert not finder.last_logged  # no odometry yet
        finder.on_frames(base='base_footprint')
        finder.log()
        assert "'base_scan' is taken to sit in the robot's middle: " in finder.last_logged
        assert 'set laser_x, laser_y, laser_z, laser_roll' in finder.last_logged
        assert ('tf2_msgs is not installed' in finder.last_logged) == (transforms_type() is None)
        finder.on_static_transforms(frames_message(FOOT, UPSIDE_DOWN))
        finder.log()
        assert 'turned by 180, 0, 0 degrees' in finder.last_logged
        assert are_alike(maker.laser, Mount(roll=math.pi))
        finder.on_static_transforms(b'nonsense')
        assert 'no transforms; it is left out' in finder.last_logged

    def test_parameters_that_say_otherwise_count_and_are_called_so(
            self, ros_node, frames_message):
        finder, maker = self.finder(ros_node, laser_x=0.1)
        finder.on_frames('base_scan', 'base_footprint')
        finder.on_static_transforms(frames_message(FOOT, LEFT))
        finder.log()
        assert finder.last_logged.endswith('the parameters count')
        assert maker.laser == Mount(0.1)

    @pytest.fixture
    def with_type(self, monkeypatch):
        """Let tf2_msgs be there, if need be as a type of that name which packs nothing."""
        if transforms_type() is None:
            package, messages = ModuleType('tf2_msgs'), ModuleType('tf2_msgs.msg')
            messages.TFMessage = _borrowed()
            monkeypatch.setitem(sys.modules, 'tf2_msgs', package)
            monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', messages)
        return transforms_type()

    def test_it_is_heard_on_the_topic_from_who_said_it_before(
            self, ros_node, with_type, frames_message):
        frames = ros_node.create_publisher(with_type, '/tf_static', qos.STATIC_FRAMES)
        frames.publish(frames_message(FOOT, UPSIDE_DOWN))
        finder, maker = self.finder(ros_node)
        finder.on_frames('base_scan', 'base_footprint')
        ros_helpers.wait_until(
            lambda: maker.found is not None, node=ros_node, what='the place of the laser')
        assert maker.laser.roll == pytest.approx(math.pi)
        assert dict(ros_node.get_topic_names_and_types())['/tf_static'] == [
            'tf2_msgs/msg/TFMessage']
