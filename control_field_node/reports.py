"""The diagnostics of the controller, and who else publishes commands."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.robot.stop_rules import StopReason
from control_field_node import words
from control_field_node.supervisor import Supervisor
from msgs_bridge.node.command_types import mismatch


class CommandPublishers:
    """
    Who else is on `cmd_vel`.

    Attributes
    ----------
    others : list of str
        Full names of the other nodes that may publish.
    mismatch : str
        One line if a peer has the other type, else empty.
    n_publishers : int
        Publishers there were at the last look, the own one included.

    """

    def __init__(self) -> None:
        """Start alone."""
        self.others: list[str] = []
        self.mismatch = ''
        self.n_publishers = 0

    def look(self, node: Any, kind: type) -> str:
        """
        Note who is there; return a line to log if something new does not fit.

        Parameters
        ----------
        node : rclpy.node.Node
            This node.
        kind : type
            Message that this node has on `cmd_vel` and `cmd_vel_teleop`.

        """
        name, own = node.resolve_topic_name('cmd_vel'), node.get_fully_qualified_name()
        publishers = node.get_publishers_info_by_topic(name)
        self.n_publishers = len(publishers)
        self.others = [f'{peer.node_namespace.rstrip("/")}/{peer.node_name}'
                       for peer in publishers]
        if own in self.others:
            self.others.remove(own)
        before = self.mismatch
        self.mismatch = mismatch(node, 'cmd_vel', kind) or mismatch(node, 'cmd_vel_teleop', kind)
        return self.mismatch if self.mismatch != before else ''

    def has_namesake(self, name: str) -> bool:
        """Tell whether one of the others is called the same, in whatever namespace."""
        return any(other.rpartition('/')[2] == name for other in self.others)


def diagnostic_from_supervisor(
    supervisor: Supervisor, name: str, publishers: CommandPublishers,
) -> DiagnosticStatus:
    """
    Write how the controller stands.

    Parameters
    ----------
    supervisor : Supervisor
        The controller.
    name : str
        Of the node.
    publishers : CommandPublishers
        Who else is on `cmd_vel`.

    """
    status = supervisor.status
    problem = supervisor.problem
    counts = sorted(supervisor.intake.counts.items())
    values: dict[str, Any] = {
        'state': status.state, 'trial': status.trial, 'revision': status.revision,
        'stop_reason': _reason(supervisor) or '', 'held': supervisor.held,
        'field_refused': supervisor.refusal,
        'other_publishers': ', '.join(sorted(publishers.others)),
        'speed': f'{supervisor.velocity[0]:.3f}', 'turn_rate': f'{supervisor.velocity[1]:.3f}',
        **_localisation(supervisor), **_latency(supervisor),
        **{key.replace(' ', '_'): count for key, count in counts}}
    message = (
        publishers.mismatch or (supervisor.refusal and f'field refused: {supervisor.refusal}')
        or (supervisor.odometry_refusal and f'odometry refused: {supervisor.odometry_refusal}')
        or (supervisor.is_unmonitored and words.UNMONITORED) or '')
    if supervisor.field is None and not message:
        message = 'no control field yet'
    warns = bool(message) or problem is not None
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
        name=f'{name.lstrip("/")}: controller', hardware_id=supervisor.settings.robot_id,
        message=message or (problem.sentence if problem is not None else status.sentence),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


def _latency(supervisor: Supervisor) -> dict[str, str]:
    """Return how late the robot is heard and answers; nothing in lock-step, where it is not."""
    if supervisor.settings.lockstep:
        return {}
    link, punctuality = supervisor.wheels.lateness, supervisor.wheels.punctuality
    return {'odom_age': f'{link.age:.3f}', 'odom_age_worst': f'{link.worst_age:.3f}',
            'odom_lost': f'{link.lost:.2f}', 'response_time': f'{link.response.usual:.3f}',
            'latency': f'{link.longest:.3f}', 'clocks_differ': str(link.clocks_differ).lower(),
            'speed_share': f'{link.slowing:.2f}',
            'guard_gap_worst': f'{punctuality.gaps.seconds:.3f}',
            'guard_work_worst': f'{punctuality.works.seconds:.3f}'}


def _localisation(supervisor: Supervisor) -> dict[str, str]:
    """Return how sure the place is; nothing where odometry is taken at its word."""
    estimate, calibration = supervisor.localisation.estimate, supervisor.localisation.calibration
    if estimate is None or calibration is None:
        return {}
    return {'position_std': f'{estimate.std:.3f}', 'wheel_slip': f'{calibration[0]:.3f}',
            'heading_drift': f'{calibration[1]:.4f}'}


def _reason(supervisor: Supervisor) -> StopReason | None:
    """Return why the robot stands; None while it drives or is only not asked to."""
    if supervisor.problem is not None or supervisor.run is not None:
        return supervisor.problem
    _, reason = words.why_idle(supervisor.field, supervisor.refusal)
    return reason or supervisor.ended_by
