"""A terminal that hands over every key at once, and is left as it was found."""

from contextlib import suppress
import os
import select
import termios
from typing import Any, Final, Self

#: Columns where a terminal does not tell.
_USUAL_WIDTH: Final = 80
_MOST: Final = 4096
#: Asks a terminal to mark what is pasted, as shells do, and not to any more.
_MARK_PASTES: Final = '\x1b[?2004h'
_MARK_NO_PASTES: Final = '\x1b[?2004l'


class Terminal:
    """
    A terminal, entered and left as a context.

    Signals of the keyboard (Ctrl-C, Ctrl-Z, Ctrl-backslash) keep working; Ctrl-S does not stop
    the output, because whoever waits for it could not stop the robot.

    Parameters
    ----------
    source, target : int
        File descriptors that keys are read from and text is written to.

    """

    def __init__(self, source: int, target: int) -> None:
        """Touch nothing yet."""
        self.source = source
        self.target = target
        self._before: list[Any] | None = None

    @property
    def is_entered(self) -> bool:
        """Whether it hands over keys."""
        return self._before is not None

    def enter(self) -> bool:
        """Set it to hand over keys, unless in the background; return True if it does."""
        if self.is_entered or not self.is_foreground:
            return self.is_entered
        self._before = termios.tcgetattr(self.source)
        mode = termios.tcgetattr(self.source)
        mode[0] &= ~(termios.IXON | termios.IXOFF)
        mode[3] &= ~(termios.ICANON | termios.ECHO | termios.IEXTEN)
        mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
        termios.tcsetattr(self.source, termios.TCSANOW, mode)
        self.write(_MARK_PASTES)
        return True

    def leave(self) -> None:
        """Set it back to what it was; keys that nobody read are dropped."""
        if self.is_entered:
            self.write(_MARK_NO_PASTES)
        before, self._before = self._before, None
        if before is not None:
            with suppress(OSError, termios.error):  # it may be gone
                termios.tcflush(self.source, termios.TCIFLUSH)
                termios.tcsetattr(self.source, termios.TCSANOW, before)

    def __enter__(self) -> Self:
        """Enter."""
        self.enter()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave, whatever has happened."""
        self.leave()

    @property
    def is_foreground(self) -> bool:
        """Whether this process may touch it (after Ctrl-Z and `bg` it may not)."""
        try:
            return os.tcgetpgrp(self.source) == os.getpgrp()
        except OSError:  # it is not the controlling terminal: nobody's job control
            return True

    def read(self) -> bytes | None:
        """Return what was typed, without waiting; None when the terminal is gone."""
        if not self.is_entered and not self.enter():
            return b''
        if not self.is_foreground:
            self._before = None  # who put this process into the background has set it anew
            return b''
        try:
            ready, _, _ = select.select([self.source], [], [], 0.0)
            return (os.read(self.source, _MOST) or None) if ready else b''
        except OSError:
            return None

    def write(self, text: str) -> None:
        """Write text, unless that would have to wait or nobody is there to read it."""
        with suppress(OSError):
            _, ready, _ = select.select([], [self.target], [], 0.0)
            if ready and (self.is_entered or self.is_foreground):
                os.write(self.target, text.encode(errors='replace'))

    @property
    def width(self) -> int:
        """Return its columns."""
        try:
            return os.get_terminal_size(self.target).columns or _USUAL_WIDTH
        except OSError:
            return _USUAL_WIDTH


def descriptor(stream: Any) -> int:
    """Return the descriptor of a standard stream; -1 where it is closed."""
    try:
        return int(stream.fileno())
    except (AttributeError, OSError, ValueError):
        return -1
