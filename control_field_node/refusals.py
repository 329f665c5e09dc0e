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
    intake = supervisor.intake
    if supervisor.pose is None or supervisor.odometry_refusal or intake.odometry.is_stale(now):
        return intake.odometry.absence(now, 'odometry')
    if supervisor.neighbourhood is None or intake.local_grid.is_stale(now):
        return intake.local_grid.absence(now, 'neighbourhood')
    if supervisor.localisation.is_lost:
        return _why_lost(supervisor, now)
    if problem := supervisor.heartbeat.problem:
        return problem
    pose = supervisor.pose
    return words.problem_with_place(supervisor.field.grid, pose.x, pose.y)


def _why_lost(supervisor: 'Supervisor', now: float) -> str:
    """Say why nobody knows where the robot is, though there is a localisation to tell."""
    places, what = supervisor.intake.places, f'pose on {supervisor.settings.pose_topic}'
    if places.has_come and not places.comes_in_vain(now):
        return f'odometry was reset, and no {what} has arrived since'
    return places.absence(now, what)
