"""Whose a task's folder is: a learner's for as long as it lives, a command's while it works."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import fcntl
import os
from pathlib import Path
import shutil
from typing import Final

from episode_store.rosbag2.errors import BagError, error_line
from msgs_bridge.untrusted.files import DRAFT, OddFileError, open_lock

#: The file that is locked; the system lets go of it when the process ends, however it ends.
_IN_USE: Final = '.in_use'
#: The file that is locked while numbers are given.
_LOCK: Final = '.lock'
#: What a bag is called once it is removed, followed by its name, until all of it is deleted.
REMOVED: Final = '.removed-'
#: Folders in which bags are made or changed before they take their places, followed by more.
MAKING: Final = '.making-'
TRIM: Final = '.trim-'


@contextmanager
def numbering(folder: Path) -> Iterator[None]:
    """Hold the lock on a folder's numbers; the system lets go of it when the process dies."""
    file = open_lock(folder / _LOCK)
    try:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
    finally:
        os.close(file)


def hold(folder: Path) -> int:
    """
    Keep a task's folder to this process until the file is closed that is returned.

    Raises
    ------
    BagError
        If another process holds it, or the folder cannot be made or written.

    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = open_lock(folder / _IN_USE)
    except OddFileError as error:
        raise BagError(error_line('use', folder, error)) from None
    except OSError as error:
        raise BagError(error_line('record into', folder, error) + '; set the parameter bags to a '
                       'folder that can be written') from None
    if not _lock(file):
        os.close(file)
        raise BagError(_taken(folder))
    _sweep(folder)
    return file


@contextmanager
def changing(folder: Path, make: bool = False) -> Iterator[None]:
    """
    Keep a task's folder to this process while bags in it are changed; no learner starts meanwhile.

    Where the lock's file cannot be made, as on a read-only disk, nobody can record either.

    Parameters
    ----------
    folder : Path
    make : bool
        Whether to make the folder if there is none; it goes again if no bag comes into it.

    Raises
    ------
    BagError
        If a learner records into it, or another process changes it.

    """
    is_new = make and not folder.exists()
    try:
        if is_new:
            folder.mkdir(parents=True)
        file = open_lock(folder / _IN_USE)
    except OddFileError as error:
        raise BagError(error_line('use', folder, error)) from None
    except OSError:
        file = None
    try:
        if is_in_use(folder) if file is None else not _lock(file):
            raise BagError(_taken(folder))
        _sweep(folder)
        yield
    finally:
        if is_new and not any(folder.glob('[0-9]*')):
            _remove_unused(folder)
        if file is not None:
            os.close(file)


def is_in_use(folder: Path) -> bool:
    """Return True while a learner records into a task's folder, or a command changes its bags."""
    try:
        file = open_lock(folder / _IN_USE, create=False)
    except OSError:
        return False
    try:
        return not _lock(file)
    finally:
        os.close(file)


def check_unused(folder: Path) -> None:
    """
    Check that a task's folder is nobody's.

    Raises
    ------
    BagError
        If a learner records into it, or another process changes it.

    """
    if is_in_use(folder):
        raise BagError(_taken(folder))


def let_go(folder: Path, file: int) -> None:
    """Give a folder up that `hold` has kept; one that nothing came into goes again."""
    with suppress(OSError):
        if not {entry.name for entry in folder.iterdir()} - {_LOCK, _IN_USE}:
            _remove_unused(folder)
    os.close(file)


def _lock(file: int) -> bool:
    """Lock a file that is open; return False if another process has locked it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _taken(folder: Path) -> str:
    """Say that a folder is another's, and what to do."""
    return (f'{folder} is in use by a learner that is running (or by a command that changes bags '
            f'in it): stop it with Ctrl-C first, or press keys in teleop_node: d removes the last '
            f'bag, b brings it back, y and f label it')


def _remove_unused(folder: Path) -> None:
    with suppress(OSError):
        for name in (_LOCK, _IN_USE):
            (folder / name).unlink(missing_ok=True)
        folder.rmdir()


def _sweep(folder: Path) -> None:
    """Delete what is left of removed and of half-made bags; only for who holds the folder."""
    for name in (REMOVED, MAKING, TRIM):
        for path in folder.glob(f'{name}*'):
            shutil.rmtree(path, ignore_errors=True)
    for path in folder.glob(f'[0-9]*/.*{DRAFT}'):
        with suppress(OSError):
            path.unlink()
