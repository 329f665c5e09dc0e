"""How long the robot waits for what is in its way."""

from collections.abc import Hashable
from typing import Final

#: Stamps that are farther apart are no time that was waited, [s]: somebody set a clock.
LONGEST_GAP: Final = 1.0


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
        self.seconds = seconds
        self._what: Hashable = None
        self._waited = self._last = 0.0

    def lasts(self, stamp: float, what: Hashable) -> bool:
        """
        Return whether something is waited for any longer.

        Parameters
        ----------
        stamp : float, [s]
        what : hashable
            What is waited for; None: nothing is, and the next thing is waited for from anew.

        """
        if what != self._what:
            self._what, self._waited = what, 0.0
        else:
            self._waited += min(max(stamp - self._last, 0.0), LONGEST_GAP)
        self._last = stamp
        return what is not None and self._waited < self.seconds - 1e-9
