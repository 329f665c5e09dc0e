"""
All that moves in the true world, as time passes.

Each mover has a time of its own, which is that of the world as long as nothing is in its way: it
stands before the robot, and never pushes it.
"""

from collections.abc import Sequence
import math
from typing import Final, NamedTuple

from control_field.kernels.moving_world import patience_share
from world_maps.mover import Mover, Track, tracks
from world_maps.world import World

_BISECTIONS: Final = 24
#: Discs that overlap by more, [m], were placed so: they part freely.
_OVERLAP: Final = -1e-6


class Disc(NamedTuple):
    """A disc: centre and radius, [m]."""

    x: float
    y: float
    radius: float


def gap_between(one: Disc, other: Disc | None) -> float:
    """Return the room between two discs, [m]: negative where they overlap, inf without one."""
    if other is None:
        return math.inf
    return math.hypot(one.x - other.x, one.y - other.y) - one.radius - other.radius


class _Walker:
    """A mover on its way: its own time, which stands while the robot is in its way."""

    def __init__(self, mover: Mover, track: Track) -> None:
        self.track, self.radius, self._patience = track, mover.radius, mover.patience
        self._time, self._direction, self._held = 0.0, 1, 0.0
        self.disc = self._at(0.0)

    def advance(self, seconds: float, robot: Disc | None) -> bool:
        """Go on for some seconds; return whether the robot stopped it."""
        ahead = self._time + self._direction * seconds
        if robot is None or not self._runs_into(robot, ahead):
            self._go_to(ahead)
            self._held = 0.0
            return False
        was_there = self.disc is not None
        if was_there:
            self._go_to(self._last_free(robot, ahead))
        self._held += seconds
        if was_there and 0.0 < self._patience * patience_share(self._time) <= self._held:
            self._direction, self._held = -self._direction, 0.0
        return was_there

    def _at(self, seconds: float) -> Disc | None:
        place = self.track.at(seconds)
        return None if place is None else Disc(*place, self.radius)

    def _go_to(self, seconds: float) -> None:
        start, is_back = self.track.start, self._direction < 0
        self._time = max(seconds, start) if is_back else seconds
        self.disc = self._at(self._time)
        if is_back and (self.disc is None or self._time == start):
            self._direction = 1  # it is back where it came from, and comes again

    def _runs_into(self, robot: Disc, ahead: float) -> bool:
        now, then = gap_between(robot, self.disc), gap_between(robot, self._at(ahead))
        return then < 0.0 and then < now and now > _OVERLAP

    def _last_free(self, robot: Disc, ahead: float) -> float:
        """Return the last of its times, on the way to one, at which it does not overlap."""
        free, blocked = self._time, ahead
        for _ in range(_BISECTIONS):
            middle = 0.5 * (free + blocked)
            if gap_between(robot, self._at(middle)) < 0.0:
                blocked = middle
            else:
                free = middle
        return free


class Movers:
    """
    All that moves in a world, as time passes.

    Parameters
    ----------
    movers : sequence of Mover
    world : World
        For those that wander: the walls they keep clear of for ever.
    seed : int
        Of everything random about them.

    Raises
    ------
    ValueError
        If there is no room for one; the message says which.

    """

    def __init__(self, movers: Sequence[Mover], world: World, seed: int = 0) -> None:
        """Begin at time 0."""
        self.movers = tuple(movers)
        self.world, self.seed = world, seed
        self.reset()

    def reset(self) -> None:
        """Begin anew, with the same random numbers."""
        self._walkers = [_Walker(mover, track) for mover, track in zip(
            self.movers, tracks(self.movers, self.world, self.seed), strict=True)]

    @property
    def discs(self) -> list[Disc | None]:
        """Return where each mover is now; None for one that is not there."""
        return [walker.disc for walker in self._walkers]

    def advance(self, seconds: float, robot: Disc | None = None) -> list[bool]:
        """
        Let time pass for all of them.

        Parameters
        ----------
        seconds : float
            One tick.
        robot : Disc, optional
            None of them goes into it; what overlaps it already goes on freely.

        Returns
        -------
        list of bool
            Which of them the robot stopped.

        """
        return [walker.advance(seconds, robot) for walker in self._walkers]
