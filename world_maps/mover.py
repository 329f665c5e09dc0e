"""
One thing that moves: a disc that follows waypoints, or wanders.

Where it is, is a pure function of its own time and the seed.
"""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise, repeat
import math
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from world_maps.clearance import Clearance
from world_maps.world import World

Point: TypeAlias = tuple[float, float]

MODES: Final = ('loop', 'back_and_forth', 'once', 'wander')
#: The shortest round of a mover, [s]: less is no way to go.
_LEAST_ROUND: Final = 0.1
#: How far one that wanders goes straight on, [cells], and how often it looks for a way or a place.
_STRAIGHT: Final = (2.0, 8.0)
_TRIES: Final = 1000
#: The least distance looked ahead for walls, [m].
_LOOK: Final = 5e-3


class Waypoint(NamedTuple):
    """A point of a mover's way, [m], and how long it stands there, [s]."""

    x: float
    y: float
    wait: float = 0.0


@dataclass(frozen=True)
class Mover:
    """
    A disc and how it moves.

    Parameters
    ----------
    radius : float, [m]
    speed : float, [m/s]
        Above 0; it moves at this speed or stands.
    waypoints : tuple of Waypoint
        Its way; walls do not matter to it. One that wanders keeps clear of walls, and may have
        one: where it begins (without, anywhere).
    mode : str
        ``loop``: round and round; ``back_and_forth``; ``once``: comes, and is gone at the end;
        ``wander``: straight ways in random directions.
    start : float, [s]
        Before, it is not there.
    comes_every : float, [s]
        0, or with mode ``once``: it comes again and again, after random pauses of this mean.
    patience : float, [s]
        How long it stands before the robot until it turns back, give or take a half; 0: for ever.
    name : str
        For messages.

    Raises
    ------
    ValueError
        If a value is out of range; the message begins with its name.

    """

    radius: float
    speed: float = 0.15
    waypoints: tuple[Waypoint, ...] = ()
    mode: str = 'loop'
    start: float = 0.0
    comes_every: float = 0.0
    patience: float = 3.0
    name: str = ''

    def __post_init__(self) -> None:
        """Check the values, alone and together."""
        _check_range('radius', self.radius, 1e-3, 100.0)
        _check_range('speed', self.speed, 1e-3, 100.0)
        for name in ('start', 'comes_every', 'patience'):
            _check_range(name, getattr(self, name), 0.0, 1e9)
        for point in self.waypoints:
            _check_range('waypoints', point.x, -1e7, 1e7)
            _check_range('waypoints', point.y, -1e7, 1e7)
            _check_range('waypoints', point.wait, 0.0, 1e9)
        if self.mode not in MODES:
            raise ValueError(f'mode is {self.mode!r}, must be one of {", ".join(MODES)}')
        if self.comes_every and self.mode != 'once':
            raise ValueError(f'comes_every is of use with mode once only, the mode is {self.mode}')
        self._check_way()

    def _check_way(self) -> None:
        """Raise ValueError for a way that nobody can go."""
        if self.mode == 'wander':
            if len(self.waypoints) > 1:
                raise ValueError('waypoints must be at most one, where it begins, with mode '
                                 'wander')
        elif not self.waypoints:
            raise ValueError('waypoints must be at least one [x, y]')
        elif not self.stands and _duration(self._round()) < _LEAST_ROUND:
            raise ValueError(f'waypoints are gone through in less than {_LEAST_ROUND:g} s: set '
                             f'them farther apart, or a wait')

    @property
    def stands(self) -> bool:
        """Return whether it stands in one place as long as it is there."""
        return len(self.waypoints) == 1 and self.mode in ('loop', 'back_and_forth')

    def segments(self, world: World, rng: np.random.Generator) -> Iterator['Segment']:
        """
        Return what it does, one segment after another, without end unless it goes away for good.

        Raises
        ------
        ValueError
            If it has no room in the world.

        """
        if self.mode == 'wander':
            return _wander(self, world, rng)
        if self.stands:
            point = self.waypoints[0][:2]
            return iter([Segment(math.inf, point, point)])
        if self.comes_every:
            return _visits(self._round(), self.comes_every, rng)
        rounds = repeat(self._round(), 1) if self.mode == 'once' else repeat(self._round())
        return chain.from_iterable(rounds)

    def _round(self) -> list['Segment']:
        points = self.waypoints
        if self.mode == 'loop':
            return list(_walk((*points, points[0]), self.speed))
        if self.mode == 'back_and_forth':
            return list(_walk((*points, *points[-2::-1]), self.speed))
        stay = Segment(points[-1].wait, points[-1][:2], points[-1][:2])
        return [*_walk(points, self.speed), stay]


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ValueError(f'{name} is {value:g}, must be between {low:g} and {high:g}')


