"""Signals: what ends the program, and what pauses it (Ctrl-Z) until it is called back."""

from collections.abc import Callable
import os
import signal
from types import FrameType, TracebackType
from typing import Any, Final, Protocol, Self

from msgs_bridge.node_main import signal_came

#: The terminal went away, or somebody wants an end.
_ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


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
        self.is_ended = False
        self._suspends = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Begin to note; a signal that came while the node was made counts, too."""
        for number in (*_ENDS, signal.SIGTSTP):
            self._before[number] = signal.signal(number, self._note)
        self.is_ended = self.is_ended or signal_came()
        return self

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
        else:
            self.is_ended = True

    def look(self, node: Pausable, stop: Callable[[], None] | None = None) -> None:
        """
        Pause if that was asked for, and return when somebody has called this process back.

        Parameters
        ----------
        node : Pausable
            What is told.
        stop : callable, optional
            Stops this process, `stop_process` by default.

        """
        if not self._suspends or self.is_ended:
            return
        self._suspends = False
        node.pause()
        (stop or stop_process)()
        node.go_on()


def stop_process() -> None:
    """Stop this process as Ctrl-Z does by default; return when it is continued."""
    handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGTSTP)
    signal.signal(signal.SIGTSTP, handler)
