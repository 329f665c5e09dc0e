"""Ctrl-C or a kill while a command works: an exception, but never where it would be lost."""

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
import signal
import sys
from types import FrameType
from typing import Final

from experience_cli.quiet_start import end_at_once, ours
from msgs_bridge.node.environment import ENDING_SIGNALS

#: How long until it is looked again whether an import is over, and whether anybody has taken the
#: exception to heart, [s].
_SOON: Final = 0.02
_LATER: Final = 0.5
#: C code that calls these overlooks exceptions: imports, constants of kernels, callbacks.
_FRAGILE: Final = ('<frozen importlib', ctypes.__file__, '/numba/core/serialize.py')


class Stopped(KeyboardInterrupt):
    """
    The process was told to end.

    Parameters
    ----------
    number : int
        The signal that told it.

    """

    def __init__(self, number: int = signal.SIGINT) -> None:
        super().__init__(number)
        self.number = number

    @property
    def exit_code(self) -> int:
        """Return the exit code that a shell would give it."""
        return 128 + self.number


@contextmanager
def stoppable(on_command_line: bool) -> Iterator[None]:
    """
    Let Ctrl-C and the like raise `Stopped` meanwhile; afterwards they end the process at once.

    Parameters
    ----------
    on_command_line : bool
        Whether this process is the command's own; else nothing is changed.

    Raises
    ------
    Stopped
        If a signal came, whatever a library made of it: a file that could not be loaded because
        reading it was interrupted, a result with an exception set.

    """
    if not on_command_line:
        yield
        return
    told: list[int] = []

    def heard(number: int, frame: FrameType | None) -> None:
        told.append(number)
        interrupt(number, frame)

    for number in ENDING_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, heard)
    usual, sys.unraisablehook = sys.unraisablehook, _lost
    try:
        yield
    except Exception as error:
        if told:
            raise Stopped(told[0]) from error
        raise
    finally:
        sys.unraisablehook = usual
        end_at_once(ours(sys.orig_argv) or 'experience')
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def interrupt(number: int, frame: FrameType | None) -> None:
    """
    Raise `Stopped`, or try again soon if an exception would be lost here.

    An extension that is being loaded may lose an exception, or make another one of it. So may a
    destructor or a callback: one that is lost is raised again.
    """
    is_ending, waits = _is_ending(sys.exc_info()[1]), _is_fragile(frame)
    signal.signal(signal.SIGALRM, lambda _, later: interrupt(number, later))
    signal.setitimer(signal.ITIMER_REAL, _SOON if waits else _LATER)
    if not waits and not is_ending:
        raise Stopped(number)


def _is_ending(error: BaseException | None) -> bool:
    """Return whether what is being done is the tidying up after a `Stopped`."""
    while error is not None and not isinstance(error, Stopped):
        error = error.__context__
    return error is not None


def _lost(unraisable: 'sys.UnraisableHookArgs') -> None:
    """Handle an exception that got lost; a `Stopped` is raised again, without a word."""
    if isinstance(unraisable.exc_value, Stopped):
        signal.setitimer(signal.ITIMER_REAL, _SOON)
    else:
        sys.__unraisablehook__(unraisable)


def _is_fragile(frame: FrameType | None) -> bool:
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith(_FRAGILE) or name.endswith(_FRAGILE):
            return True
        frame = frame.f_back
    return False
