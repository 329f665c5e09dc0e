"""What was pasted into the terminal, and not typed: it is no wish of anybody's."""

from collections.abc import Sequence
from itertools import pairwise
import math
from typing import Final

from teleop_node.keys import PASTE_BEGINS, PASTE_ENDS

#: More other keys than these at once, or more of any, were not typed: fingers and the repeats of a
#: held key do not come to that, even where this process was held up for a while.
_MOST_OTHERS: Final = 8
_MOST: Final = 1000
#: A paste is over when nothing has come so fast for so long; one whose end is marked and does not
#: come, when nothing has come at all, [s].
_QUIET: Final = 0.3
_LONGEST_GAP: Final = 2.0

#: What a person is told.
PASTED: Final = 'what was pasted is ignored, and the robot is stopped: keys are typed one by one'


class PasteFilter:
    """Leaves out what was pasted: marked by the terminal, or faster than anybody types."""

    def __init__(self) -> None:
        """Start with nothing pasted."""
        self._is_marked = self._is_burst = False
        self._at = -math.inf

    def filter(self, keys: Sequence[str], now: float) -> tuple[list[str], bool]:
        """
        Leave out of keys what was pasted.

        Parameters
        ----------
        keys : sequence of str
            That have come together.
        now : float, [s]
            On a steady clock.

        Returns
        -------
        typed : list of str
            Those that were typed.
        begins : bool
            Whether a paste begins with them.

        """
        if not keys:
            return [], False
        self._expire(now)
        was_pasting = self._is_burst or self._is_marked
        outside = self._drop_marked(keys)
        is_too_fast = _comes_too_fast(outside)
        is_marked = self._is_marked or len(outside) < len(keys)
        self._is_burst |= is_too_fast
        if is_too_fast or is_marked:
            self._at = now
        begins = (is_too_fast or is_marked) and not was_pasting
        return [] if self._is_burst else outside, begins

    def _expire(self, now: float) -> None:
        """Forget a paste that has ended."""
        quiet = now - self._at
        self._is_burst &= quiet < _QUIET
        self._is_marked &= quiet < _LONGEST_GAP

    def _drop_marked(self, keys: Sequence[str]) -> list[str]:
        """Return the keys outside the marks of the terminal, and note which mark came last."""
        outside = []
        for key in keys:
            if key in (PASTE_BEGINS, PASTE_ENDS):
                self._is_marked = key == PASTE_BEGINS
            elif not self._is_marked:
                outside.append(key)
        return outside


def _comes_too_fast(keys: Sequence[str]) -> bool:
    others = sum(before != key for before, key in pairwise(keys))
    return len(keys) > _MOST or others > _MOST_OTHERS
