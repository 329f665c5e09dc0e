"""What a node says when it misses something: now and then, and once when it is back."""

from collections.abc import Callable, Hashable
import time
from typing import Any, Final

from rclpy.node import Node

from msgs_bridge.node.kinds_of_text import kind_of

#: Between two times of saying the same, [s].
PERIOD: Final = 10.0
#: Of one source so many kinds are told apart; what comes on top of them is of one more.
KINDS: Final = 16


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
        self._refused_at: dict[tuple[Hashable, str], float] = {}
        self._is_missed = False
        #: How many messages were refused.
        self.n_refused = 0

    def refused(self, error: Exception, source: Hashable = None) -> None:
        """
        Say what was wrong with a message, each kind of it once a period.

        Parameters
        ----------
        error : Exception
            Texts that differ only in numbers and in what they quote are of one kind.
        source : hashable
            Where the message came from: one source must not hide what comes from another.

        """
        now = self._clock()
        self.n_refused += 1
        self._refused_at = {key: at for key, at in self._refused_at.items() if now - at < PERIOD}
        key = (source, kind_of(str(error)))
        if key not in self._refused_at and sum(
                known == source for known, _ in self._refused_at) >= KINDS:
            key = (source, '')
        if key not in self._refused_at:
            self._refused_at[key] = now
            self._logger.warning(f'refused: {error}')

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
