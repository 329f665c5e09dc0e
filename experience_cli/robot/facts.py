"""What is known of a robot, and who says so."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Fact(NamedTuple):
    """A value, and where it came from."""

    value: Any
    source: str


@dataclass
class Facts:
    """
    All that files say of a robot; each value may be said several times.

    Parameters
    ----------
    said : dict of str to list of Fact
        By what it is about, in the order in which it was found.
    notes : list of str
        What a person should know beside the values.

    """

    said: dict[str, list[Fact]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add(self, name: str, value: Any, source: str) -> None:
        """Note what somebody says; None says nothing."""
        if value is not None:
            self.said.setdefault(name, []).append(Fact(value, source))

    def add_positive(self, name: str, value: Any, source: str) -> None:
        """Note the size of a number, if it is one and not 0 (which often means: no limit)."""
        if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < abs(
                value) < 1e6:
            self.add(name, abs(float(value)), source)

    def first(self, name: str) -> Fact | None:
        """Return what was said first."""
        return next(iter(self.said.get(name, ())), None)

    def least(self, name: str) -> Fact | None:
        """Return the least of what was said, with who says more in its source."""
        facts = self.said.get(name)
        if not facts:
            return None
        least = min(facts, key=lambda fact: float(fact.value))
        more = [f'{fact.value:g} by {fact.source}' for fact in facts if fact.value > least.value]
        return Fact(least.value, least.source + (
            f'; more is said: {", ".join(more[:3])}' if more else ''))
