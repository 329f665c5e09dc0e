"""Bags as robots record them: odometry, transforms and laser scans, of a world that is known."""

import math

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from bridge_helpers import nanoseconds
from msgs_bridge.sensing.laser_mount import Mount

ODOMETRY, SCAN, TF = (
    'nav_msgs/msg/Odometry', 'sensor_msgs/msg/LaserScan', 'tf2_msgs/msg/TFMessage')
#: Where the laser sits if nothing else is said: upside down, turned to the left.
LASER = Mount(-0.03, 0.02, 0.4, 0.17, math.pi, 0.0)
#: Where the frame of odometry lies in that of the map.
MAP = (1.0, -0.5, 0.0)
N = 120


def place(i):
    """Return stamp, x, y and yaw of the robot in the frame of odometry: along x."""
    return 1.0 + i / 20, 0.6 + 0.02 * i, 1.1, 0.0


def quaternion(roll, pitch, yaw):
    """Return x, y, z, w of a turn."""
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return (sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)


class RobotBag:
    """
    Writes messages of a robot, for ROS 1 or 2.

    Parameters
    ----------
    path : Path
    ros1 : bool

    """

    def __init__(self, path, ros1=False):
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
        self.tf_type = 'tf/msg/tfMessage' if ros1 else TF
        if ros1:
            self.store.register(get_types_from_msg(
                'geometry_msgs/TransformStamped[] transforms', self.tf_type))
        self.writer = Ros1Writer(path) if ros1 else Writer(
            path, version=9, storage_plugin=StoragePlugin.MCAP)
        self.connections = {}
        self.writer.open()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.writer.close()

    def make(self, name, *values):
        package, _, kind = name.partition('/')
        return self.store.types[f'{package}/msg/{kind}'](*values)

    def header(self, stamp, frame):
        time = self.make('builtin_interfaces/Time', int(stamp), nanoseconds(stamp % 1.0))
        return self.make('std_msgs/Header', *([7] if self.ros1 else []), time, frame)

    def write(self, topic, kind, stamp, msg):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(
                topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], nanoseconds(stamp), serialize(msg, kind))

    def odometry(self, stamp, x, y, yaw, topic='/odom', frame='odom', base='base_footprint'):
        vector = self.make('geometry_msgs/Vector3', 0.0, 0.0, 0.0)
        pose = self.make(
            'geometry_msgs/Pose', self.make('geometry_msgs/Point', x, y, 0.0),
            self.make('geometry_msgs/Quaternion', *quaternion(0.0, 0.0, yaw)))
        self.write(topic, ODOMETRY, stamp, self.make(
            'nav_msgs/Odometry', self.header(stamp, frame), base,
            self.make('geometry_msgs/PoseWithCovariance', pose, np.zeros(36)),
            self.make('geometry_msgs/TwistWithCovariance',
                      self.make('geometry_msgs/Twist', vector, vector), np.zeros(36))))

    def transforms(self, stamp, *edges, topic='/tf'):
        """Write edges, each parent, child, x, y, z and roll, pitch, yaw."""
        self.write(topic, self.tf_type, stamp, self.make_tf([self.make(
            'geometry_msgs/TransformStamped', self.header(stamp, parent), child,
            self.make('geometry_msgs/Transform', self.make('geometry_msgs/Vector3', x, y, z),
                      self.make('geometry_msgs/Quaternion', *quaternion(*turn))))
            for parent, child, x, y, z, *turn in edges]))

    def make_tf(self, transforms):
        return self.store.types[self.tf_type](transforms)

    def scan(self, stamp, x, y, yaw, boxes, mount=LASER, topic='/scan', frame='base_scan', n=360):
        """Write what a laser sees of boxes (x_low, y_low, x_high, y_high) from there."""
        c, s = math.cos(yaw), math.sin(yaw)
        eye = np.array([x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y])
        angles = -math.pi + 2.0 * math.pi / n * np.arange(n)
        plane = mount._replace(yaw=mount.yaw + yaw).rotation[:2, :2]
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ plane.T
        best = np.full(n, math.inf)
        with np.errstate(divide='ignore', invalid='ignore'):
            for box in boxes:
                ends = [(np.array(end) - eye) / rays for end in (box[:2], box[2:])]
                enter, leave = np.minimum(*ends).max(axis=1), np.maximum(*ends).min(axis=1)
                best = np.where((enter <= leave) & (enter > 0), np.minimum(best, enter), best)
        ranges = np.where(best > 3.5, math.inf, best).astype(np.float32)
        self.write(topic, SCAN, stamp, self.make(
            'sensor_msgs/LaserScan', self.header(stamp, frame), angles[0], angles[-1],
            2.0 * math.pi / n, 0.0, 0.1, 0.05, 3.5, ranges, np.zeros(0, np.float32)))


#: Left of the robot's way, in the row above it, from its seventh to its eighth column.
BOX = (1.55, 1.3, 1.95, 1.45)


def robot_bag(
    path, *, ros1=False, odometry=True, odometry_tf=True, to_map=False, mount=LASER, scans=True,
    base='base_footprint', said_mount=True, n=N,
):
    """Record a drive past a box with the topics that are wanted."""
    with RobotBag(path, ros1) as bag:
        if said_mount:
            bag.transforms(
                1.0, (base, 'base_link', 0.0, 0.0, 0.01, 0.0, 0.0, 0.0),
                ('base_link', 'base_scan', mount.x, mount.y, mount.z - 0.01, mount.roll,
                 mount.pitch, mount.yaw), topic='/tf_static')
        for i in range(n):
            stamp, x, y, yaw = place(i)
            if to_map and i % 5 == 0:
                bag.transforms(stamp, ('map', 'odom', MAP[0], MAP[1], 0.0, 0.0, 0.0, MAP[2]))
            if odometry_tf:
                bag.transforms(stamp, ('odom', base, x, y, 0.0, 0.0, 0.0, yaw))
            if odometry:
                bag.odometry(stamp, x, y, yaw, base=base)
            if scans and i % 2 == 0:
                bag.scan(stamp, x, y, yaw, [BOX], mount)
    return path
