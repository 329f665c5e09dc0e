"""Bags as `ros2 bag record` leaves them."""

from functools import cache

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
import numpy as np
from rclpy.serialization import serialize_message
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import GRID, nanoseconds, ODOMETRY, raw_local_grid, raw_odometry
from episode_store.external.drive import open_drive, ReadOptions
from episode_store.external.import_drive import demonstration_from_drive

STORE = get_typestore(Stores.ROS2_JAZZY)
OCCUPANCY = 'nav_msgs/msg/OccupancyGrid'
#: Messages on each topic of a `drive_bag`.
N_POSES = 200
EXTERNAL = {'odom': '/wheel/odometry', 'cmd_vel': '/cmd_vel'}


def external_demonstration(path, grid, topics=None, number=0):
    """Return what a bag of others teaches alone, what was dropped of it, and notes."""
    drive = open_drive(path, grid, ReadOptions(names=topics or {}))
    return demonstration_from_drive(drive, number)


@cache
def _raw(i, frame):
    return raw_odometry(i / 20, 0.5 + 0.01 * i, 0.6, frame)


def external_bag(path, storage, compression=None, frame='odom'):
    """Record a drive as `ros2 bag record` does, through rosbags."""
    writer = Writer(path, version=9 if storage is StoragePlugin.MCAP else 8,
                    storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        odom = writer.add_connection('/wheel/odometry', ODOMETRY, typestore=STORE)
        twist = writer.add_connection('/cmd_vel', 'geometry_msgs/msg/Twist', typestore=STORE)
        for i in range(200):
            log_time = nanoseconds(i / 20)
            writer.write(odom, log_time, _raw(i, frame))
            writer.write(twist, log_time, b'\0\1\0\0' + bytes(48))
    return path


def ros1_bag(path, n=100, compression=None, chunk=None):
    """Record a drive as ROS 1 does."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = 'nav_msgs/msg/Odometry'
    header, odometry = store.types['std_msgs/msg/Header'], store.types[kind]
    types = {name: store.types[f'geometry_msgs/msg/{name}'] for name in (
        'Pose', 'PoseWithCovariance', 'Point', 'Quaternion', 'Twist', 'TwistWithCovariance',
        'Vector3')}
    time, covariance = store.types['builtin_interfaces/msg/Time'], np.zeros(36)
    zero = types['Vector3'](0.0, 0.0, 0.0)
    writer = Ros1Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    writer.chunk_threshold = chunk or writer.chunk_threshold
    with writer:
        connection = writer.add_connection('/odom', kind, typestore=store)
        for i in range(n):
            pose = types['Pose'](types['Point'](0.5 + 0.02 * i, 0.6, 0.0),
                                 types['Quaternion'](0.0, 0.0, 0.0, 1.0))
            msg = odometry(
                header(i, time(1 + i // 20, 50_000_000 * (i % 20)), 'odom'), 'base_link',
                types['PoseWithCovariance'](pose, covariance),
                types['TwistWithCovariance'](types['Twist'](zero, zero), covariance))
            writer.write(connection, nanoseconds(1.0 + i / 20), store.serialize_ros1(msg, kind))
    return path


@cache
def _message(role, i, frame):
    """Return what a robot on its way along x says for the i-th time."""
    stamp, x, y = i / 20, 0.6 + 0.01 * i, 0.6
    if role == 'neighbourhood':
        return raw_local_grid(stamp, *GRID.cell_from_world(x, y), np.zeros((3, 3)))
    if role in ('odom', 'other'):
        return raw_odometry(stamp, *((x, y) if role == 'odom' else (0.0, 0.0)), frame)
    return {'map': serialize_message(OccupancyGrid()), 'goal': serialize_message(PoseStamped()),
            'cmd_vel': b'\0\1\0\0' + bytes(48)}[role]


def drive_bag(path, topics, storage=StoragePlugin.MCAP, compression=None, frame='odom'):
    """Record a drive along x as `ros2 bag record` does; ``topics`` are names by role."""
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    kinds = {'odom': ODOMETRY, 'other': ODOMETRY, 'neighbourhood': OCCUPANCY, 'map': OCCUPANCY,
             'cmd_vel': 'geometry_msgs/msg/Twist', 'goal': 'geometry_msgs/msg/PoseStamped'}
    with writer:
        made = {role: writer.add_connection(name, kinds[role], typestore=STORE)
                for role, name in topics.items()}
        for i in range(N_POSES):
            for role, connection in made.items():
                writer.write(connection, nanoseconds(i / 20), _message(role, i, frame))
    return path
