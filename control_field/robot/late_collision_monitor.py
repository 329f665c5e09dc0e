"""
The collision monitor for a robot that is heard late.

It looks at every way that the robot may have gone since its last pose.
Each way begins at the last pose, follows what was sent since, then the command in question for as
long as it may hold, then the braking way.
"""

from collections.abc import Iterator
from dataclasses import dataclass
import math
from typing import Final

from control_field.robot.collision_monitor import (
    body_clear_of_obstacles, braking_way, clear_of_obstacles, Intervention, is_out_of_reach,
    is_within, limit_command, SLOWEST, SPACING)
from control_field.robot.footprint_sweep import FootprintRoom, ways_to_stop
from control_field.robot.latency import Lag
from control_field.robot.limits import Limits, MARGIN, Velocity
from control_field.robot.obstacle_boxes import Box, distance_to_box, distance_to_edge, LocalGrid
from control_field.robot.sent_commands import moved, Piece, Place

#: Shares of a speed that are tried, the greatest first; the last ones where more than creeping
#: is left, [m/s].
SHARES: Final = (
    1.0, 0.92, 0.84, 0.76, 0.68, 0.6, 0.52, 0.45, 0.38, 0.32, 0.26, 0.2, 0.15, 0.1, 0.07, 0.05)
_CREEPING: Final = 0.01
#: What a body with a footprint keeps, [m]: it is looked at in places twice as far apart, or as
#: what is near leaves room.
_MARGIN: Final = 0.005
#: How long a command is followed until it is seen that the ones before it were late, [s].
NOTICED: Final = 0.2


@dataclass(frozen=True, slots=True)
class _Room:
    """What is near enough to matter, and how near it may come."""

    boxes: list[tuple[Box, float]]
    seen: Box
    edge: float

    def sweep(self, place: Place, way: list[Piece]) -> Place | None:
        """Return where a way ends; None if the disc touches something on it."""
        for v, w, seconds in way:
            n = max(1, math.ceil(abs(v) * seconds / SPACING))
            part = (v, w, seconds / n)
            for _ in range(n):
                place = moved(place, part)
                if v and not self._holds(place[0], place[1]):
                    return None
        return place

    def _holds(self, x: float, y: float) -> bool:
        return distance_to_edge(x, y, self.seen) >= self.edge and all(
            distance_to_box(x, y, box) >= least for box, least in self.boxes)


def limit_late_command(
    command: Velocity, previous: Velocity, dt: float, pose: Place, local_grid: LocalGrid | None,
    limits: Limits, lag: Lag,
) -> tuple[Velocity, Intervention]:
    """Return what `limit_command` returns, for a pose that is old by what ``lag`` says."""
    late_by = max((_duration(way) for way in lag.ways), default=0.0)

    def slowed(
        velocity: Velocity, previous: Velocity, dt: float, pose: Place, local_grid: LocalGrid,
        limits: Limits,
    ) -> tuple[Velocity, Intervention]:
        if limits.footprint is not None:
            return body_clear_of_obstacles(
                velocity, previous, dt, pose, local_grid, limits,
                lambda slower, _: _is_clear_for(slower, dt, pose, local_grid, limits, lag),
                late_by)
        v, w = velocity
        if abs(v) < SLOWEST:
            return (0.0, w), Intervention.NONE
        if not is_within(pose, local_grid):
            return (0.0, w), Intervention.NO_LOCAL_GRID
        if local_grid.is_entered:
            return (0.0, w), Intervention.ENTERED
        share = share_that_is_clear(velocity, dt, pose, local_grid, limits, lag)
        if share and not is_out_of_reach(
                (share * v, w), dt + late_by, pose, local_grid, limits):
            return (0.0, w), Intervention.MOVING
        if share:
            return (share * v, w), Intervention.NONE if share == 1.0 else Intervention.SLOWED
        _, done = clear_of_obstacles(velocity, previous, dt, pose, local_grid, limits)
        near = done is Intervention.BLOCKED
        return (0.0, w), Intervention.LATE if lag.is_late and not near else Intervention.BLOCKED

    return limit_command(command, previous, dt, pose, local_grid, limits, slowed)


