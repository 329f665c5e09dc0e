"""
What a person sees of work under way: one table, one line of progress.

Both are plain text wherever the output is no terminal, so that it can be read on by a program.
"""

from collections.abc import Sequence
import time
from types import TracebackType
from typing import Final, TextIO

from tqdm import tqdm

from msgs_bridge.untrusted.text import own_stream, printable

#: The line is drawn at most so often, [s].
_PERIOD: Final = 0.1


def table_lines(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> list[str]:
    """Return rows of texts in columns; those in ``right`` stand flush right."""
    rows = [[printable(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ['  '.join(cell.rjust(width) if i in right else cell.ljust(width)
                      for i, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
            for row in rows]


class _Line(tqdm):  # type: ignore[misc, unused-ignore]
    """A line that changes; no thread looks after it, for processes are started beside it."""

    monitor_interval = 0


class Progress:
    """
    Shows what is going on; a context that leaves the terminal with a fresh line.

    Parameters
    ----------
    title : str
        Stands before every line.
    stream : text file
        A line that changes is shown on a terminal only.

    """

    def __init__(self, title: str, stream: TextIO) -> None:
        self._title, self._stream = title, stream
        #: Whether a line can change.
        self.is_live = stream.isatty()
        self._bar = _Line(bar_format='{desc}', file=own_stream(stream), leave=False,
                          dynamic_ncols=True, disable=not self.is_live)
        self._last = 0.0

    def __enter__(self) -> 'Progress':
        """Return the progress."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Wipe the live line."""
        self._bar.close()

    def show(self, text: str) -> None:
        """Show a line until the next one comes."""
        now = time.monotonic()
        if now - self._last >= _PERIOD:
            self._last = now
            self._bar.set_description_str(printable(f'{self._title}: {text}'))

    def keep(self, text: str) -> None:
        """Show a line that stays."""
        self._bar.set_description_str('', refresh=False)
        tqdm.write(f'{self._title}: {text}', file=self._stream)
        self._stream.flush()
