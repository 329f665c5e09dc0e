"""
The collision monitor before the wheels: what no learnt thing can change.

It knows neither field nor Q-value, only a command, where the robot is and what its 3x3 local grid
shows. A command passes as far as it is finite, within the limits of speed and acceleration, and as
far as the robot's disc, driving its arc and then braking, touches no cell that the local grid
shows blocked and stays within the nine cells. The robot stands where something reaches into its
own cell, and where something that moves could reach it before it stands. Turning on the spot moves
no disc and always passes; a body with a `Footprint` turns as far as its corners touch nothing.
"""

from collections.abc import Callable
from enum import StrEnum
import math
from typing import Final

from control_field.robot.footprint_sweep import (
    gap_to_box, is_clear_for, SHARES, velocities_to_try)
from control_field.robot.limits import (
    Limits, MARGIN, STANDSTILL, Velocity, within_acceleration, within_speed)
from control_field.robot.obstacle_boxes import (
    Box, distance_to_box, distance_to_edge, LocalGrid)

#: Distance between the points at which the arc is looked at, [m].
SPACING: Final = 0.005
#: How much of its way must lead straight away from what may reach the robot.
AWAY: Final = 0.9
#: Slower than this is standing, [m/s]; an arc of next to no speed bends without bound.
SLOWEST: Final = 1e-9
#: Longest time that one command is taken to last, [s].
LONGEST_STEP: Final = 0.5


class Intervention(StrEnum):
    """What the collision monitor did to a command; the gravest if several."""

    NONE = 'none'                  #: passed as it was
    ACCELERATION = 'acceleration'  #: ramped
    SPEED = 'speed'                #: cut to what the robot can drive
    SLOWED = 'slowed'              #: near something blocked
    BLOCKED = 'blocked'            #: no forward motion: it would touch a blocked cell
    ENTERED = 'entered'            #: no forward motion: something reaches into its own cell
    MOVING = 'moving'              #: no forward motion: what moves could reach it before it stands
    LATE = 'late'                  #: no forward motion: where it is by now is too uncertain
    NO_LOCAL_GRID = 'no_sight'     #: no forward motion: the local grid does not show its place
    NOT_FINITE = 'not_finite'      #: stopped: NaN, infinity or a time that is negative

    @property
    def is_for_movers(self) -> bool:
        """Return whether it was done for something that moves, and will go."""
        return self in {Intervention.ENTERED, Intervention.MOVING}

    @property
    def sentence(self) -> str:
        """Say why a robot that is to drive stands; empty where it only drives slower."""
        return _SENTENCES.get(self, '')


_SENTENCES: Final = {
    Intervention.BLOCKED: 'blocked or unseen cells are in the way',
    Intervention.ENTERED: 'something reaches into its own cell',
    Intervention.MOVING: 'something that moves is too near',
    Intervention.LATE: 'poses arrive so late that where it is by now is too uncertain here',
    Intervention.NO_LOCAL_GRID: 'nothing shows what is around it',
    Intervention.NOT_FINITE: 'command, pose or time is no number, or the time is negative'}


def clear_of_obstacles(
    velocity: Velocity, previous: Velocity, dt: float, pose: tuple[float, float, float],
    local_grid: LocalGrid, limits: Limits,
) -> tuple[Velocity, Intervention]:
    """Return the velocity, slowed as far as its braking way needs."""
    if limits.footprint is not None:
        footprint = limits.footprint
        return body_clear_of_obstacles(
            velocity, previous, dt, pose, local_grid, limits,
            lambda slower, brakes: is_clear_for(
                footprint, slower, previous, dt, pose, local_grid, limits, brakes))
    v, w = velocity
    if abs(v) < SLOWEST:
        return (0.0, w), Intervention.NONE
    if not is_within(pose, local_grid):
        return (0.0, w), Intervention.NO_LOCAL_GRID
    if local_grid.is_entered:
        return (0.0, w), Intervention.ENTERED
    for share in SHARES:
        slower = share * v, w
        if is_clear(slower, dt, pose, local_grid, limits) and (
                is_out_of_reach(slower, dt, pose, local_grid, limits)):
            return slower, Intervention.NONE if share == 1.0 else Intervention.SLOWED
    if is_clear((SHARES[-1] * v, w), dt, pose, local_grid, limits):
        return (0.0, w), Intervention.MOVING
    return (0.0, w), Intervention.BLOCKED


