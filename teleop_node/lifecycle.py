"""Signals: what ends the program, and what pauses it (Ctrl-Z) until it is called back."""

from collections.abc import Callable
import os
import signal
import time
from types import FrameType, TracebackType
from typing import Any, Final, Protocol, Self

from msgs_bridge.node.run import signal_came

#: The terminal went away, or somebody wants an end.
_ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)

#: Time within which further signals mean the same end, [s]: a closed window sends SIGHUP through
#: its shell, too, and `ros2 launch` repeats a Ctrl-C.
_ONCE: Final = 0.5


class Pausable(Protocol):
    """What is told of a pause."""

    def pause(self) -> None:
        """Stop the robot and give the terminal back."""

    def go_on(self) -> None:
        """Take the terminal again."""


class Signals:
    """
    Notes signals while the context lasts; nothing is done inside a handler.

    A robot is stopped and a terminal restored by the loop that looks at what was noted.
    """

    def __init__(self) -> None:
        """Note nothing yet."""
        self.is_impatient = False  #: whether somebody has pressed Ctrl-C again
        self._ended_at: float | None = None
        self._suspends = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Begin to note; a signal that came while the node was made counts, too."""
        for number in (*_ENDS, signal.SIGTSTP):
            self._before[number] = signal.signal(number, self._note)
        if self._ended_at is None and signal_came():
            self._ended_at = time.monotonic()
        return self

    @property
    def is_ended(self) -> bool:
        """Whether somebody wants an end."""
        return self._ended_at is not None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Set the handlers back."""
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)

    def _note(self, number: int, _: FrameType | None) -> None:
        if number == signal.SIGTSTP:
            self._suspends = True
        elif self._ended_at is None:
            self._ended_at = time.monotonic()
        elif number == signal.SIGINT and time.monotonic() - self._ended_at > _ONCE:
            self.is_impatient = True

    def look(
        self, node: Pausable, stop: Callable[[], None] | None = None,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        """
        Pause if that was asked for, and return when somebody has called this process back.

        Parameters
        ----------
        node : Pausable
            What is told.
        stop : callable, optional
            Stops this process, `stop_process` by default.
        before : callable
            Leaves nothing behind that has to be watched over.

        """
        if not self._suspends or self.is_ended:
            return
        self._suspends = False
        before()
        if self.is_ended:  # that took a while
            return
        node.pause()
        (stop or stop_process)()
        node.go_on()


def stop_process() -> None:
    """Stop this process as Ctrl-Z does by default; return when it is continued."""
    handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGTSTP)
    signal.signal(signal.SIGTSTP, handler)
