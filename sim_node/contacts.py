"""Who ran into whom: the robot into something that moves, or that into the robot."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math
from typing import Final

from world_maps.clearance import Clearance
from world_maps.movers import Disc, gap_between

#: A robot that was stopped is as near to what stopped it, [m].
_TOUCH: Final = 1e-4
#: A contact is over when there is so much room, [m].
_APART: Final = 1e-3
#: Less of a gap closed is rounding, [m].
_LEAST_CLOSED: Final = 1e-9


class Surroundings:
    """
    The room around the robot's disc, between what stands and what moves, at one moment.

    Parameters
    ----------
    clearance : Clearance
        The room between what stands; its radius is the robot's.
    discs : sequence of Disc or None
        What moves.

    """

    def __init__(self, clearance: Clearance, discs: Sequence[Disc | None]) -> None:
        self.radius = clearance.radius
        self._clearance = clearance
        self._discs = [disc for disc in discs if disc is not None]

    def at(self, x: float, y: float) -> float:
        """Return the distance from the disc's edge to what is next to it; see `Clearance.at`."""
        room = self._clearance.at(x, y)
        for disc in self._discs:
            room = min(room, gap_between(disc, Disc(x, y, self.radius)))
        return room


@dataclass
class Contacts:
    """
    What the robot touches of what moves, and how often who ran into whom.

    The robot ran into a mover if its own motion in that tick closed the gap, though the mover
    closed it as well. A mover ran into the robot if the robot stood, turned, or drove another way.
    """

    n_robot: int = 0
    n_mover: int = 0
    #: The movers that touch the robot, and those of them that it has run into.
    touching: set[int] = field(default_factory=set)
    run_into: set[int] = field(default_factory=set)

    def on_tick(
        self, robot: tuple[Disc, Disc], before: Sequence[Disc | None],
        after: Sequence[Disc | None], hit: bool, held: Sequence[bool],
    ) -> bool:
        """
        Take note of what happened in a tick, in which the robot moved first.

        Parameters
        ----------
        robot : tuple of Disc
            Before and after.
        before, after : sequence of Disc or None
            The movers.
        hit : bool
            Whether something stopped the robot.
        held : sequence of bool
            Which movers the robot stopped.

        Returns
        -------
        bool
            Whether what stopped the robot was a mover.

        """
        was_mover = False
        for index, old in enumerate(before):
            gap = gap_between(robot[1], old)
            closed = gap_between(robot[0], old) - gap if math.isfinite(gap) else 0.0
            is_stop = hit and gap < _TOUCH
            was_mover |= is_stop
            if is_stop or (held[index] and closed > _LEAST_CLOSED):
                self._robot_runs_into(index)
            elif held[index]:
                self._is_run_into_by(index)
            elif gap_between(robot[1], after[index]) > _APART:
                self.part_from(index)
        return was_mover

    def part(self) -> None:
        """End every contact."""
        self.touching.clear()
        self.run_into.clear()

    def part_from(self, index: int) -> None:
        """End the contact with a mover."""
        self.touching.discard(index)
        self.run_into.discard(index)

    def _robot_runs_into(self, index: int) -> None:
        if index not in self.run_into:
            self.n_robot += 1
            self.run_into.add(index)
            self.touching.add(index)

    def _is_run_into_by(self, index: int) -> None:
        if index not in self.touching:
            self.n_mover += 1
            self.touching.add(index)
