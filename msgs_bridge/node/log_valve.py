"""What keeps a log from being flooded by what arrives a thousand times a second."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
import time
from typing import Final

from msgs_bridge.node.kinds_of_text import kind_of

#: So many lines of one kind are let through in one go, and then one in so many seconds.
BURST: Final = 60
PERIOD: Final = 1.0
#: So many characters of all kinds in one go, and then so many a second.
MOST: Final = 200_000
RATE: Final = 2_000.0
#: So many kinds are told apart.
KINDS: Final = 256


@dataclass
class _Kind:
    lines: float
    at: float
    n_left_out: int = 0


class Valve:
    """
    Lets lines through, of each kind not more than a person can read.

    Parameters
    ----------
    clock : callable
        Returns a time that only grows, [s].

    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Start open."""
        self._clock = clock
        self._kinds: OrderedDict[str, _Kind] = OrderedDict()
        self._left, self._at = float(MOST), clock()

    def let(self, text: str, is_grave: bool = False) -> str:
        """
        Return a line to be said; empty if it is not to be.

        Parameters
        ----------
        text : str
            The line. Those that differ only in numbers and in what they quote are of one kind.
        is_grave : bool
            Whether it is to be said whatever others fill the log with.

        """
        now = self._clock()
        kind = self._kind(kind_of(text), now)
        self._left = min(MOST, self._left + RATE * (now - self._at))
        self._at = now
        kind.lines = min(BURST, kind.lines + (now - kind.at) / PERIOD)
        kind.at = now
        if kind.lines < 1.0 or (self._left < len(text) and not is_grave):
            kind.n_left_out += 1
            return ''
        kind.lines -= 1.0
        self._left -= len(text)
        n, kind.n_left_out = kind.n_left_out, 0
        return f'{text} ({n} more like it were not said)' if n else text

    def _kind(self, name: str, now: float) -> _Kind:
        kind = self._kinds.setdefault(name, _Kind(BURST, now))
        self._kinds.move_to_end(name)
        if len(self._kinds) > KINDS:
            self._kinds.popitem(last=False)
        return kind
