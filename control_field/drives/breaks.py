"""Where and why poses stop being one drive, in words for people."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.words import counted


class BreakKind(StrEnum):
    """Why poses are not one drive."""

    LEAP = 'leap'        #: farther than the robot drives in that time
    FAST = 'fast'        #: all the time faster than the robot
    UNSAID = 'unsaid'    #: elsewhere than the headings or speeds say that came with the poses
    TURNED = 'turned'    #: the heading leaps, and with it the frame of all that follows
    HASTE = 'haste'      #: for seconds far faster than elsewhere; a doubt only
    HOLE = 'hole'        #: seconds without a pose in which the robot drove on
    BACK = 'back'        #: the stamps go back
    STANDING = 'standing'  #: the stamps stand while the robot moves
    SOURCES = 'sources'  #: two sources speak in turns


@dataclass(frozen=True)
class Break:
    """
    A place where poses stop being one drive.

    Parameters
    ----------
    kind : BreakKind
    index : int
        Of the first pose after it.
    at : float, [s]
        When, from the first pose of the drive.
    seconds : float, [s]
        Between the poses before and after it.
    before, after : tuple of float, [m]
        Their places.
    reach : float, [m]
        How far the robot gets in that time, drives as its speeds say, or drives elsewhere.
    turn : float, [rad]
        By how much the heading leaps.
    is_doubt : bool
        Whether a robot may have driven so all the same.

    """

    kind: BreakKind
    index: int
    at: float
    seconds: float
    before: tuple[float, float]
    after: tuple[float, float]
    reach: float = math.inf
    turn: float = 0.0
    is_doubt: bool = False

    @property
    def doubt(self) -> str:
        """Say what is odd about a drive that is learnt all the same."""
        if self.kind is BreakKind.TURNED:
            return (f'{self}: if the robot did not turn back there, its odometry was reset or '
                    f'corrected, and what follows lies turned: show it again')
        against = f'the speeds that came with the poses say {self.reach:.2f} m'
        if self.kind is BreakKind.HASTE:
            against = f'it drives {self.reach:.2f} m at most elsewhere in that time'
        elif self.reach == math.inf:
            against = 'it looks another way'
        return (f'from {self.at - self.seconds:.2f} to {self.at:.2f} s it drives '
                f'{self.distance:.2f} m, from {place_text(self.before)} to '
                f'{place_text(self.after)}, where {against}: if the robot did not drive so, its '
                f'localisation corrected itself and the way before lies as far off: show it '
                f'again')

    @property
    def distance(self) -> float:
        """Return how far apart the places are, [m]."""
        return math.dist(self.before, self.after)

    def __str__(self) -> str:
        """Say what is wrong, when and where."""
        way = f'from {place_text(self.before)} to {place_text(self.after)}'
        at, far = f'{self.at:.2f} s', f'{self.distance:.2f} m'
        match self.kind:
            case BreakKind.HOLE:
                return (f'no pose has come between {self.at - self.seconds:.2f} and {at}, and '
                        f'nothing says which way the robot took meanwhile, {far} {way}')
            case BreakKind.FAST:
                return (f'from {self.at - self.seconds:.2f} to {at} it drives {far}, {way}, where '
                        f'the robot gets {self.reach:.2f} m at most')
            case BreakKind.UNSAID:
                said = ('it looks another way' if self.reach == math.inf else
                        f'the speeds that come with the poses say {self.reach:.2f} m')
                return (f'at {at} the pose leaps by {far} in {self.seconds:.2f} s, {way}, where '
                        f'{said}')
            case BreakKind.TURNED:
                return (f'at {at} the heading leaps by {math.degrees(abs(self.turn)):.0f} degrees '
                        f'in {self.seconds:.2f} s, at {place_text(self.after)}')
            case BreakKind.BACK:
                return f'at {at} the stamps go back by {-self.seconds:.2f} s, {way}'
            case BreakKind.STANDING:
                return f'at {at} the stamps stand still while the robot drives {far}, {way}'
            case BreakKind.SOURCES:
                return (f'two sources speak in turns, their poses are {far} apart: at {at} it '
                        f'goes {way} and back again')
        return (f'at {at} the pose leaps by {far} in {self.seconds:.2f} s, {way}, where the robot '
                f'gets {self.reach:.2f} m at most')


def break_between(
    kind: BreakKind, before: int, after: int, stamps: npt.NDArray[np.float64],
    xy: npt.NDArray[np.float64], reach: float = math.inf,
) -> Break:
    """Return a break between two poses, given by their indices."""
    (x, y), (next_x, next_y) = xy[before].tolist(), xy[after].tolist()
    return Break(kind, after, float(stamps[after] - stamps.min()),
                 float(stamps[after] - stamps[before]), (x, y), (next_x, next_y), reach)


#: What is likely behind it, and what to do.
_REMEDIES: Final = {
    BreakKind.LEAP: 'Odometry was reset, the robot was carried, or its localisation found it '
                    'somewhere else: show the way again in one go',
    BreakKind.FAST: 'If the robot is that fast, say so with --max-speed (speed_max of '
                    'learner_node); else its stamps are not in seconds',
    BreakKind.UNSAID: 'Odometry was reset, the robot was carried, or its localisation found it '
                      'somewhere else: show the way again in one go',
    BreakKind.TURNED: 'Odometry was reset, or its localisation found the robot turned: show the '
                      'way again in one go',
    BreakKind.HOLE: 'Messages or a part of the recording are lost: show the way again',
    BreakKind.BACK: 'A clock was set or the simulation began anew: show the way again',
    BreakKind.STANDING: 'Who publishes the poses has to stamp each with the time it is of',
    BreakKind.SOURCES: 'Let one node alone publish the poses; keep another robot apart with '
                       'ROS_DOMAIN_ID or a namespace'}


class ImplausibleDriveError(ValueError):
    """
    No robot can have driven so; the message says what is wrong, when, where, and what to do.

    Parameters
    ----------
    breaks : sequence of Break
        In order of time; at least one.

    """

    def __init__(self, breaks: Iterable[Break]) -> None:
        """Put it into words."""
        self.breaks = tuple(breaks)
        first, more = self.breaks[0], len(self.breaks) - 1
        others = f' (and {counted(more, "more such place")})' if more else ''
        super().__init__(f'this is not one drive of one robot: {first}{others}. '
                         f'{_REMEDIES[first.kind]}')


def place_text(place: tuple[float, float]) -> str:
    """Return a place as people read it."""
    return f'({place[0]:.2f}, {place[1]:.2f})'
