"""How long the robot waits for what is in its way."""

from collections.abc import Hashable
from typing import Final

#: Stamps that are farther apart are no time that was waited, [s]: somebody set a clock.
LONGEST_GAP: Final = 1.0


class SteadyTime:
    """Time that passes by stamps, whatever somebody does to the clock that they come from."""

    def __init__(self) -> None:
        """Start at 0."""
        self._now = self._last = 0.0

    def at(self, stamp: float) -> float:
        """Return how much time has passed at a stamp, [s], as far as one was told."""
        self._now += min(max(stamp - self._last, 0.0), LONGEST_GAP)
        self._last = stamp
        return self._now


class Patience:
    """
    Counts by stamps how long one thing has been waited for.

    Parameters
    ----------
    seconds : float, [s]
        How long is waited; 0: never.

    """

    def __init__(self, seconds: float) -> None:
        """Start with nothing to wait for."""
        self._seconds = seconds
        self._what: Hashable = None
        self._time, self._since = SteadyTime(), 0.0

    def lasts(self, stamp: float, what: Hashable) -> bool:
        """
        Return whether something is waited for any longer.

        Parameters
        ----------
        stamp : float, [s]
        what : hashable
            What is waited for; None: nothing is, and the next thing is waited for from anew.

        """
        now = self._time.at(stamp)
        if what != self._what:
            self._what, self._since = what, now
        return what is not None and now - self._since < self._seconds - 1e-9
