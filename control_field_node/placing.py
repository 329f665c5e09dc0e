"""Poses of a localisation on their way to the controller's own belief of where the robot is."""

from typing import TYPE_CHECKING

from msgs_bridge.poses import Pose, problem_with_frame

if TYPE_CHECKING:
    from control_field_node.supervisor import Supervisor


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
