"""How punctually the guard comes that looks after the robot every 20 ms. ROS-free."""

from collections import deque
import math
from typing import Final

#: Longest time that the guard may be held up before the robot stands until the next pose, [s].
MOST_HELD: Final = 0.2
#: Time in which the worst values count, [s].
_WINDOW: Final = 5.0


class WindowedMaximum:
    """The greatest of some times in the last seconds."""

    def __init__(self) -> None:
        """Start with none."""
        self._times: deque[tuple[float, float]] = deque()

    def add(self, now: float, seconds: float) -> None:
        """Add a time; while none is added, the window does not move."""
        times = self._times
        while times and times[-1][1] <= seconds:
            times.pop()
        times.append((now, seconds))
        while now - times[0][0] > _WINDOW:
            times.popleft()

    @property
    def seconds(self) -> float:
        """Return the greatest, [s]."""
        return self._times[0][1] if self._times else 0.0


class GuardTiming:
    """
    The time from one run of the guard to the next.

    Attributes
    ----------
    gap : float, [s]
        Between the last two runs.
    gaps : WindowedMaximum
        Of those while the robot was driven.
    works : WindowedMaximum
        Processor time of the guard's thread between two runs while the robot was driven: what
        other threads and processes do is not in it.

    """

    def __init__(self) -> None:
        """Start before the first run."""
        self.gap = 0.0
        self.gaps, self.works = WindowedMaximum(), WindowedMaximum()
        self._last, self._worked = math.inf, math.inf

    def on_guard(self, now: float, worked: float, is_driving: bool) -> None:
        """
        Take in that the guard runs.

        Parameters
        ----------
        now : float, [s]
        worked : float, [s]
            Processor time of its thread.
        is_driving : bool
            Whether the robot has been driven since the last run.

        """
        self.gap = max(now - self._last, 0.0)
        if is_driving:
            self.gaps.add(now, self.gap)
            self.works.add(now, max(worked - self._worked, 0.0))
        self._last, self._worked = now, worked

    @property
    def was_held_up(self) -> bool:
        """Return whether the guard came so late that the last command must not go on."""
        return self.gap > MOST_HELD