def body_clear_of_obstacles(
    velocity: Velocity, previous: Velocity, dt: float, pose: tuple[float, float, float],
    local_grid: LocalGrid, limits: Limits, is_clear: Callable[[Velocity, bool], bool],
    late_by: float = 0.0,
) -> tuple[Velocity, Intervention]:
    """
    Return what `clear_of_obstacles` does, for a body with a footprint.

    Nothing is changed faster than the limits of acceleration allow, standing still included, but
    where braking like that would touch something: what has just come.

    Parameters
    ----------
    velocity, previous, dt, pose, local_grid, limits
        As for `limit_command`; the velocity is within the acceleration.
    is_clear : callable
        Whether a velocity, and stopping after it, touches nothing; and whether it is to brake.
    late_by : float, [s]
        How old the pose is.

    """
    braking = within_acceleration(STANDSTILL, previous, dt, limits)
    if not is_within(pose, local_grid):
        return braking, Intervention.NO_LOCAL_GRID
    if local_grid.is_entered:
        return braking, Intervention.ENTERED
    why = Intervention.BLOCKED
    for slower, drives in velocities_to_try(velocity, braking):
        if not is_clear(slower, False):
            continue
        if abs(slower[0]) >= SLOWEST and slower[0] != braking[0] and not is_out_of_reach(
                slower, dt + late_by, pose, local_grid, limits):
            why = Intervention.MOVING
            continue
        if slower == velocity:
            return slower, Intervention.NONE
        return slower, Intervention.SLOWED if drives or abs(velocity[0]) < SLOWEST else why
    return braking if is_clear(braking, True) else STANDSTILL, why


#: What slows a velocity down for what is in its way.
Slowing = Callable[
    [Velocity, Velocity, float, tuple[float, float, float], LocalGrid, Limits],
    tuple[Velocity, Intervention]]


def limit_command(
    command: Velocity, previous: Velocity, dt: float, pose: tuple[float, float, float],
    local_grid: LocalGrid | None, limits: Limits, slowed: Slowing = clear_of_obstacles,
) -> tuple[Velocity, Intervention]:
    """
    Return the command that may go to the wheels, and what was done to it.

    Parameters
    ----------
    command : tuple of float, [m/s] and [rad/s]
        What is asked for.
    previous : tuple of float, [m/s] and [rad/s]
        What was let through the last time.
    dt : float
        Time since then, and until the next time, [s].
    pose : tuple of float
        ``(x, y, yaw)``, [m] and [rad].
    local_grid : LocalGrid or None
        None where there is no local grid: then the robot may only turn, if it is a disc.
    limits : Limits
        What the robot can do.
    slowed : callable
        Looks at what is in the way; `control_field.robot.late_collision_monitor` has one for
        poses that come late.

    Returns
    -------
    velocity : tuple of float
        Within the limits of speed, and within those of acceleration unless the reason is
        ``BLOCKED``, ``SLOWED``, ``ENTERED``, ``MOVING``, ``LATE``, ``NO_LOCAL_GRID`` or
        ``NOT_FINITE``: those brake at once, but a body with a footprint.
    reason : Intervention

    """
    if not all(map(math.isfinite, (*command, *previous, dt, *pose))) or dt < 0.0:
        return STANDSTILL, Intervention.NOT_FINITE
    dt = min(dt, LONGEST_STEP)
    slow = within_speed(command, limits)
    ramped = within_speed(within_acceleration(slow, previous, dt, limits), limits)
    if local_grid is None:
        turn = 0.0 if limits.footprint is not None else ramped[1]
        return (0.0, turn), Intervention.NO_LOCAL_GRID
    velocity, reason = slowed(ramped, previous, dt, pose, local_grid, limits)
    if reason is not Intervention.NONE:
        return velocity, reason
    if ramped != slow:
        return ramped, Intervention.ACCELERATION
    return ramped, Intervention.SPEED if slow != command else Intervention.NONE


