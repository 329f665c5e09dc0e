"""
Whether a body that is no disc touches anything on its way: the polygon, swept along arcs.

A body is looked at in some places only. Between two of them no point of it moves farther than the
nearest thing was away, or than twice what is kept as a margin at both: so it touches nothing in
between either.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
import math
from typing import Final

from control_field.robot.footprint import Footprint
from control_field.robot.limits import (
    Limits, MARGIN, STANDSTILL, Velocity, within_acceleration)
from control_field.robot.obstacle_boxes import Box, distance_to_box, LocalGrid
from control_field.robot.sent_commands import moved, Piece, Place

#: Shares of a velocity that are tried, the greatest first.
SHARES: Final = (1.0, 0.5, 0.25)
#: Pieces that a stop is divided into.
_N_BRAKING: Final = 4
#: So many steps of a stop are looked at.
_MOST_STEPS: Final = 40
#: What is slower stands, [m/s] and [rad/s].
_SLOWEST: Final = 1e-9
#: By so much a body that overlaps something may seem to get deeper by rounding, [m].
_ROUNDING: Final = 1e-9


def gap_to_box(footprint: Footprint, place: Place, box: Box) -> float:
    """
    Return how far a body at a place is from a box, or less, [m].

    Along the axis on which they are farthest apart: exact between a side and a corner, less
    between two corners; negative by how far one of them has to move where they overlap.
    """
    return Placed.at(footprint, place).gap_to(box)


@dataclass(frozen=True, slots=True)
class Placed:
    """A footprint somewhere: of each convex piece its sides there, and the box around it."""

    x: float
    y: float
    pieces: list[tuple[list[tuple[float, float, float]], Box]]

    @classmethod
    def at(cls, footprint: Footprint, place: Place) -> 'Placed':
        """Put a footprint at a place."""
        x, y, yaw = place
        c, s = math.cos(yaw), math.sin(yaw)
        pieces = []
        for piece in footprint.pieces:
            xs = [x + c * px - s * py for px, py in piece.corners]
            ys = [y + s * px + c * py for px, py in piece.corners]
            pieces.append(([(c * nx - s * ny, s * nx + c * ny, d) for nx, ny, d in piece.sides],
                           (min(xs), min(ys), max(xs), max(ys))))
        return cls(x, y, pieces)

    def gap_to(self, box: Box) -> float:
        """Return how far it is from a box, or less, [m]; negative where they overlap."""
        low_x, low_y, high_x, high_y = box
        half_x, half_y = 0.5 * (high_x - low_x), 0.5 * (high_y - low_y)
        off_x, off_y = low_x + half_x - self.x, low_y + half_y - self.y
        least = math.inf
        for sides, (x0, y0, x1, y1) in self.pieces:
            gap = max(low_x - x1, x0 - high_x, low_y - y1, y0 - high_y)
            for nx, ny, d in sides:
                beyond = nx * off_x + ny * off_y - half_x * abs(nx) - half_y * abs(ny) - d
                if beyond > gap:
                    gap = beyond
            if gap < least:
                least = gap
        return least

    def depth_in(self, seen: Box) -> float:
        """Return how deep inside a box it lies, [m]; negative where it reaches out."""
        return min(min(x0 - seen[0], y0 - seen[1], seen[2] - x1, seen[3] - y1)
                   for _, (x0, y0, x1, y1) in self.pieces)


@dataclass(frozen=True, slots=True)
class FootprintRoom:
    """
    What is near a body, and how near it may come.

    Parameters
    ----------
    footprint : Footprint
    reach : float, [m]
        Of the footprint: the radius of its circumscribed disc.
    boxes : list of (box, least gap), [m]
    seen : box
    least_depth : float, [m]
        How deep inside ``seen`` it must stay.
    margin : float, [m]
        Kept from what it does not overlap already.

    """

    footprint: Footprint
    reach: float
    boxes: list[tuple[Box, float]]
    seen: Box
    least_depth: float
    margin: float

    @classmethod
    def around(
        cls, place: Place, way: float, local_grid: LocalGrid, footprint: Footprint,
        margin: float = MARGIN,
    ) -> 'FootprintRoom | None':
        """
        Return what there is within reach of a way of some length, [m]; None if that is nothing.

        What the body overlaps already, or is too near, it must come no nearer.
        """
        x, y, _ = place
        reach = footprint.circumscribed
        near = [box for box in local_grid.boxes
                if distance_to_box(x, y, box) < reach + margin + way]
        here = Placed.at(footprint, place)
        depth = here.depth_in(local_grid.seen)
        if not near and min(x - local_grid.seen[0], y - local_grid.seen[1],
                            local_grid.seen[2] - x, local_grid.seen[3] - y) >= (
                                reach + margin + way):
            return None
        boxes = [(box, min(margin, here.gap_to(box)) - _ROUNDING) for box in near]
        return cls(footprint, reach, boxes, local_grid.seen, min(margin, depth) - _ROUNDING,
                   margin)

    def sweep(self, place: Place, way: list[Piece]) -> Place | None:
        """Return where a way ends; None if the body touches something on it."""
        room = self._room_at(place)
        for v, w, seconds in way:
            start, at, rate = place, 0.0, abs(v) + self.reach * abs(w)
            while at < seconds and rate > _SLOWEST:
                if room is None:
                    return None
                at = min(at + max(room, 2.0 * self.margin) / rate, seconds)
                place = moved(start, (v, w, at))
                room = self._room_at(place)
        return place if room is not None else None

    def _room_at(self, place: Place) -> float | None:
        """Return how far the body may move without touching anything, [m]; None if it does."""
        here = Placed.at(self.footprint, place)
        room = here.depth_in(self.seen)
        if room < self.least_depth:
            return None
        for box, least in self.boxes:
            gap = here.gap_to(box)
            if gap < least:
                return None
            if gap < room:
                room = gap
        return room


def ways_to_stop(velocity: Velocity, dt: float, limits: Limits) -> Iterator[list[Piece]]:
    """
    Yield ways on which a robot may come to stand that is told to brake by its limits.

    Step by step, as it is told to; evenly; with its speed gone at once, or its turn. Between these
    lies what a base does that brakes harder than its limits.
    """
    v, w = velocity
    yield _evenly(velocity, limits)
    if v and w:
        yield [(0.0, w, 0.5 * abs(w) / limits.alpha_max)]
        yield [(v, 0.0, 0.5 * abs(v) / limits.a_max)]
        yield _by_steps(velocity, dt, limits)


def _evenly(velocity: Velocity, limits: Limits) -> list[Piece]:
    """Return the way to standstill of a base that brakes as its limits allow."""
    v, w = velocity
    in_v, in_w = abs(v) / limits.a_max, abs(w) / limits.alpha_max
    seconds = max(in_v, in_w) / _N_BRAKING
    if seconds <= 0.0:
        return []
    middles = [(k + 0.5) * seconds for k in range(_N_BRAKING)]
    return [(_mean(v, at, in_v, seconds), _mean(w, at, in_w, seconds), seconds) for at in middles]


def _by_steps(velocity: Velocity, dt: float, limits: Limits) -> list[Piece]:
    """Return the way to standstill of a base that does at once what it is told."""
    steps: list[Piece] = []
    slower = within_acceleration(STANDSTILL, velocity, dt, limits)
    while slower != STANDSTILL and len(steps) < _MOST_STEPS:
        steps.append((*slower, dt))
        slower = within_acceleration(STANDSTILL, slower, dt, limits)
    return steps


def _halves(before: float, now: float) -> list[tuple[float, float]]:
    """Return what a value is in both halves of a step: at once the new one, or coming to it."""
    at_once = now, now
    change = now - before
    return [at_once, (before + 0.25 * change, before + 0.75 * change)] if change else [at_once]


def _mean(value: float, at: float, until: float, seconds: float) -> float:
    """Return the mean of a value that falls evenly to 0, in a while around a moment."""
    begin, end = at - 0.5 * seconds, at + 0.5 * seconds
    if begin >= until:
        return 0.0
    left = 1.0 - begin / until
    if end <= until:
        return value * (left + 1.0 - end / until) / 2.0
    return value * left * (until - begin) / (2.0 * seconds)


def velocities_to_try(
    wanted: Velocity, braking: Velocity,
) -> Iterator[tuple[Velocity, bool]]:
    """
    Yield velocities from the wanted one down to braking, and whether the robot drives on by it.

    All are within the acceleration: what a robot is told that it does at once, and where it comes
    to stand can be told beforehand.
    """
    (v, w), (slow, straight) = wanted, braking
    turns = [straight + share * (w - straight) for share in (*SHARES, 0.0)]
    for share in SHARES if v != slow else ():
        for turn in dict.fromkeys(turns):
            yield (slow + share * (v - slow), turn), True
    for turn in dict.fromkeys(turns[:-1]):
        yield (slow, turn), False


def is_clear_for(
    footprint: Footprint, velocity: Velocity, previous: Velocity, dt: float, pose: Place,
    local_grid: LocalGrid, limits: Limits, is_braking: bool = False,
) -> bool:
    """
    Return whether a body touches nothing in a step and on its ways to stop after it.

    Of braking, which was looked at a step ago, only the way it takes, with half the margin.

    Also where the base takes the step to come from the speed before to this one, or from the turn.
    """
    (v, w), (v_before, w_before) = velocity, previous
    fastest = max(abs(v), abs(v_before))
    room = FootprintRoom.around(
        pose, fastest * dt + fastest * fastest / (2.0 * limits.a_max), local_grid, footprint,
        0.5 * MARGIN if is_braking else MARGIN)
    if room is None:
        return True
    if is_braking:
        return all(room.sweep(pose, way) is not None for way in (
            _evenly(previous, limits), _by_steps(previous, dt, limits)))
    stops = list(ways_to_stop(velocity, dt, limits))
    for k, (a, b) in enumerate(product(_halves(v_before, v), _halves(w_before, w))):
        end = room.sweep(pose, [(a[0], b[0], 0.5 * dt), (a[1], b[1], 0.5 * dt)])
        if end is None or any(room.sweep(end, way) is None
                              for way in (stops[:1] if k else stops)):
            return False
    return True
