"""What the controller says about itself on `/diagnostics`, and which peers do not fit."""

from collections.abc import Iterable
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.watch import StopReason
from control_field_node.supervisor import Supervisor

#: What the graph calls a node that it has not heard the name of yet.
_NOT_YET_KNOWN: Final = '_NODE_NAME_UNKNOWN_'


class Peers:
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

    def look(self, node: Any, topic: str, kind: type) -> str:
        """
        Note who is there; return a line to log if something new does not fit.

        Parameters
        ----------
        node : rclpy.node.Node
            This node.
        topic : str
            `cmd_vel`, relative.
        kind : type
            Message that this node has there.

        """
        name, own = node.resolve_topic_name(topic), node.get_fully_qualified_name()
        publishers = node.get_publishers_info_by_topic(name)
        self.n_publishers = len(publishers)
        self.others = [f'{peer.node_namespace.rstrip("/")}/{peer.node_name}'
                       for peer in publishers]
        if own in self.others:
            self.others.remove(own)
        before, self.mismatch = self.mismatch, mismatch_of(
            f'geometry_msgs/msg/{kind.__name__}', publishers,
            node.get_subscriptions_info_by_topic(name))
        return self.mismatch if self.mismatch != before else ''

    def has_namesake(self, name: str) -> bool:
        """Tell whether one of the others is called the same, in whatever namespace."""
        return any(other.rpartition('/')[2] == name for other in self.others)


def diagnostic_from_supervisor(
    supervisor: Supervisor, name: str, peers: Peers,
) -> DiagnosticStatus:
    """
    Write how the controller stands.

    Parameters
    ----------
    supervisor : Supervisor
        The controller.
    name : str
        Of the node.
    peers : Peers
        Who else is on `cmd_vel`.

    """
    status = supervisor.status
    problem = supervisor.problem
    counts = sorted(supervisor.intake.counts.items())
    values: dict[str, Any] = {
        'state': status.state, 'trial': status.trial, 'revision': status.revision,
        'stop_reason': _reason(supervisor) or '', 'held': supervisor.held,
        'field_refused': supervisor.refusal, 'other_publishers': ', '.join(sorted(peers.others)),
        'speed': f'{supervisor.velocity[0]:.3f}', 'turn_rate': f'{supervisor.velocity[1]:.3f}',
        **_localisation(supervisor),
        **{key.replace(' ', '_'): count for key, count in counts}}
    message = peers.mismatch or (supervisor.refusal and f'field refused: {supervisor.refusal}')
    if supervisor.field is None and not message:
        message = 'no control field yet'
    warns = bool(message) or problem is not None
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
        name=f'{name.lstrip("/")}: controller', hardware_id=supervisor.settings.robot_id,
        message=message or (problem.sentence if problem is not None else status.sentence),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


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
    if supervisor.field is None:
        return StopReason.WRONG_FIELD if supervisor.refusal else StopReason.NO_FIELD
    return supervisor.ended_by


def mismatch_of(mine: str, publishers: Iterable[Any], subscribers: Iterable[Any]) -> str:
    """
    Say in one line which parameter to set when a peer on `cmd_vel` has the other type.

    Parameters
    ----------
    mine : str
        Type this node publishes and reads, ``geometry_msgs/msg/Twist`` or ``.../TwistStamped``.
    publishers, subscribers : iterable of TopicEndpointInfo
        Who is on the topic.

    """
    stamped = str(not mine.endswith('Stamped')).lower()
    for peers, verb in ((subscribers, 'subscribes'), (publishers, 'publishes')):
        for peer in peers:
            if peer.topic_type != mine and peer.node_name != _NOT_YET_KNOWN:
                return (f'{peer.node_name} {verb} cmd_vel as {peer.topic_type} but this node has '
                        f'{mine}: set enable_stamped_cmd_vel:={stamped}')
    return ''
