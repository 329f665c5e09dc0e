"""What the live view is told: topics of robot, learner, controller and simulator."""

from collections.abc import Callable
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from msgs_bridge.messages.neighbourhoods import occupancy_from_map
from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.messages.tables import (
    decisions_from_cloud, field_from_cloud, prototypes_from_cloud)
from msgs_bridge.messages.trial_status import trial_from_status
from msgs_bridge.node import qos
from msgs_bridge.teaching.status_tracker import StatusTracker
from page_node.view.live_view import LiveView

#: How often the state is looked at, [s].
REFRESH_PERIOD: Final = 0.1


def subscribe(
    node: Any, view: LiveView, tracker: StatusTracker, refuse: Callable[[ValueError], object],
    steady: Any,
) -> None:
    """
    Subscribe to all that is shown, and look at the state again and again.

    Parameters
    ----------
    node : Node
    view : LiveView
    tracker : StatusTracker
        Is told what nodes say of themselves.
    refuse : callable
        Is told what is wrong with a message.
    steady : Clock
        Of the timer.

    """
    def told(take: Callable[[Any], None]) -> Callable[[Any], None]:
        def callback(msg: Any) -> None:
            try:
                take(msg)
            except ValueError as error:
                refuse(error)
        return callback

    for kind, topic, take, profile in (
            (Odometry, 'odom', lambda msg: view.on_pose(
                pose_from_odometry(msg), time.monotonic()), qos.SENSOR),
            (OccupancyGrid, 'neighbourhood', lambda msg: view.on_local_grid(
                *occupancy_from_map(msg, 'neighbourhood')), qos.SENSOR),
            (OccupancyGrid, 'map', lambda msg: view.on_map(
                *occupancy_from_map(msg)), qos.LATCHED),
            (MarkerArray, 'movers', lambda msg: view.on_movers(msg.markers), qos.LATCHED),
            (PointCloud2, 'control_field', lambda msg: view.on_field(
                field_from_cloud(msg)), qos.LATCHED),
            (PointCloud2, 'prototypes', lambda msg: view.on_prototypes(
                prototypes_from_cloud(msg)), qos.LATCHED),
            (PointCloud2, 'experience', lambda msg: view.on_decisions(
                decisions_from_cloud(msg)), qos.SENSOR),
            (DiagnosticStatus, 'trial', lambda msg: view.on_trial(
                trial_from_status(msg)), qos.RECORDING_LATCHED),
            (DiagnosticArray, '/diagnostics', lambda msg: tracker.on_diagnostics(
                msg, time.monotonic()), qos.DIAGNOSTICS)):
        node.create_subscription(kind, topic, told(take), profile)
    node.create_timer(REFRESH_PERIOD, view.refresh, clock=steady)
