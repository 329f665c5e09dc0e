"""Which topics go into a bag, and how they are read."""

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool

from learner_node.settings import Settings
from msgs_bridge import qos


@dataclass(frozen=True)
class Recorded:
    """A topic that is recorded: its name, the class of its messages, and the ways it is read."""

    name: str
    kind: Any
    profiles: tuple[Any, ...]

    @property
    def type_name(self) -> str:
        """Return the name of the type, such as ``nav_msgs/msg/Odometry``."""
        return type_name(self.kind)


def type_name(kind: Any) -> str:
    """Return the name of a message class as bags have it."""
    return f'{kind.__module__.partition(".")[0]}/msg/{kind.__name__}'


def recorded_topics(settings: Settings) -> list[Recorded]:
    """
    Return what is recorded; the learner's own `control_field` and `prototypes` come on top.

    A simulator in lock-step may be faster than the recorder for a while, so that it is read
    reliably; a real robot's odometry may be best effort.
    """
    command = TwistStamped if settings.is_stamped else Twist
    sensed = qos.RECORDING_RELIABLE if settings.lockstep else qos.RECORDING
    return [
        Recorded('odom', Odometry, (sensed,)),
        Recorded('neighbourhood', OccupancyGrid, (sensed,)),
        Recorded('cmd_vel', command, (qos.RECORDING,)),
        Recorded('cmd_vel_requested', TwistStamped, (qos.RECORDING,)),
        Recorded('experience', PointCloud2, (qos.EXPERIENCE,)),
        Recorded('trial', DiagnosticStatus, (qos.RECORDING_LATCHED,)),
        Recorded('goal_pose', PoseStamped, (qos.RECORDING,)),
        Recorded('initialpose', PoseWithCovarianceStamped, (qos.RECORDING,)),
        Recorded('contact', Bool, qos.CONTACTS),
    ]
