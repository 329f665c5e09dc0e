"""Bags as `ros2 bag record` leaves them."""

from rosbags.rosbag2 import CompressionFormat, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import nanoseconds, ODOMETRY, raw_odometry

STORE = get_typestore(Stores.ROS2_JAZZY)
FOREIGN = {'odom': '/wheel/odometry', 'cmd_vel': '/cmd_vel'}


def foreign_bag(path, storage, compression=None, frame='odom'):
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
            raw = raw_odometry(i / 20, 0.5 + 0.01 * i, 0.6, frame)
            writer.write(odom, log_time, raw)
            writer.write(twist, log_time, b'\0\1\0\0' + bytes(48))
    return path