def is_within(pose: tuple[float, float, float], local_grid: LocalGrid) -> bool:
    """Return whether a pose lies within what is seen."""
    low_x, low_y, high_x, high_y = local_grid.seen
    return low_x <= pose[0] <= high_x and low_y <= pose[1] <= high_y


def braking_way(v: float, dt: float, limits: Limits) -> float:
    """Return how far the robot gets in one step and then braking, [m]."""
    return abs(v) * dt + v * v / (2.0 * limits.a_max)


def stopping_time(v: float, dt: float, limits: Limits) -> float:
    """Return after which time the robot stands that drives one step and then brakes, [s]."""
    return dt + abs(v) / limits.a_max


def is_clear(
    velocity: Velocity, dt: float, pose: tuple[float, float, float], local_grid: LocalGrid,
    limits: Limits,
) -> bool:
    """
    Return whether the disc touches nothing on its arc and braking way.

    A disc that overlaps something already (a noisy pose) may move as long as it gets no deeper.
    """
    v, w = velocity
    x, y, yaw = pose
    way = braking_way(v, dt, limits)
    keep = limits.radius + MARGIN
    near = [(box, distance) for box in local_grid.boxes
            if (distance := distance_to_box(x, y, box)) < keep + way]
    edge = distance_to_edge(x, y, local_grid.seen)
    if not near and edge >= keep + way:
        return True
    n_points = max(4, math.ceil(way / SPACING))
    bend = w / abs(v)
    for k in range(1, n_points + 1):
        px, py = _on_arc(x, y, yaw, math.copysign(way * k / n_points, v), bend)
        if distance_to_edge(px, py, local_grid.seen) < min(keep, edge):
            return False
        if any(distance_to_box(px, py, box) < min(keep, start) for box, start in near):
            return False
    return True


def is_out_of_reach(
    velocity: Velocity, dt: float, pose: tuple[float, float, float], local_grid: LocalGrid,
    limits: Limits,
) -> bool:
    """
    Return whether the robot stands again before anything that moves can have reached it.

    Where it can reach a robot that stands, too, the robot may drive straight away from it, if it
    backs off at all.
    """
    if not local_grid.moving:
        return True
    v, w = velocity
    x, y, yaw = pose
    way, bend = braking_way(v, dt, limits), w / abs(v)
    keep = MARGIN + local_grid.mover_speed * stopping_time(v, dt, limits)
    near = [(box, gap) for box in local_grid.moving
            if (gap := gap_between(pose, box, limits)) < keep + way]
    for share in (0.25, 0.5, 0.75, 1.0) if near else ():
        px, py = _on_arc(x, y, yaw, math.copysign(way * share, v), bend)
        place = px, py, yaw + bend * way * share
        away = AWAY * way * share if local_grid.backs_off else math.inf
        if any(gap_between(place, box, limits) < min(keep, start + away) for box, start in near):
            return False
    return True


def gap_between(place: tuple[float, float, float], box: Box, limits: Limits) -> float:
    """Return how far the body at a place is from a box, [m]; negative where they overlap."""
    if limits.footprint is not None:
        return gap_to_box(limits.footprint, place, box)
    return distance_to_box(place[0], place[1], box) - limits.radius


def _on_arc(x: float, y: float, yaw: float, s: float, bend: float) -> tuple[float, float]:
    """Return the point ``s`` metres along an arc that turns ``bend`` rad a metre driven."""
    turn = bend * abs(s)
    chord = s if abs(turn) < 1e-9 else s * math.sin(0.5 * turn) / (0.5 * turn)
    return (x + chord * math.cos(yaw + 0.5 * turn), y + chord * math.sin(yaw + 0.5 * turn))
