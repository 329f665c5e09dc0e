r"""
Text from elsewhere on its way to a terminal or a log: the one door.

Names of topics, frames, files and nodes, and whatever else stands in messages and bags, may hold
codes that colour, move, wipe or type on a terminal, turn the direction of writing, or begin a line
that looks like one of ours. All of them are shown instead of sent: ``\x1b[2J``.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import re
import sys
from typing import Any, Final
import unicodedata

#: Longest text that is shown whole, [characters].
MOST: Final = 2000
#: All but letters, marks, digits, punctuation, symbols and blanks. Private and unassigned
#: characters move nothing, and which ones are assigned differs from one Python to the next.
_SHOWN: Final = ('Cc', 'Cf', 'Cs', 'Zl', 'Zp')
_CUT: Final = '...'
_LAYOUT: Final = re.compile(r'([\n\t])')


def printable(text: object, limit: int = MOST) -> str:
    r"""
    Return text on one line, with every code that a terminal would obey as an escape.

    Parameters
    ----------
    text : str, or anything that can be one
    limit : int, [characters]
        What is longer is cut, and ends in ``...``.

    Returns
    -------
    str
        The text itself if there is nothing in it.

    Examples
    --------
    >>> printable('odom\x1b[2J\n')
    'odom\\x1b[2J\\n'

    """
    text = str(text)
    if len(text) > limit:
        text = text[:max(limit - len(_CUT), 0)] + _CUT[:limit]
    # Fast, and true of most text; it is also false of blanks other than ' ', which may stay.
    return text if text.isprintable() else ''.join(map(_shown, text))


def printable_lines(text: str) -> str:
    """Return text that keeps its line ends and tabs, and is otherwise as `printable` makes it."""
    if text.isprintable():
        return text
    return ''.join(part if part in '\n\t' else printable(part, len(part))
                   for part in _LAYOUT.split(text))


def _shown(character: str) -> str:
    if unicodedata.category(character) not in _SHOWN:
        return character
    return character.encode('unicode_escape').decode()


class SafeStream:
    """
    A text file for output whose every code is shown, but for line ends and tabs.

    Parameters
    ----------
    stream : text file
        What it writes to; for codes of our own, see `own_stream`.

    """

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write text."""
        self.stream.write(printable_lines(text))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write texts."""
        for line in lines:
            self.write(line)

    def __eq__(self, other: object) -> bool:
        """Return True if it writes to the same stream; tqdm compares its own with others."""
        return bool(self.stream == own_stream(other))

    def __hash__(self) -> int:
        """Return that of the file."""
        return hash(self.stream)

    def __getattr__(self, name: str) -> Any:
        """Do all else as the file does."""
        return getattr(self.stream, name)


def own_stream(stream: Any) -> Any:
    """Return a stream for our own codes (a line that changes), which show foreign text safely."""
    return stream.stream if isinstance(stream, SafeStream) else stream


@contextmanager
def safe_output() -> Iterator[None]:
    """Let everything this process prints meanwhile come through a `SafeStream`."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if stream is None or isinstance(stream, SafeStream) else SafeStream(stream)
        for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
