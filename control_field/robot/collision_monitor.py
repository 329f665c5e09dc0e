"""
The collision monitor before the wheels: what no learnt thing can change.

It knows neither field nor Q-value, only a command, where the robot is and what its 3x3 local grid
shows. A command passes as far as it is finite, within the limits of speed and acceleration, and as
far as the robot's disc, driving its arc and then braking, touches no cell that the local grid
shows blocked and stays within the nine cells. Where something reaches into the robot's own cell it
stands. Turning on the spot moves no disc and always passes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Final

from control_field.grid import Grid
from control_field.robot.limits import (
    Limits, STANDSTILL, Velocity, within_acceleration, within_speed)

#: Distance kept from what is blocked, beyond the body, [m].
MARGIN: Final = 0.001
#: Distance between the points at which the arc is looked at, [m].
SPACING: Final = 0.005
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
    LATE = 'late'                  #: no forward motion: where it is by now is too uncertain
    NO_LOCAL_GRID = 'no_sight'     #: no forward motion: the local grid does not show its place
    NOT_FINITE = 'not_finite'      #: stopped: NaN, infinity or a time that is negative

    @property
    def is_for_movers(self) -> bool:
        """Return whether it was done for something that moves, and will go."""
        return self is Intervention.ENTERED

    @property
    def sentence(self) -> str:
        """Say why a robot that is to drive stands; empty where it only drives slower."""
        return _SENTENCES.get(self, '')


_SENTENCES: Final = {
    Intervention.BLOCKED: 'blocked or unseen cells are in the way',
    Intervention.ENTERED: 'something reaches into its own cell',
    Intervention.LATE: 'poses arrive so late that where it is by now is too uncertain here',
    Intervention.NO_LOCAL_GRID: 'nothing shows what is around it',
    Intervention.NOT_FINITE: 'command, pose or time is no number, or the time is negative'}


@dataclass(frozen=True, slots=True)
class LocalGrid:
    """
    What a 3x3 neighbourhood says about where the robot's disc may be.

    Parameters
    ----------
    boxes : tuple of (x_low, y_low, x_high, y_high), [m]
        The blocked cells.
    seen : tuple of (x_low, y_low, x_high, y_high), [m]
        The square of all nine cells.
    is_entered : bool
        Whether something is in the robot's own cell, nobody knows where.

    """

    boxes: tuple[tuple[float, float, float, float], ...]
    seen: tuple[float, float, float, float]
    is_entered: bool = False


def local_grid_from_cells(
    cells: Sequence[Sequence[int]], row: int, col: int, grid: Grid,
    unknown_is_blocked: bool = False, own_cell: bool = False,
) -> LocalGrid:
    """
    Place a neighbourhood in the world.

    Parameters
    ----------
    cells : 3 by 3 numbers
        0 free, -1 unknown, anything else blocked; row 0 at the lowest y. The robot stands in the
        middle one: that it is unknown says nothing.
    row, col : int
        Cell in the middle.
    grid : Grid
        The workspace; what lies outside it is blocked.
    unknown_is_blocked : bool
        Whether to keep out of unknown cells.
    own_cell : bool
        Whether a blocked middle means that something reaches in; some sensors mark the robot.

    """
    def is_blocked(i: int, j: int) -> bool:
        if not grid.contains(row + i - 1, col + j - 1):
            return True
        state = cells[i][j]
        return unknown_is_blocked if state == -1 else state != 0

    side, x, y = grid.resolution, grid.origin_x, grid.origin_y
    low_x, low_y = x + (col - 1) * side, y + (row - 1) * side
    boxes = tuple(
        (low_x + j * side, low_y + i * side, low_x + (j + 1) * side, low_y + (i + 1) * side)
        for i in range(3) for j in range(3) if (i, j) != (1, 1) and is_blocked(i, j))
    return LocalGrid(boxes, (low_x, low_y, low_x + 3 * side, low_y + 3 * side),
                     own_cell and cells[1][1] not in (0, -1))


def clear_of_obstacles(
    velocity: Velocity, dt: float, pose: tuple[float, float, float], local_grid: LocalGrid,
    limits: Limits,
) -> tuple[Velocity, Intervention]:
    """Return the velocity, slowed as far as its braking way needs."""
    v, w = velocity
    if abs(v) < SLOWEST:
        return (0.0, w), Intervention.NONE
    if not is_within(pose, local_grid):
        return (0.0, w), Intervention.NO_LOCAL_GRID
    if local_grid.is_entered:
        return (0.0, w), Intervention.ENTERED
    for share in (1.0, 0.5, 0.25):
        if is_clear((share * v, w), dt, pose, local_grid, limits):
            return (share * v, w), Intervention.NONE if share == 1.0 else Intervention.SLOWED
    return (0.0, w), Intervention.BLOCKED


#: What slows a velocity down for what is in its way.
Slowing = Callable[[Velocity, float, tuple[float, float, float], LocalGrid, Limits],
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
        None where there is no local grid: then the robot may only turn.
    limits : Limits
        What the robot can do.
    slowed : callable
        Looks at what is in the way; `control_field.robot.late_collision_monitor` has one for
        poses that come late.

    Returns
    -------
    velocity : tuple of float
        Within the limits of speed, and within those of acceleration unless the reason is
        ``BLOCKED``, ``SLOWED``, ``ENTERED``, ``LATE``, ``NO_LOCAL_GRID`` or ``NOT_FINITE``: those
        brake at once.
    reason : Intervention

    """
    if not all(map(math.isfinite, (*command, *previous, dt, *pose))) or dt < 0.0:
        return STANDSTILL, Intervention.NOT_FINITE
    dt = min(dt, LONGEST_STEP)
    slow = within_speed(command, limits)
    ramped = within_speed(within_acceleration(slow, previous, dt, limits), limits)
    if local_grid is None:
        return (0.0, ramped[1]), Intervention.NO_LOCAL_GRID
    velocity, reason = slowed(ramped, dt, pose, local_grid, limits)
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


def distance_to_box(x: float, y: float, box: tuple[float, float, float, float]) -> float:
    """Return the distance of a point from a box, [m]; negative inside (to the nearest edge)."""
    dx = max(box[0] - x, x - box[2])
    dy = max(box[1] - y, y - box[3])
    if dx > 0.0 and dy > 0.0:
        return math.hypot(dx, dy)
    return max(dx, dy)


def distance_to_edge(x: float, y: float, seen: tuple[float, float, float, float]) -> float:
    """Return how deep inside a box a point lies, [m]; negative outside."""
    return min(x - seen[0], y - seen[1], seen[2] - x, seen[3] - y)


def _on_arc(x: float, y: float, yaw: float, s: float, bend: float) -> tuple[float, float]:
    """Return the point ``s`` metres along an arc that turns ``bend`` rad a metre driven."""
    turn = bend * abs(s)
    chord = s if abs(turn) < 1e-9 else s * math.sin(0.5 * turn) / (0.5 * turn)
    return (x + chord * math.cos(yaw + 0.5 * turn), y + chord * math.sin(yaw + 0.5 * turn))
