"""A live line of progress on a terminal; plain lines anywhere else."""

import shutil
import time
from types import TracebackType
from typing import Final, TextIO

from msgs_bridge.untrusted.text import own_stream

#: The line is drawn at most so often, [s].
_PERIOD: Final = 0.1


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
        self._title = title
        self._stream, self._terminal = stream, own_stream(stream)
        #: Whether a line can change.
        self.is_live = stream.isatty()
        self._shown = ''
        self._last = 0.0

    def __enter__(self) -> 'Progress':
        """Return the progress."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Wipe the live line."""
        self._wipe()

    def show(self, text: str) -> None:
        """Show a line until the next one comes."""
        now = time.monotonic()
        if not self.is_live or text == self._shown or now - self._last < _PERIOD:
            return
        self._wipe()
        self._shown, self._last = text, now
        width = shutil.get_terminal_size().columns - 1
        self._stream.write(f'{self._title}: {text}'[:width])
        self._stream.flush()

    def keep(self, text: str) -> None:
        """Show a line that stays."""
        self._wipe()
        self._stream.write(f'{self._title}: {text}\n')
        self._stream.flush()

    def _wipe(self) -> None:
        if self._shown:
            self._terminal.write('\r\x1b[K')
            self._shown = ''
