"""The publishers of the controller: commands, decisions, trial status, diagnostics."""

from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from control_field.robot.limits import Velocity
from control_field_node.commands.command_publishers import CommandPublishers
from control_field_node.commands.command_writer import CommandWriter
from control_field_node.diagnostics import diagnostic_from_supervisor
from control_field_node.driving.trial_run import Answer
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from msgs_bridge.messages.tables import cloud_from_decisions
from msgs_bridge.messages.trial_status import status_from_trial
from msgs_bridge.messages.velocities import twist_stamped_from_velocity
from msgs_bridge.node import qos
from msgs_bridge.node.peer_monitor import PeerMonitor


class Publishers:
    """
    Owns the publishers of the controller.

    Parameters
    ----------
    node : rclpy.node.Node
        Creates them.
    settings : Settings
    supervisor : Supervisor
    writer : CommandWriter
        Writes the commands.

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
        self._last_published: tuple[object, ...] = ()
        commanded = qos.LOCKSTEP_PUB if settings.lockstep else qos.COMMAND
        self.commands = node.create_publisher(writer.kind, 'cmd_vel', commanded)
        writer.publish = self.commands.publish
        self._requests = node.create_publisher(TwistStamped, 'cmd_vel_requested', commanded)
        self._experience = node.create_publisher(PointCloud2, 'experience', qos.EXPERIENCE_KEPT)
        self.trials = node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def publish(self, answer: Answer, odometry: Any = None) -> None:
        """Publish decisions first, then the status of the trial, the command last."""
        grid = self._supervisor.trial.grid
        if grid is not None:
            for rows in answer.rows:
                self._experience.publish(cloud_from_decisions(rows, grid))
        self.publish_trial()
        if answer.requested is not None:
            self.publish_request(answer.requested,
                         self._time() if odometry is None else odometry.header.stamp)
        if answer.velocity is not None:
            self._writer.send(answer.velocity, odometry or self._writer.odometry)

    def publish_request(self, velocity: Velocity, stamp: Time) -> None:
        """Publish what was asked for before the collision monitor."""
        self._requests.publish(twist_stamped_from_velocity(
            *velocity, stamp, self._settings.base_frame_id))

    def publish_trial(self) -> None:
        """Publish the status of the trial if it has changed."""
        status = self._supervisor.status
        now = (status.state, status.trial, status.outcome, status.reason, status.decisions,
               status.revision, status.memory)
        if now != self._last_published:
            self._last_published = now
            self.trials.publish(status_from_trial(status, self._settings.robot_id))

    def publish_diagnostics(self, commands: CommandPublishers, peers: PeerMonitor) -> None:
        """Publish the diagnostics, with what the controller tells its peers."""
        status = diagnostic_from_supervisor(
            self._supervisor, self._node.get_fully_qualified_name(), commands.others,
            commands.mismatch)
        peers.add_to(status)
        self._diagnostics.publish(
            DiagnosticArray(header=Header(stamp=self._time()), status=[status]))

    def _time(self) -> Any:
        return self._node.get_clock().now().to_msg()
