"""Whose a task's folder is: a learner's for as long as it lives, a command's while it works."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import fcntl
import os
from pathlib import Path
import shutil
from typing import Final

from msgs_bridge.untrusted import files as safe_files

#: The file that is locked; the system lets go of it when the process ends, however it ends.
IN_USE: Final = '.in_use'
#: The file that is locked while numbers are given.
LOCK: Final = '.lock'
#: What a bag is called once it is removed, followed by its name, until all of it is deleted.
REMOVED: Final = '.removed-'
#: Folders in which bags are made or changed before they take their places, followed by more.
MAKING: Final = '.making-'
TRIM: Final = '.trim-'
#: Ending of the whole recording beside one that was cut; no reader takes it for a bag.
WHOLE: Final = '.whole'


@contextmanager
def numbering(folder: Path) -> Iterator[None]:
    """Hold the lock on a folder's numbers; the system lets go of it when the process dies."""
    file = safe_files.open_lock(folder / LOCK)
    try:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
    finally:
        os.close(file)


def open_lock(folder: Path) -> int:
    """
    Open the file that is locked, and make it if need be.

    Raises
    ------
    OddFileError
        If it is a link, or no regular file.
    OSError
        If it cannot be opened or made.

    """
    return safe_files.open_lock(folder / IN_USE)


def lock(file: int) -> bool:
    """Lock it; tell whether nobody else has."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def is_in_use(folder: Path) -> bool:
    """Tell whether a learner records into a task's folder, or a command changes bags in it."""
    try:
        file = safe_files.open_lock(folder / IN_USE, create=False)
    except OSError:
        return False
    try:
        return not lock(file)
    finally:
        os.close(file)


def taken(folder: Path) -> str:
    """Say that a folder is another's, and what to do."""
    return (f'{folder} is in use by a learner that is running (or by a command that changes bags '
            f'in it): stop it with Ctrl-C first, or press keys in teleop_node: d removes the last '
            f'bag, b brings it back, y and f label it')


def sweep(folder: Path) -> None:
    """Delete what is left of removed and of half-made bags; only for who holds the folder."""
    for name in (REMOVED, MAKING, TRIM):
        for path in folder.glob(f'{name}*'):
            shutil.rmtree(path, ignore_errors=True)
    for path in folder.glob(f'[0-9]*/.*{safe_files.DRAFT}'):
        with suppress(OSError):
            path.unlink()