class Segment(NamedTuple):
    """So many seconds of a mover's time: straight from a point to another, or not there (None)."""

    seconds: float
    begin: Point | None
    end: Point | None


def _duration(segments: Iterable[Segment]) -> float:
    return sum(segment.seconds for segment in segments)


def _walk(points: Sequence[Waypoint], speed: float) -> Iterator[Segment]:
    """Yield the segments along waypoints: the wait at each but the last, and the way on."""
    for here, there in pairwise(points):
        begin, end = here[:2], there[:2]
        yield Segment(here.wait, begin, begin)
        yield Segment(math.dist(begin, end) / speed, begin, end)


def _visits(segments: list[Segment], mean: float, rng: np.random.Generator) -> Iterator[Segment]:
    """Yield the same segments again and again, with random pauses in which nobody is there."""
    while True:
        yield Segment(float(rng.exponential(mean)), None, None)
        yield from segments


def _wander(mover: Mover, world: World, rng: np.random.Generator) -> Iterator[Segment]:
    """Return straight segments in random directions, each as far as there is room."""
    clearance = Clearance(world, mover.radius)
    here = mover.waypoints[0][:2] if mover.waypoints else _free_place(world, clearance, rng)
    if here is None or clearance.at(*here) < 0.0:
        raise ValueError(f'there is no room for a mover of radius {mover.radius:g} m')
    return _straight_segments(here, mover.speed, world.grid.resolution, clearance, rng)


def _straight_segments(
    here: Point, speed: float, resolution: float, clearance: Clearance, rng: np.random.Generator,
) -> Iterator[Segment]:
    while True:
        angle, wish = rng.uniform(0.0, math.tau), rng.uniform(*_STRAIGHT) * resolution
        length = _free_length(here, angle, wish, clearance)
        there = (here[0] + length * math.cos(angle), here[1] + length * math.sin(angle))
        # One that has no room to go stands for a moment, so that time passes.
        yield Segment(max(length / speed, _LEAST_ROUND), here, there)
        here = there


def _free_length(here: Point, angle: float, wish: float, clearance: Clearance) -> float:
    """Return how far of a straight way a disc can go before it touches something, [m]."""
    length, room = 0.0, clearance.at(*here)
    while length < wish:
        ahead = min(length + max(room, _LOOK), wish)
        room = clearance.at(here[0] + ahead * math.cos(angle), here[1] + ahead * math.sin(angle))
        if room < 0.0:
            return length
        length = ahead
    return length


def _free_place(world: World, clearance: Clearance, rng: np.random.Generator) -> Point | None:
    """Return a random place where a disc touches nothing; None if none was found."""
    grid = world.pixels.grid
    for _ in range(_TRIES):
        x = grid.origin_x + float(rng.random()) * grid.n_cols * grid.resolution
        y = grid.origin_y + float(rng.random()) * grid.n_rows * grid.resolution
        if clearance.at(x, y) >= 0.0:
            return x, y
    return None


class Track:
    """
    Where a mover is, by its own time.

    Parameters
    ----------
    mover : Mover
    world : World
        For one that wanders.
    rng : numpy.random.Generator
        Its own; it is used further as time goes on.

    Raises
    ------
    ValueError
        If there is no room for it.

    """

    def __init__(self, mover: Mover, world: World, rng: np.random.Generator) -> None:
        """Know nothing but the beginning; the rest is laid when it is asked for."""
        self.start = mover.start
        self._coming = mover.segments(world, rng)
        self._segments: list[Segment] = []
        self._ends: list[float] = []

    def at(self, seconds: float) -> Point | None:
        """Return its place [m] at a time of its own, None while it is not there."""
        if seconds < self.start:
            return None
        while (self._ends[-1] if self._ends else self.start) <= seconds:
            segment = next(self._coming, None)
            if segment is None:
                return None
            self._ends.append((self._ends[-1] if self._ends else self.start) + segment.seconds)
            self._segments.append(segment)
        index = bisect_right(self._ends, seconds)
        segment, left = self._segments[index], self._ends[index] - seconds
        if segment.begin is None or segment.end is None or segment.begin == segment.end:
            return segment.begin
        share = left / segment.seconds
        return (segment.end[0] + share * (segment.begin[0] - segment.end[0]),
                segment.end[1] + share * (segment.begin[1] - segment.end[1]))


def tracks(movers: Sequence[Mover], world: World, seed: int) -> list[Track]:
    """
    Return where each mover is by its own time, the same for the same world and seed.

    Raises
    ------
    ValueError
        If there is no room for one; the message says which.

    """
    laid = []
    for index, mover in enumerate(movers):
        try:
            laid.append(Track(mover, world, np.random.default_rng([seed, index])))
        except ValueError as error:
            raise ValueError(f'mover {mover.name or index + 1}: {error}') from None
    return laid