def _is_clear_for(
    velocity: Velocity, dt: float, place: Place, local_grid: LocalGrid, limits: Limits, lag: Lag,
) -> bool:
    """Return whether a body with a footprint touches nothing on any way, nor on those to stop."""
    assert limits.footprint is not None
    v, _ = velocity
    cases, brakes = list(_cases(dt, lag)), _brakes(lag, limits)
    farthest = max(_length(way) + abs(v) * holds for way, holds in cases)
    room = FootprintRoom.around(
        place, farthest + braking_way(v, 0.0, limits) + brakes, local_grid, limits.footprint,
        _MARGIN)
    if room is None:
        return True
    # It may still brake from a greater speed.
    longer = max(brakes - braking_way(v, 0.0, limits), 0.0) / abs(v) if v else 0.0
    stops = list(ways_to_stop(velocity, dt, limits))
    return all(room.sweep(place, [*way, (*velocity, holds + longer), *stop]) is not None
               for way, holds in cases for stop in stops)


def share_that_is_clear(
    velocity: Velocity, dt: float, place: Place, local_grid: LocalGrid, limits: Limits, lag: Lag,
) -> float:
    """
    Return the greatest share of a velocity's speed that touches nothing on any way; 0 if none.

    Parameters
    ----------
    velocity : tuple of float, [m/s] and [rad/s]
    dt : float
        Time until the next command, [s].
    place : tuple of float
        Where the robot was when it was last heard, [m] and [rad].
    local_grid : LocalGrid
    limits : Limits
    lag : Lag
        What it may have driven since.

    """
    cases = list(_cases(dt, lag))
    v, w = velocity
    farthest = max(_length(way) + abs(v) * holds for way, holds in cases)
    room = _room(place, farthest + braking_way(v, 0.0, limits) + _brakes(lag, limits),
                 local_grid, limits)
    if room is None:
        return 1.0
    ends: list[tuple[Place, float]] = []
    for way, holds in cases:
        end = room.sweep(place, way)
        if end is None:
            return 0.0
        ends.append((end, holds))
    brakes = _brakes(lag, limits)
    for share in SHARES:
        speed = share * v
        if share < 0.25 and abs(speed) < _CREEPING:
            return 0.0
        braking = max(brakes, speed * speed / (2.0 * limits.a_max)) / abs(speed)
        if all(room.sweep(end, [(speed, w, holds + braking)]) for end, holds in ends):
            return share
    return 0.0


def _cases(dt: float, lag: Lag) -> Iterator[tuple[list[Piece], float]]:
    """
    Yield ways to now, and how long a command may hold after them.

    The link may fall silent at any moment. Then the robot goes on by the last command that has
    arrived until it stops by itself: by the one in question, or by one of those that may still be
    under way; after that the others arrive after all.
    """
    for way in lag.ways:
        yield way, dt + lag.hold + NOTICED
    for k in _last_heard(lag.under_way):
        v, w, seconds = lag.under_way[k]
        seconds = max(seconds, min(seconds, NOTICED) + lag.hold)
        yield [(v, w, seconds), *lag.under_way[k + 1:]], dt + NOTICED


def _last_heard(under_way: list[Piece]) -> set[int]:
    """Return which of the commands under way are tried as the last one before a silence."""
    n = len(under_way)
    if not n:
        return set()
    fastest = max(range(n), key=lambda k: abs(under_way[k][0]))
    return {0, n // 3, 2 * n // 3, fastest}


def _brakes(lag: Lag, limits: Limits) -> float:
    """Return the braking way from the fastest that it may be driving now, [m]."""
    fastest = max((abs(way[-1][0]) for way in lag.ways if way), default=0.0)
    return fastest * fastest / (2.0 * limits.a_max)


def _duration(way: list[Piece]) -> float:
    return sum(seconds for _, _, seconds in way)


def _length(way: list[Piece]) -> float:
    return sum(abs(v) * seconds for v, _, seconds in way)


def _room(place: Place, reach: float, local_grid: LocalGrid, limits: Limits) -> _Room | None:
    """Return what there is within reach; None if that is nothing."""
    x, y, _ = place
    keep = limits.radius + MARGIN
    near = [(box, min(keep, distance)) for box in local_grid.boxes
            if (distance := distance_to_box(x, y, box)) < keep + reach]
    edge = distance_to_edge(x, y, local_grid.seen)
    if not near and edge >= keep + reach:
        return None
    return _Room(near, local_grid.seen, min(keep, edge))
