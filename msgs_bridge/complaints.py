"""What a node says when it misses something: now and then, and once when it is back."""

from collections.abc import Callable, Hashable
import time
from typing import Any, Final

from rclpy.node import Node

#: Between two times of saying the same, [s].
PERIOD: Final = 10.0


class Complaints:
    """
    Says what is refused and what is missing, not all the time.

    Parameters
    ----------
    node : Node
        In whose name.
    clock : callable
        Returns a time that only grows, [s].

    """

    def __init__(self, node: Node, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with nothing said."""
        self._logger: Any = node.get_logger()  # type: ignore[no-untyped-call]
        self._clock = clock
        self._said_at: dict[Hashable, float] = {}
        self._is_missed = False

    def refused(self, error: ValueError) -> None:
        """Say what was wrong with a message."""
        self._logger.warning(f'refused: {error}', throttle_duration_sec=PERIOD)

    def look(self, problem: str, back: str, kind: Hashable = None) -> None:
        """
        Say what is missing, or that it is back, which is only said after it was missed.

        Parameters
        ----------
        problem : str
            What is missing, empty if nothing is.
        back : str
            What is said when nothing is any more.
        kind : hashable
            Of the problem: one must not hide another, so that each has a time of its own.

        """
        now = self._clock()
        if problem and now - self._said_at.get(kind, now - PERIOD) >= PERIOD:
            self._said_at[kind], self._is_missed = now, True
            self._logger.warning(problem)
        elif self._is_missed and not problem:
            self._is_missed = False
            self._logger.info(back)
