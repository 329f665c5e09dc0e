"""
Who drives and what is driven, from what came over which link and when.

A link is a connection of somebody who may drive. Commands are shares of the speeds, (forward,
turning) from -1 to 1, and hold for a short while only: whoever wants to go on says so again.
Times are those of a steady clock, in seconds; nothing here knows sockets, threads or ROS.
"""

from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Final

Share = tuple[float, float]

#: How long a command holds, [s]. The page repeats it every 50 ms: one may be lost, and two late;
#: what is between here and the wheels fits into the quarter of a second that silence may last.
HOLD_TIME: Final = 0.15
#: Oldest command that is obeyed, [s].
MOST_AGE: Final = 0.2
#: How long the driver stays the driver after letting go, [s].
RESERVED: Final = 0.5
#: How long the standstill is told after driving, [s]: the controller brakes, within the limits of
#: acceleration, for as long as it is told.
LINGER: Final = 0.4
#: How far the browser's clock may run ahead of ours, [s/s].
DRIFT: Final = 1e-3
#: Two commands no further apart show, after a silence, that somebody is there again, [s]. A page
#: in the background comes once a second.
RHYTHM: Final = 0.45
#: A link that was silent for so long when a stop is over holds nothing any more, [s].
FORGOTTEN: Final = 1.0

STANDING: Final[Share] = (0.0, 0.0)


class Verdict(StrEnum):
    """What became of a command."""

    OBEYED = 'obeyed'
    OTHER = 'other'  #: somebody else drives
    STALE = 'stale'  #: too old
    HELD_BACK = 'held_back'  #: after a stop or a silence: let go first


@dataclass
class _Link:
    """What is known of a link."""

    offset: float = math.inf  #: least time from the browser's clock to ours, [s]
    offset_at: float = 0.0
    moved: float = -math.inf  #: when it last asked for a movement
    must_release: bool = False
    has_lapsed: bool = False

    def age(self, sent: float, now: float) -> float:
        """Return how much older than the quickest command one is, [s]; clocks may drift."""
        least = self.offset + DRIFT * (now - self.offset_at)
        self.offset, self.offset_at = min(least, now - sent), now
        return now - sent - self.offset


class DeadMan:
    """Decides what is driven: one driver at a time, and standstill without fresh commands."""

    def __init__(self, hold_time: float = HOLD_TIME) -> None:
        """Start with nobody there."""
        self._hold_time = hold_time
        self._links: dict[int, _Link] = {}
        self._next = 0
        self._share = STANDING
        self._driver: int | None = None
        self._held_at: float | None = None  # when the movement under way was last asked for
        self._released = -math.inf

    def join(self) -> int:
        """Return the number of a new link."""
        self._next += 1
        self._links[self._next] = _Link()
        return self._next

    def leave(self, link: int, now: float) -> None:
        """Forget a link; what it drives stands."""
        self._links.pop(link, None)
        if link == self._driver:
            self._release(now)

    def command(self, link: int, sent: float, share: Share, now: float) -> Verdict:
        """
        Take in a command.

        Parameters
        ----------
        link : int
        sent : float, [s]
            By the browser's clock.
        share : tuple of float
            Of the speeds, -1 to 1 each.
        now : float, [s]

        """
        known = self._links[link]
        is_fresh = known.age(sent, now) <= MOST_AGE
        if share == STANDING:
            # Letting go is obeyed at any age.
            known.must_release = known.has_lapsed = False
            known.moved = -math.inf
            if link == self._driver:
                self._release(now)
            return Verdict.OBEYED
        if not is_fresh:
            return Verdict.STALE
        return self._move(link, known, share, now)

    def _move(self, link: int, known: _Link, share: Share, now: float) -> Verdict:
        self._lapse(now)
        silent, known.moved = now - known.moved, now
        if known.must_release and silent > FORGOTTEN:
            known.must_release, known.has_lapsed = False, True
        if known.must_release:
            return Verdict.HELD_BACK
        if self.driver(now) not in (None, link):
            return Verdict.OTHER
        if known.has_lapsed and silent > RHYTHM:
            return Verdict.HELD_BACK
        known.has_lapsed = False
        self._driver, self._share, self._held_at = link, share, now
        return Verdict.OBEYED

    def stop(self, now: float) -> None:
        """Stand; whoever asks for a movement now has to let go before the next one."""
        for known in self._links.values():
            known.must_release |= now - known.moved < FORGOTTEN
        self._held_at, self._released = None, now

    def _release(self, now: float) -> None:
        if self._held_at is not None:
            self._held_at, self._released = None, now

    def _lapse(self, now: float) -> None:
        """Stand if nothing has come for too long."""
        if self._held_at is None or now - self._held_at < self._hold_time:
            return
        if self._driver in self._links:
            self._links[self._driver].has_lapsed = True
        self._release(now)

    def share(self, now: float) -> Share | None:
        """
        Return what is to be driven; None where there is nothing to say.

        Silence lets others drive: during a trial the robot then follows its field again.
        """
        self._lapse(now)
        if self._held_at is not None:
            return self._share
        return STANDING if now - self._released < LINGER else None

    def driver(self, now: float) -> int | None:
        """Return the link that drives, or may go on before anybody else does."""
        if self._held_at is None and now - self._released >= RESERVED:
            self._driver = None
        return self._driver
