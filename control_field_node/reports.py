"""What the controller says about itself on `/diagnostics`, and which peers do not fit."""

from collections.abc import Iterable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field_node.supervisor import Supervisor


def diagnostic_from_supervisor(
    supervisor: Supervisor, name: str, mismatch: str, others: Iterable[str],
) -> DiagnosticStatus:
    """
    Write how the controller stands.

    Parameters
    ----------
    supervisor : Supervisor
        The controller.
    name : str
        Of the node.
    mismatch : str
        One line if a peer on `cmd_vel` has the other type, else empty.
    others : iterable of str
        Names of other nodes that may publish `cmd_vel`.

    """
    status = supervisor.status
    problem = supervisor.problem
    values: dict[str, Any] = {
        'state': status.state, 'trial': status.trial, 'revision': status.revision,
        'stop_reason': '' if problem is None else problem,
        'field_refused': supervisor.refusal, 'other_publishers': ', '.join(sorted(others)),
        'speed': f'{supervisor.velocity[0]:.3f}', 'turn_rate': f'{supervisor.velocity[1]:.3f}',
        **{key.replace(' ', '_'): count for key, count in sorted(supervisor.counts.items())}}
    message = mismatch or (supervisor.refusal and f'field refused: {supervisor.refusal}')
    if supervisor.field is None and not message:
        message = 'no control field yet'
    warns = bool(message) or problem is not None
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
        name=f'{name.lstrip("/")}: controller', hardware_id=supervisor.settings.robot_id,
        message=message or (problem.sentence if problem is not None else status.sentence),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


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
            if peer.topic_type != mine:
                return (f'{peer.node_name} {verb} cmd_vel as {peer.topic_type} but this node has '
                        f'{mine}: set enable_stamped_cmd_vel:={stamped}')
    return ''
