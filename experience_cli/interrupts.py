"""Ctrl-C while a command works: KeyboardInterrupt, but never in the middle of an import."""

from collections.abc import Iterator
from contextlib import contextmanager
import signal
import sys
from types import FrameType
from typing import Final

from experience_cli.quiet_start import end_at_once, ours

#: How long until it is looked again whether an import is over, [s].
_SOON: Final = 0.02
_IMPORTS: Final = '<frozen importlib'


@contextmanager
def heard(on_command_line: bool) -> Iterator[None]:
    """
    Let Ctrl-C raise KeyboardInterrupt meanwhile; afterwards it ends the process at once.

    Parameters
    ----------
    on_command_line : bool
        Whether this process is the command's own; else nothing is changed.

    """
    if not on_command_line:
        yield
        return
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        end_at_once(ours(sys.orig_argv) or 'experience')
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def interrupt(number: int, frame: FrameType | None) -> None:
    """
    Raise KeyboardInterrupt, or look again soon if something is being imported.

    An extension that is being loaded may lose an exception, or make another one of it.
    """
    if not _is_importing(frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, _SOON)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTS):
            return True
        frame = frame.f_back
    return False
