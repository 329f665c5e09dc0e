"""Where the robot is in the workspace: odometry, corrected as the settings say. ROS-free."""

from collections import deque
from dataclasses import replace
import math
from typing import Final

import numpy as np

from control_field.records import ControlField
from control_field.robot.particle_filter import Estimate, MotionNoise, ParticleFilter
from control_field_node.settings import Settings
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose

#: Steps beyond what wheels drive, [m] and [rad]: the robot was placed, or odometry was reset.
_SET_BACK: Final = (0.02, 0.1)
#: Number of poses kept to bring a late pose of the localisation up to date.
_N_KEPT: Final = 200
#: Least variances of x, y and yaw that it is believed to have, [m^2] and [rad^2].
_MIN_VARIANCES: Final = (1e-4, 1e-4, 1e-4)


class Localisation:
    """
    Corrects odometry to the pose that is driven by.

    Without `anchoring` and `pose_topic` it changes nothing. After a step of the odometry that no
    wheel can make it starts again: the robot is where its odometry says.

    Parameters
    ----------
    settings : Settings
    seed : int
        Of the particles.

    """

    def __init__(self, settings: Settings, seed: int) -> None:
        """Start without a workspace."""
        self.settings = settings
        self.estimate: Estimate | None = None
        self.is_lost = settings.has_pose_topic
        self._seed = seed
        self._particle_filter: ParticleFilter | None = None
        self._kept: deque[Pose] = deque(maxlen=_N_KEPT)
        self._last_stamp = math.nan

    @property
    def calibration(self) -> tuple[float, float] | None:
        """Return the likeliest slip and drift [rad/m]; None if odometry is not corrected."""
        return None if self._particle_filter is None else self._particle_filter.calibration

    def take_field(self, field: ControlField) -> None:
        """Take over the workspace and the remembered map of a field."""
        if not self.settings.mends_odometry:
            return
        particle_filter = self._particle_filter
        if particle_filter is not None and particle_filter.grid.offset_to(field.grid) is not None:
            particle_filter.take_workspace(field.grid)
            if self.estimate is not None:
                self.estimate = particle_filter.estimate()
        else:
            motion_noise = MotionNoise(
                self.settings.slip_std, self.settings.drift_std, self.settings.heading_noise,
                turning_radius=self.settings.wheel_separation / 2)
            self._particle_filter = particle_filter = ParticleFilter(
                field.grid, motion_noise, np.random.default_rng([self._seed, 7]),
                self.settings.particles)
            self._kept.clear()
        particle_filter.remember(field.known)

    def place(self, pose: Pose, neighbourhood: Neighbourhood | None) -> Pose:
        """
        Return where the robot is when odometry says ``pose`` and it observes ``neighbourhood``.

        The result has the stamp and frame of the odometry.
        """
        particle_filter = self._particle_filter
        if particle_filter is None:
            return pose
        last = self._kept[-1] if self._kept else None
        self._kept.append(pose)
        step = None if last is None else _step(last, pose)
        if last is None or step is None or self._is_set_back(pose.stamp - last.stamp, step):
            self._restart(pose)
        else:
            particle_filter.move(*step)
        if self.settings.anchoring and neighbourhood is not None:
            particle_filter.see(neighbourhood.nine)
        self.estimate = particle_filter.estimate()
        return replace(pose, x=self.estimate.x, y=self.estimate.y, yaw=self.estimate.yaw)

    def moved(self, neighbourhood: Neighbourhood) -> Neighbourhood:
        """
        Return a neighbourhood moved to where the robot is.

        Free cells that may as well be others become unknown. What lies farther away than the cells
        around the robot's is kept only where nothing had to be moved or doubted.
        """
        if self._particle_filter is None or self.estimate is None:
            return neighbourhood
        row, col = self.estimate.row, self.estimate.col
        nine = self._particle_filter.doubted(neighbourhood.nine, row, col)
        if (row, col) == (neighbourhood.row, neighbourhood.col) and (
                nine == neighbourhood.nine).all():
            return neighbourhood
        return replace(neighbourhood, row=row, col=col, cells=nine,
                       fine=None if neighbourhood.fine is None else neighbourhood.finest)

    def correct(self, pose: Pose, variances: tuple[float, float, float]) -> bool:
        """Correct the pose by one of `pose_topic`; return whether it was of use."""
        particle_filter = self._particle_filter
        now = _brought_up_to_date(pose, self._kept)
        if particle_filter is None or now is None or pose.stamp == self._last_stamp:
            return False
        self._last_stamp = pose.stamp
        x_var, y_var, yaw_var = (
            max(given, least) for given, least in zip(variances, _MIN_VARIANCES, strict=True))
        if self.is_lost:
            particle_filter.place(*now, math.sqrt(max(x_var, y_var)), math.sqrt(yaw_var))
            self.is_lost = False
            return True
        return particle_filter.localise(*now, (x_var, y_var, yaw_var))

    def _is_set_back(self, dt: float, step: tuple[float, float, float]) -> bool:
        settings = self.settings
        return (dt < 0.0
                or math.hypot(*step[:2]) > 1.5 * settings.v_max * dt + _SET_BACK[0]
                or abs(step[2]) > 1.5 * settings.w_max * dt + _SET_BACK[1])

    def _restart(self, pose: Pose) -> None:
        self._kept.clear()
        self._kept.append(pose)
        self.is_lost = self.settings.has_pose_topic
        if self._particle_filter is not None:
            self._particle_filter.place(pose.x, pose.y, pose.yaw)


def _step(last: Pose, pose: Pose) -> tuple[float, float, float]:
    """Return the step from one pose to the next, in the frame of the first."""
    dx, dy, cos, sin = pose.x - last.x, pose.y - last.y, math.cos(last.yaw), math.sin(last.yaw)
    return (dx * cos + dy * sin, dy * cos - dx * sin,
            math.remainder(pose.yaw - last.yaw, math.tau))


def _brought_up_to_date(
    pose: Pose, kept: 'deque[Pose]',
) -> tuple[float, float, float] | None:
    """Add to a pose what the odometry has come since; None if that is not known any more."""
    then = next((old for old in reversed(kept) if old.stamp <= pose.stamp + 1e-6), None)
    if then is None:
        return None
    ahead, left, turn = _step(then, kept[-1])
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return (pose.x + ahead * cos - left * sin, pose.y + ahead * sin + left * cos,
            pose.yaw + turn)
