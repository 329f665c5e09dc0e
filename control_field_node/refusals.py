"""Why a trial cannot be started now, in words that hold the remedy."""

from typing import TYPE_CHECKING

from control_field_node import words

if TYPE_CHECKING:  # it asks, and is asked
    from control_field_node.supervisor import Supervisor


def why_no_start(supervisor: 'Supervisor', now: float) -> str:
    """
    Say why no trial can start; empty if one can.

    Parameters
    ----------
    supervisor : Supervisor
        What has arrived, and how it stands.
    now : float, [s]
        On the steady clock.

    """
    if supervisor.run is not None:
        return f'trial {supervisor.run.trial} is already running'
    if supervisor.field is None or supervisor.field.is_void:
        return f'there is no control field: {supervisor.refusal or "show the way first"}'
    if supervisor.odometry_refusal:
        return f'odometry is refused: {supervisor.odometry_refusal}'
    if supervisor.pose is None or supervisor.intake.odometry.is_stale(now):
        return f'no odometry has arrived for {supervisor.intake.odometry.timeout:g} s'
    if supervisor.neighbourhood is None or supervisor.intake.sight.is_stale(now):
        return f'no neighbourhood has arrived for {supervisor.intake.sight.timeout:g} s'
    if supervisor.localisation.is_lost:
        return f'no pose has arrived on {supervisor.settings.pose_topic}'
    if problem := supervisor.heartbeat.problem:
        return problem
    pose = supervisor.pose
    return words.problem_with_place(supervisor.field.grid, pose.x, pose.y)
