"""Poses of a localisation, such as AMCL's, on their way to the particle filter."""

import time
from typing import Any, TYPE_CHECKING

from msgs_bridge.messages.poses import (
    Pose, pose_from_initialpose, problem_with_frame, variances_from_covariance)

if TYPE_CHECKING:
    from control_field_node.supervisor import Supervisor


def read_place(supervisor: 'Supervisor', msg: Any) -> None:
    """Read a message of `pose_topic`, and take it in."""
    name, now = supervisor.settings.pose_topic, time.monotonic()
    try:
        pose = pose_from_initialpose(msg, name)
        variances = variances_from_covariance(msg.pose.covariance, name)
    except ValueError as error:
        supervisor.intake.refuse(str(error))
        supervisor.intake.places.pass_over(now, str(error))
        return
    take_place(supervisor, pose, variances, now)


def take_place(
    supervisor: 'Supervisor', pose: Pose, variances: tuple[float, float, float], now: float,
) -> None:
    """
    Take in a pose of `pose_topic`; what does not count is noted with the reason.

    Parameters
    ----------
    supervisor : Supervisor
    pose : Pose
    variances : tuple of float, [m^2, m^2, rad^2]
    now : float, [s]
        On the steady clock.

    """
    settings, intake = supervisor.settings, supervisor.intake
    problem = problem_with_frame(pose.frame_id, settings.pose_frame_id, settings.pose_topic)
    if problem:
        intake.refuse(f'{problem} (pose_frame_id)')
        intake.places.pass_over(now, f'{problem} (pose_frame_id)')
    elif supervisor.localisation.localise(pose, variances):
        intake.places.saw(now)
    else:
        intake.counts['poses not used'] += 1
        intake.places.pass_over(now, f'there is no odometry of its time ({pose.stamp:.2f} s), or '
                                     f'it is the last one again')
