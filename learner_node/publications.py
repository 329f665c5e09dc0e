"""The topics that the learner publishes."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from control_field.grid import Grid
from control_field.learning.learner import Refresh
from control_field.poses import StartPose
from control_field.records import ControlField, Prototypes
from msgs_bridge.messages.markers import markers_from_field
from msgs_bridge.messages.poses import initialpose_from_pose, Pose
from msgs_bridge.messages.serialized import cdr_from_cloud
from msgs_bridge.messages.tables import cloud_from_field, cloud_from_prototypes
from msgs_bridge.node import qos

Publish = Callable[[Any], None]


class Publications:
    """
    The learner's topics.

    Parameters
    ----------
    node : Node
        Whose they are.
    frame_id : str
        Of the workspace.

    """

    def __init__(self, node: Any, frame_id: str) -> None:
        self._frame_id = frame_id
        self._fields = node.create_publisher(PointCloud2, 'control_field', qos.LATCHED)
        self._prototypes = node.create_publisher(PointCloud2, 'prototypes', qos.LATCHED)
        self._markers = node.create_publisher(MarkerArray, 'markers', qos.LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._places = node.create_publisher(PoseWithCovarianceStamped, 'initialpose', qos.POSE)

    def publish_field(
        self, field: ControlField, refresh: Refresh, memory: str,
    ) -> dict[str, bytes]:
        """
        Publish a field with its prototypes; return what the bags hold of it, by topic.

        These are PointCloud2 messages in bytes, made once for the middleware and the bags.

        ``memory`` says whose it is, also where it was changed for a single trial.
        """
        return self._publish(replace(field, memory=memory), refresh.prototypes)

    def publish_nothing(self, grid: Grid) -> None:
        """Publish a void field: what was published before no longer holds."""
        self._publish(ControlField.void(grid), Prototypes.none())

    def _publish(self, field: ControlField, prototypes: Prototypes) -> dict[str, bytes]:
        messages = {
            'control_field': cdr_from_cloud(cloud_from_field(field)),
            'prototypes': cdr_from_cloud(cloud_from_prototypes(prototypes, field.grid))}
        self._fields.publish(messages['control_field'])
        self._prototypes.publish(messages['prototypes'])
        self._markers.publish(markers_from_field(field, prototypes))
        return messages

    def place(self, start: StartPose, stamp: float) -> None:
        """Ask the simulator to set the robot to a pose."""
        self._places.publish(initialpose_from_pose(
            Pose(stamp, start.x, start.y, start.yaw, frame_id=self._frame_id)))

    def tell(self, status: DiagnosticStatus, now: Any) -> None:
        """Publish the status of the learner; ``now`` is a Time message."""
        array = DiagnosticArray(status=[status])
        array.header.stamp = now
        self._diagnostics.publish(array)
