"""Which texts say the same, but for what stands in a message: so that nothing is said for ever."""

from collections.abc import Callable
import re
from typing import Final

_LENGTH: Final = 200
#: What of a text is the message's own: what is quoted from it, and numbers.
_VARYING: Final = re.compile(
    r"""'[^']*'|"[^"]*"|[-+]?(?:\d[\d.]*(?:e[-+]?\d+)?|\b(?:nan|inf)\b)""")


def kind_of(text: str) -> str:
    """Return what is the same of all texts that differ only in numbers and in what they quote."""
    return _VARYING.sub('', text[:10 * _LENGTH])[:_LENGTH]


class SaidOnce:
    """
    Remembers the kinds of what was said.

    Parameters
    ----------
    limit : int
        How many kinds are told apart; whoever sends ever new ones is heard that often.
    kind : callable
        Returns what is the same of two texts of one kind.

    """

    def __init__(self, limit: int = 64, kind: Callable[[str], str] = kind_of) -> None:
        """Start with nothing said."""
        self._limit = limit
        self._kind_of = kind
        self._kinds: set[str] = set()

    def is_new(self, text: str) -> bool:
        """Tell whether nothing of this kind was said before, and note that it is now."""
        kind = self._kind_of(text)
        if kind in self._kinds or len(self._kinds) >= self._limit:
            return False
        self._kinds.add(kind)
        return True
