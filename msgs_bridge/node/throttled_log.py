"""
Logging without flooding: once per template, once per period, or so many lines a second.

A template is what log lines have in common that differ only in numbers and quoted text.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
import re
import time
from typing import Any, Final

from rclpy.node import Node

_LENGTH: Final = 200
#: What differs between lines of one template: quoted text and numbers.
_VARYING: Final = re.compile(
    r"""'[^']*'|"[^"]*"|[-+]?(?:\d[\d.]*(?:e[-+]?\d+)?|\b(?:nan|inf)\b)""")

#: Time between two lines of one template, [s], see `ThrottledLog`.
PERIOD: Final = 10.0
#: Templates told apart for each source; any further ones share one more.
TEMPLATES: Final = 16

#: Lines of one template let through at once, and the time after which another may follow, [s],
#: see `LogRateLimiter`.
BURST: Final = 60
_LINE_PERIOD: Final = 1.0
#: Characters of all templates let through at once, and then per second.
_MAX_CHARACTERS: Final = 200_000
_CHARACTERS_PER_SECOND: Final = 2_000.0
#: Templates a rate limiter tells apart.
MAX_TEMPLATES: Final = 256


def template_of(text: str) -> str:
    """Return a line without what varies: numbers and quoted text."""
    return _VARYING.sub('', text[:10 * _LENGTH])[:_LENGTH]


class OncePerTemplate:
    """
    Remembers which lines were logged.

    Parameters
    ----------
    limit : int
        Number of templates told apart; anybody who sends new ones forever is logged that often.
    template : callable
        Returns what lines that count as equal have in common.

    """

    def __init__(self, limit: int = 64, template: Callable[[str], str] = template_of) -> None:
        """Start with an empty memory."""
        self._limit = limit
        self._template_of = template
        self._templates: set[str] = set()

    def add(self, text: str) -> bool:
        """Remember a line; return True if it is the first of its template."""
        template = self._template_of(text)
        if template in self._templates or len(self._templates) >= self._limit:
            return False
        self._templates.add(template)
        return True


class ThrottledLog:
    """
    Logs refused messages and missing inputs, each at most once per `PERIOD`.

    Parameters
    ----------
    node : Node
        Whose logger is used.
    clock : callable
        Returns a monotonic time, [s].

    """

    def __init__(self, node: Node, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with nothing logged."""
        self._logger: Any = node.get_logger()  # type: ignore[no-untyped-call]
        self._clock = clock
        self._logged_at: dict[Hashable, float] = {}
        self._refused_at: dict[tuple[Hashable, str], float] = {}
        self._is_missing = False
        #: Number of refused messages.
        self.n_refused = 0

    def log_refused(self, error: Exception, source: Hashable = None) -> None:
        """
        Log what was wrong with a message, each template of each source once per period.

        Parameters
        ----------
        error : Exception
        source : hashable
            Where the message came from: a flood from one source must not hide another.

        """
        now = self._clock()
        self.n_refused += 1
        self._refused_at = {key: at for key, at in self._refused_at.items() if now - at < PERIOD}
        key = (source, template_of(str(error)))
        if key not in self._refused_at and sum(
                known == source for known, _ in self._refused_at) >= TEMPLATES:
            key = (source, '')
        if key not in self._refused_at:
            self._refused_at[key] = now
            self._logger.warning(f'refused: {error}')

    def log_missing(self, problem: str, recovered: str, kind: Hashable = None) -> None:
        """
        Log what is missing, and once that nothing is missing any more.

        Parameters
        ----------
        problem : str
            What is missing; empty if nothing is.
        recovered : str
            The line for when nothing is missing any more.
        kind : hashable
            Kind of the problem; each kind has a period of its own, so that none hides another.

        """
        now = self._clock()
        if problem and now - self._logged_at.get(kind, now - PERIOD) >= PERIOD:
            self._logged_at[kind], self._is_missing = now, True
            self._logger.warning(problem)
        elif self._is_missing and not problem:
            self._is_missing = False
            self._logger.info(recovered)


@dataclass
class _Bucket:
    n_lines: float
    at: float
    n_suppressed: int = 0


class LogRateLimiter:
    """
    Limits lines of each template, and characters of all, to what a person can read.

    Parameters
    ----------
    clock : callable
        Returns a monotonic time, [s].

    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with full buckets."""
        self._clock = clock
        self._buckets: OrderedDict[str, _Bucket] = OrderedDict()
        self._n_characters, self._at = float(_MAX_CHARACTERS), clock()

    def limit(self, text: str, is_severe: bool = False) -> str:
        """
        Return the line to log; empty if it is to be suppressed.

        Parameters
        ----------
        text : str
        is_severe : bool
            Whether to let it through however many characters others have logged.

        """
        now = self._clock()
        bucket = self._bucket(template_of(text), now)
        self._n_characters = min(
            _MAX_CHARACTERS, self._n_characters + _CHARACTERS_PER_SECOND * (now - self._at))
        self._at = now
        bucket.n_lines = min(BURST, bucket.n_lines + (now - bucket.at) / _LINE_PERIOD)
        bucket.at = now
        if bucket.n_lines < 1.0 or (self._n_characters < len(text) and not is_severe):
            bucket.n_suppressed += 1
            return ''
        bucket.n_lines -= 1.0
        self._n_characters -= len(text)
        n, bucket.n_suppressed = bucket.n_suppressed, 0
        return f'{text} ({n} more like it were not said)' if n else text

    def _bucket(self, template: str, now: float) -> _Bucket:
        bucket = self._buckets.setdefault(template, _Bucket(BURST, now))
        self._buckets.move_to_end(template)
        if len(self._buckets) > MAX_TEMPLATES:
            self._buckets.popitem(last=False)
        return bucket
