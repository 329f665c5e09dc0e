"""What the controller publishes: commands, decisions, how the trial stands, how it itself does."""

from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from control_field.robot.limits import Velocity
from control_field_node.answer import Answer
from control_field_node.commands import CommandWriter
from control_field_node.reports import CommandPublishers, diagnostic_from_supervisor
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from msgs_bridge.messages.tables import cloud_from_decisions
from msgs_bridge.messages.trial_status import status_from_trial
from msgs_bridge.messages.velocities import twist_stamped_from_velocity
from msgs_bridge.node import qos
from msgs_bridge.node.peers import PeerMonitor


class Outbox:
    """
    Owns the publishers of the controller.

    Parameters
    ----------
    node : rclpy.node.Node
        Makes them.
    settings : Settings
        Names of frames and of the robot.
    supervisor : Supervisor
        How the trial stands.
    writer : CommandWriter
        Writes the commands; it publishes through here from now on.

    Attributes
    ----------
    commands, trials : rclpy.publisher.Publisher
        Of `cmd_vel` and `trial`; whoever ends the node waits until they are through.

    """

    def __init__(
        self, node: Any, settings: Settings, supervisor: Supervisor, writer: CommandWriter,
    ) -> None:
        """Make the publishers."""
        self._node, self._settings, self._supervisor = node, settings, supervisor
        self._writer = writer
        self._told: tuple[object, ...] = ()
        commanded = qos.LOCKSTEP_PUB if settings.lockstep else qos.COMMAND
        self.commands = node.create_publisher(writer.kind, 'cmd_vel', commanded)
        writer.publish = self.commands.publish
        self._requests = node.create_publisher(TwistStamped, 'cmd_vel_requested', commanded)
        self._experience = node.create_publisher(PointCloud2, 'experience', qos.EXPERIENCE_KEPT)
        self.trials = node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def publish(self, answer: Answer, odometry: Any = None) -> None:
        """Publish decisions first, then how the trial stands, the command last."""
        grid = self._supervisor.grid
        if grid is not None:
            for rows in answer.rows:
                self._experience.publish(cloud_from_decisions(rows, grid))
        self.tell_trial()
        if answer.requested is not None:
            self.request(answer.requested,
                         self._time() if odometry is None else odometry.header.stamp)
        if answer.velocity is not None:
            self._writer.send(answer.velocity, odometry or self._writer.odometry)

    def request(self, velocity: Velocity, stamp: Time) -> None:
        """Publish what was asked for before the collision monitor."""
        self._requests.publish(twist_stamped_from_velocity(
            *velocity, stamp, self._settings.base_frame_id))

    def tell_trial(self) -> None:
        """Publish how the trial stands when that has changed."""
        status = self._supervisor.status
        now = (status.state, status.trial, status.outcome, status.reason, status.decisions,
               status.revision, status.memory)
        if now != self._told:
            self._told = now
            self.trials.publish(status_from_trial(status, self._settings.robot_id))

    def tell(self, publishers: CommandPublishers, peers: PeerMonitor) -> None:
        """Publish how the controller does, and what it says of itself to its peers."""
        status = diagnostic_from_supervisor(
            self._supervisor, self._node.get_fully_qualified_name(), publishers)
        peers.add_to(status)
        self._diagnostics.publish(
            DiagnosticArray(header=Header(stamp=self._time()), status=[status]))

    def _time(self) -> Any:
        return self._node.get_clock().now().to_msg()
