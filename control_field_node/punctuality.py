"""Whether who guards the robot comes when it is time to look."""

from collections import deque
import math
from typing import Final

#: So long may it have been held up before the robot has to stand until the next pose, [s].
MOST_HELD: Final = 0.2
#: For so long the longest time is remembered, [s].
_REMEMBERED: Final = 5.0


class Longest:
    """The longest of several times, in the last seconds."""

    def __init__(self) -> None:
        """Start with none."""
        self._times: deque[tuple[float, float]] = deque()

    def add(self, now: float, seconds: float) -> None:
        """Take one in; times at which nothing is added do not pass."""
        times = self._times
        while times and times[-1][1] <= seconds:
            times.pop()
        times.append((now, seconds))
        while now - times[0][0] > _REMEMBERED:
            times.popleft()

    @property
    def seconds(self) -> float:
        """Return it, [s]."""
        return self._times[0][1] if self._times else 0.0


class Punctuality:
    """
    How long it takes from one look after the robot to the next. Time is an argument.

    Attributes
    ----------
    gap : float, [s]
        Between the last two looks.
    gaps : Longest
        Of those while the robot was driven.
    works : Longest
        How long the thread that looks worked on anything between two looks, while the robot was
        driven: what others do on the same machine is not in it.

    """

    def __init__(self) -> None:
        """Start before the first look."""
        self.gap = 0.0
        self.gaps, self.works = Longest(), Longest()
        self._last, self._worked = math.inf, math.inf

    def looks(self, now: float, worked: float, drives: bool) -> None:
        """
        Take in that who guards looks.

        Parameters
        ----------
        now : float, [s]
        worked : float, [s]
            Processor time of the thread that looks.
        drives : bool
            Whether the robot has been driven since the last look.

        """
        self.gap = max(now - self._last, 0.0)
        if drives:
            self.gaps.add(now, self.gap)
            self.works.add(now, max(worked - self._worked, 0.0))
        self._last, self._worked = now, worked

    @property
    def was_held_up(self) -> bool:
        """Tell whether nobody looked for so long that the last command must not go on."""
        return self.gap > MOST_HELD
