"""Words for people."""

from collections.abc import Iterable, Mapping
from typing import Final

#: How a trial ended, by its outcome.
_ENDINGS: Final[Mapping[str, str]] = {
    'goal': 'reached the goal in', 'collision': 'ran into something after',
    'gave_up': 'gave up after', 'stopped': 'was stopped after',
    'aborted': 'was broken off after'}


def counted(n: int, noun: str) -> str:
    """
    Return a count with its noun.

    Parameters
    ----------
    n : int
    noun : str
        In the singular; its plural takes an s.

    Returns
    -------
    str
        Such as ``1 cell`` or ``2 cells``.

    """
    return f'{n} {noun}' if n == 1 else f'{n} {noun}s'


def how_it_ended(outcome: str, n_steps: int) -> str:
    """
    Return how a trial ended, to be put after its name.

    Parameters
    ----------
    outcome : str
        `Outcome`.
    n_steps : int

    Returns
    -------
    str
        Such as ``reached the goal in 18 steps``.

    """
    return f'{_ENDINGS[outcome]} {counted(n_steps, "step")}'


def sentences(parts: Iterable[str]) -> str:
    """Return what is said one after the other, each with a full stop, without what is empty."""
    return ' '.join(f'{part.rstrip(".")}.' for part in parts if part)
