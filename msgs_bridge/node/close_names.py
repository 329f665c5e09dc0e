"""Which known name one that is unknown may have been meant for."""

from collections.abc import Iterable
import re
from typing import Final

#: From how many letters on a name may be off by one, and by two: short names differ by little.
_LETTERS: Final = (5, 12)


def close_name(
    name: str, others: Iterable[str], letters: tuple[int, int] = _LETTERS,
) -> str | None:
    """
    Return the name of others that may have been meant; None if there is none.

    Names that differ in their numbers (``task1``, ``task2``) or in a letter that stands alone
    (``door_a``, ``door_b``) are different on purpose; ``letters`` says from how many on one slip
    is likely, and two.
    """
    ours, numbers = _parts(name)
    for other in sorted(others):
        theirs, their_numbers = _parts(other)
        if other == name or numbers != their_numbers:
            continue
        longest = max(len(ours), len(theirs))
        allowed = sum(longest >= least for least in letters)
        if ours and theirs and distance(ours, theirs) <= allowed:
            return other
    return None


def _parts(name: str) -> tuple[str, list[str]]:
    """Return the letters of a name, in small ones, and what counts: numbers, lone letters."""
    words = [word for word in re.split(r'[_-]+|(\d+)', name.lower()) if word]
    counts = [word.lstrip('0') if word.isdecimal() else word
              for word in words if word.isdecimal() or len(word) == 1]
    return ''.join(word for word in words if not word.isdecimal() and len(word) > 1), counts


def distance(first: str, second: str) -> int:
    """Count the slips that make one of the other: a letter too much, missing, wrong, swapped."""
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, letter in enumerate(first, start=1):
        last, before, row = before, row, [i]
        for j, other in enumerate(second, start=1):
            row.append(min(before[j] + 1, row[-1] + 1, before[j - 1] + (letter != other)))
            if i > 1 and j > 1 and letter == second[j - 2] and first[i - 2] == other:
                row[j] = min(row[j], last[j - 2] + 1)
    return row[-1]
