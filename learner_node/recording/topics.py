"""The topics that are recorded, and their QoS."""

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool

from learner_node.settings import Settings
from msgs_bridge.node import qos


@dataclass(frozen=True)
class Recorded:
    """
    A topic that is recorded.

    Parameters
    ----------
    name : str
    kind : type
        Class of its messages.
    profiles : tuple of QoSProfile
        The ways it is read.
    spare : QoSProfile or None
        The way it is read once somebody publishes it best effort.
    kept : QoSProfile or None
        How what was published meanwhile is fetched, after the recorder was away.

    """

    name: str
    kind: Any
    profiles: tuple[Any, ...]
    spare: Any = None
    kept: Any = None

    @property
    def type_name(self) -> str:
        """Return the name of the type, such as ``nav_msgs/msg/Odometry``."""
        return type_name(self.kind)


def type_name(kind: Any) -> str:
    """Return the name of a message class, as bags write it."""
    return f'{kind.__module__.partition(".")[0]}/msg/{kind.__name__}'


def recorded_topics(settings: Settings) -> list[Recorded]:
    """
    Return what is recorded; the learner's own `control_field` and `prototypes` come on top.

    What is published reliably is read reliably; a real robot's odometry may be best effort.
    """
    command = TwistStamped if settings.is_stamped else Twist
    plain = (qos.RECORDING,), qos.RECORDING_BEST_EFFORT
    kept = qos.RECORDING_KEPT if settings.lockstep else None
    return [
        Recorded('odom', Odometry, *plain, kept),
        Recorded('neighbourhood', OccupancyGrid, *plain, kept),
        Recorded('cmd_vel', command, *plain, kept),
        Recorded('cmd_vel_requested', TwistStamped, *plain, kept),
        Recorded('experience', PointCloud2, (qos.EXPERIENCE,), None, qos.EXPERIENCE_KEPT),
        Recorded('trial', DiagnosticStatus, (qos.RECORDING_LATCHED,)),
        Recorded('goal_pose', PoseStamped, *plain),
        Recorded('initialpose', PoseWithCovarianceStamped, *plain),
        Recorded('contact', Bool, qos.RECORDING_CONTACTS),
    ]
