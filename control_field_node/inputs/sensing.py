"""What the robot senses: its pose, the local grid around it, and whether both count. ROS-free."""

from typing import Final

from control_field.grid import Grid
from control_field.records import ControlField
from control_field.robot.stop_rules import StopReason
from control_field_node.inputs.input_monitor import InputMonitor, RefusalLog
from control_field_node.inputs.local_grid_buffer import LocalGridBuffer
from control_field_node.inputs.localisation import Localisation
from control_field_node.inputs.observation import LocalGridRules, Observation
from control_field_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose, problem_with_frame

#: Time between two poses where it is not known yet, [s].
_USUAL_PERIOD: Final = 0.05


class Sensing:
    """
    Keeps the newest pose and local grid.

    Parameters
    ----------
    settings : Settings
    seed : int
        Of the localisation's particles.
    refusals : RefusalLog

    Attributes
    ----------
    inputs : InputMonitor
    localisation : Localisation
    local_grids : LocalGridBuffer
    pose : Pose or None
        Where the robot is.
    period : float, [s]
        Between the stamps of the last two poses.
    odometry_refusal : str
        Why the newest odometry was refused; empty if it was not.

    """

    def __init__(self, settings: Settings, seed: int, refusals: RefusalLog) -> None:
        """Start with nothing received."""
        self.inputs = InputMonitor(settings, refusals)
        self.localisation = Localisation(settings, seed)
        self.local_grids = LocalGridBuffer(self.inputs, self.localisation)
        self.pose: Pose | None = None
        self.period = _USUAL_PERIOD
        self.odometry_refusal = ''
        self._last_period = 0.0
        self.change_settings(settings)

    def change_settings(self, settings: Settings) -> None:
        """Take over new settings."""
        self.settings = self.localisation.settings = settings
        # Where poses are corrected, walls seem to move by a cell now and then.
        self.local_grids.rules = LocalGridRules(
            own_cell=settings.own_cell, backs_off=settings.backs_off,
            mover_speed=0.0 if settings.mends_odometry else settings.mover_speed)
        self.inputs.change_settings(settings)

    def take_field(self, field: ControlField) -> None:
        """Take over the workspace and the remembered map of a field."""
        self.local_grids.take_field(field)
        self.localisation.take_field(field)

    def on_pose(self, pose: Pose, now: float, is_paused: bool) -> None:
        """Take in a pose of the odometry, as it came."""
        self._last_period = 0.0 if self.pose is None else pose.stamp - self.pose.stamp
        self.pose, self.odometry_refusal = pose, ''
        self.inputs.on_odometry(now, is_paused)

    def locate(self, pose: Pose, grid: Grid) -> tuple[Pose, StopReason | None]:
        """Return where the robot is in the workspace, and what is wrong with the odometry."""
        if self._last_period > 0.0:
            self.period = self._last_period
        self.pose = self.localisation.place(pose, self.local_grids.newest)
        return self.pose, self.inputs.poses.order.observe(
            pose.stamp, pose.x, pose.y, grid, (self.pose.x, self.pose.y), pose.yaw)

    def on_bad_odometry(self, what: str, now: float) -> None:
        """Take in odometry that is not to be trusted."""
        self.inputs.distrust(now)
        self.inputs.odometry.pass_over(now, what)
        self.odometry_refusal = what

    def on_localised_pose(
        self, pose: Pose, variances: tuple[float, float, float], now: float,
    ) -> None:
        """
        Take in a pose of `pose_topic`; note why one does not count.

        Parameters
        ----------
        pose : Pose
        variances : tuple of float, [m^2, m^2, rad^2]
        now : float, [s]
            On the steady clock.

        """
        poses, refusals = self.inputs.localisation, self.inputs.refusals
        problem = problem_with_frame(
            pose.frame_id, self.settings.pose_frame_id, self.settings.pose_topic)
        if problem:
            self.refuse_localised_pose(f'{problem} (pose_frame_id)', now)
        elif self.localisation.correct(pose, variances):
            poses.on_arrival(now)
        else:
            refusals.counts['poses not used'] += 1
            poses.pass_over(now, f'there is no odometry of its time ({pose.stamp:.2f} s), or it '
                                 f'is the last one again')

    def refuse_localised_pose(self, why: str, now: float) -> None:
        """Take in a message of `pose_topic` that is not to be trusted."""
        self.inputs.refusals.refuse(why)
        self.inputs.localisation.pass_over(now, why)

    def on_neighbourhood(self, neighbourhood: Neighbourhood, cells: Grid | None, now: float,
                         is_paused: bool) -> None:
        """Take in a neighbourhood on some cells; ignore one that is out of order."""
        self.local_grids.add(neighbourhood, cells, now, is_paused)

    def observe(
        self, now: float, unknown_is_blocked: bool, bounded: bool = True,
    ) -> Observation | None:
        """Return what is observed from the newest pose; None if nothing is that counts."""
        return self.local_grids.observe(self.pose, now, unknown_is_blocked, bounded)

    def local_grid_problem(self, now: float) -> str:
        """Return why nothing is observed; empty if something is."""
        return self.local_grids.problem(self.pose, now)
