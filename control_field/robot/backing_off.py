"""Which way a standing robot backs off from what comes towards it."""

import math
from typing import Final

from control_field.robot.collision_monitor import gap_between, stopping_time
from control_field.robot.limits import Limits, MARGIN, STANDSTILL, Velocity
from control_field.robot.obstacle_boxes import LocalGrid

#: Share of its greatest speed that it backs off with, and how far that is looked ahead, [m].
_SPEED: Final = 0.5
_AHEAD: Final = 0.05


def backing_off(
    pose: tuple[float, float, float], local_grid: LocalGrid, dt: float, limits: Limits,
) -> Velocity:
    """
    Return the velocity, forward or backward, that leads away from what comes; else standstill.

    What is in its way there is the collision monitor's business.

    Parameters
    ----------
    pose : tuple of float
        ``(x, y, yaw)``, [m] and [rad].
    local_grid : LocalGrid
    dt : float, [s]
        Time until the next command.
    limits : Limits

    """
    v = _SPEED * limits.v_max
    x, y, yaw = pose
    keep = MARGIN + local_grid.mover_speed * stopping_time(limits.v_max, dt, limits)
    near = [box for box in local_grid.moving if gap_between(pose, box, limits) < keep]
    if not local_grid.backs_off or not near:
        return STANDSTILL

    def room(ahead: float) -> float:
        there = x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), yaw
        return min(gap_between(there, box, limits) for box in near)

    forward, backward = room(_AHEAD), room(-_AHEAD)
    if max(forward, backward) <= room(0.0):
        return STANDSTILL
    return (v, 0.0) if forward > backward else (-v, 0.0)
