"""The diagnostics of the controller."""

from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.robot.stop_rules import StopReason
from control_field_node.driving.manual_control import UNMONITORED
from control_field_node.inputs.localisation import Localisation
from control_field_node.supervisor import Supervisor


def diagnostic_from_supervisor(
    supervisor: Supervisor, name: str, other_publishers: Sequence[str] = (), mismatch: str = '',
) -> DiagnosticStatus:
    """
    Return the diagnostics of the controller.

    Parameters
    ----------
    supervisor : Supervisor
        The controller.
    name : str
        Of the node.
    other_publishers : sequence of str
        Names of the other nodes that publish `cmd_vel`.
    mismatch : str
        What is wrong with the type of `cmd_vel`; empty if nothing is.

    """
    status, field, output = supervisor.status, supervisor.field, supervisor.output
    problem = supervisor.trial.pause_reason
    values: dict[str, Any] = {
        'state': status.state, 'trial': status.trial, 'revision': status.revision,
        'stop_reason': _stop_reason(supervisor) or '', 'held': output.held,
        'field_refused': field.refusal,
        'other_publishers': ', '.join(sorted(other_publishers)),
        'speed': f'{output.velocity[0]:.3f}', 'turn_rate': f'{output.velocity[1]:.3f}',
        **_localisation_values(supervisor.sensing.localisation), **_latency_values(supervisor),
        **{key.replace(' ', '_'): count
           for key, count in sorted(supervisor.refusals.counts.items())}}
    message = mismatch or _warning(supervisor)
    warns = bool(message) or problem is not None
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
        name=f'{name.lstrip("/")}: controller', hardware_id=supervisor.settings.robot_id,
        message=message or (problem.sentence if problem is not None else status.sentence),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


def _warning(supervisor: Supervisor) -> str:
    """Return what is wrong with field, odometry or local grid; empty if nothing is."""
    if supervisor.field.refusal:
        return f'field refused: {supervisor.field.refusal}'
    if supervisor.sensing.odometry_refusal:
        return f'odometry refused: {supervisor.sensing.odometry_refusal}'
    if supervisor.manual.is_unmonitored:
        return UNMONITORED
    return 'no control field yet' if supervisor.field.current is None else ''


def _latency_values(supervisor: Supervisor) -> dict[str, str]:
    """Return how late poses and answers come; nothing in lock-step, where they do not."""
    if supervisor.settings.lockstep:
        return {}
    latency, timing = supervisor.output.link.latency, supervisor.output.timing
    return {'odom_age': f'{latency.age:.3f}', 'odom_age_worst': f'{latency.worst_age:.3f}',
            'odom_lost': f'{latency.lost:.2f}', 'response_time': f'{latency.response.usual:.3f}',
            'latency': f'{latency.longest:.3f}',
            'clocks_differ': str(latency.clocks_differ).lower(),
            'speed_share': f'{latency.slowing:.2f}',
            'guard_gap_worst': f'{timing.gaps.seconds:.3f}',
            'guard_work_worst': f'{timing.works.seconds:.3f}'}


def _localisation_values(localisation: Localisation) -> dict[str, str]:
    """Return how sure the place is; nothing where odometry is not corrected."""
    estimate, calibration = localisation.estimate, localisation.calibration
    if estimate is None or calibration is None:
        return {}
    return {'position_std': f'{estimate.std:.3f}', 'wheel_slip': f'{calibration[0]:.3f}',
            'heading_drift': f'{calibration[1]:.4f}'}


def _stop_reason(supervisor: Supervisor) -> StopReason | None:
    """Return why the robot stands; None while it drives or is only not asked to."""
    trial = supervisor.trial
    if trial.run is not None:
        return trial.pause_reason
    return supervisor.field.why_idle() or trial.ended_by
