"""Whether this process itself stood still, and for how long. Time is an argument."""

import math
from typing import Final

#: Time between two looks at the clock from which on this process stood still, [s].
SUSPENDED: Final = 1.0


class Suspension:
    """
    Whether this process itself was suspended: by SIGSTOP, a closed lid, a machine that swaps.

    Nobody was silent meanwhile, however long ago it seems that something was heard.

    Parameters
    ----------
    shortest : float, [s]
        Time between two looks at the clock from which on it was.

    """

    def __init__(self, shortest: float = SUSPENDED) -> None:
        """Start before the first look at the clock."""
        self._shortest = shortest
        self._last_look = self._ended = -math.inf
        self.duration = 0.0  #: of the last one, [s]

    def look(self, now: float) -> float:
        """Note the time; return how long the process was suspended just now, [s], usually 0."""
        gap, self._last_look = now - self._last_look, now
        if not self._shortest < gap < math.inf:
            return 0.0
        self.duration, self._ended = gap, now
        return gap

    def age(self, now: float) -> float:
        """Return how long ago the last one ended, [s]."""
        return now - self._ended

    def duration_since(self, time: float) -> float:
        """Return how much of the last one was after a time, [s]; 0 if hardly any of it was."""
        after = self._ended - max(time, self._ended - self.duration)
        return after if after > self._shortest else 0.0
