"""The quality-of-service profiles of the topics, each named once."""

from typing import Final

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    qos_profile_sensor_data,
    QoSProfile,
    ReliabilityPolicy,
)


def _reliable(depth: int, durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    return QoSProfile(  # type: ignore[no-untyped-call]
        history=HistoryPolicy.KEEP_LAST, depth=depth,
        reliability=ReliabilityPolicy.RELIABLE, durability=durability)


#: How a robot publishes `odom`; it is read as `SENSOR`.
ODOMETRY_PUB: Final = _reliable(10)
#: Sensor data, best effort: `neighbourhood`, and how `odom` is read.
SENSOR: Final = qos_profile_sensor_data
#: `cmd_vel`: only the newest command counts.
COMMAND: Final = _reliable(1)
#: `control_field`, `prototypes`, `trial`, `map`, `markers`: a late reader gets the newest.
LATCHED: Final = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)
#: `experience`: no decision may be lost.
EXPERIENCE: Final = QoSProfile(  # type: ignore[no-untyped-call]
    history=HistoryPolicy.KEEP_ALL, depth=0,
    reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
#: `goal_pose`, `initialpose`.
POSE: Final = _reliable(1)
