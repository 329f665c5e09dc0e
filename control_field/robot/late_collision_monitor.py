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
    braking_way, clear_of_obstacles, Intervention, is_out_of_reach, is_within, limit_command,
    SLOWEST, SPACING, turned)
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
#: Those of a body that is no disc, which costs more to look at; and its margin, [m]: it is looked
#: at in places twice as far apart, or as what is near leaves room.
_FEW_SHARES: Final = (1.0, 0.7, 0.45, 0.26, 0.15, 0.07)
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
    def slowed(
        velocity: Velocity, dt: float, pose: Place, local_grid: LocalGrid, limits: Limits,
    ) -> tuple[Velocity, Intervention]:
        v, w = velocity

        def turning(why: Intervention) -> tuple[Velocity, Intervention]:
            return _turned(velocity, dt, pose, local_grid, limits, lag, why)

        if abs(v) < SLOWEST:
            return turning(Intervention.NONE)
        if not is_within(pose, local_grid):
            return turning(Intervention.NO_LOCAL_GRID)
        if local_grid.is_entered:
            return turning(Intervention.ENTERED)
        share = share_that_is_clear(velocity, dt, pose, local_grid, limits, lag)
        late_by = max((_duration(way) for way in lag.ways), default=0.0)
        if share and not is_out_of_reach(
                (share * v, w), dt + late_by, pose, local_grid, limits):
            return turning(Intervention.MOVING)
        if share:
            return (share * v, w), Intervention.NONE if share == 1.0 else Intervention.SLOWED
        _, done = clear_of_obstacles(velocity, dt, pose, local_grid, limits)
        near = done is Intervention.BLOCKED
        return turning(
            Intervention.LATE if lag.is_late and not near else Intervention.BLOCKED)

    return limit_command(command, previous, dt, pose, local_grid, limits, slowed)


def _turned(
    velocity: Velocity, dt: float, pose: Place, local_grid: LocalGrid, limits: Limits, lag: Lag,
    why: Intervention,
) -> tuple[Velocity, Intervention]:
    """Return what `collision_monitor.turned` returns, on all ways driven since the last pose."""
    v, w = velocity
    (_, turn), done = turned((v, w), dt, pose, local_grid, limits, why)
    if limits.footprint is None or not turn:
        return (0.0, turn), done
    share = share_that_is_clear((0.0, turn), dt, pose, local_grid, limits, lag)
    if share == 1.0:
        return (0.0, turn), done
    less = Intervention.SLOWED if share else Intervention.BLOCKED
    return (0.0, share * turn), less if why is Intervention.NONE else why


def share_that_is_clear(
    velocity: Velocity, dt: float, place: Place, local_grid: LocalGrid, limits: Limits, lag: Lag,
) -> float:
    """
    Return the greatest share of a velocity's speed that touches nothing on any way; 0 if none.

    Of a turn on the spot, which only a body that is no disc has to look at, the share of its rate.

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
    for share in SHARES if limits.footprint is None else _FEW_SHARES:
        slower = (share * v, w) if v else (0.0, share * w)
        if v and share < 0.25 and abs(slower[0]) < _CREEPING:
            return 0.0
        stops = _stops(slower, lag, limits)
        if all(room.sweep(end, [(*slower, holds + longer), *stop]) for end, holds in ends
               for longer, stop in stops):
            return share
    return 0.0


def _stops(velocity: Velocity, lag: Lag, limits: Limits) -> list[tuple[float, list[Piece]]]:
    """Return how much longer a velocity holds while the robot brakes, and what comes then."""
    v, _ = velocity
    brakes = _brakes(lag, limits)
    if limits.footprint is None:
        return [(max(brakes, v * v / (2.0 * limits.a_max)) / abs(v), [])]
    # It may still brake from a greater speed.
    longer = max(brakes - v * v / (2.0 * limits.a_max), 0.0) / abs(v) if v else 0.0
    return [(longer, stop) for stop in ways_to_stop(velocity, limits)]


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


def _room(
    place: Place, reach: float, local_grid: LocalGrid, limits: Limits,
) -> _Room | FootprintRoom | None:
    """Return what there is within reach; None if that is nothing."""
    if limits.footprint is not None:
        return FootprintRoom.around(place, reach, local_grid, limits.footprint, _MARGIN)
    x, y, _ = place
    keep = limits.radius + MARGIN
    near = [(box, min(keep, distance)) for box in local_grid.boxes
            if (distance := distance_to_box(x, y, box)) < keep + reach]
    edge = distance_to_edge(x, y, local_grid.seen)
    if not near and edge >= keep + reach:
        return None
    return _Room(near, local_grid.seen, min(keep, edge))
