"""Files that commands write: whole, or not at all."""

from collections.abc import Callable
import errno
import io
import os
from pathlib import Path
import time
from typing import BinaryIO, Final

from experience_cli.errors import UserError
from msgs_bridge.safe_files import replace_file

#: How long a pipe may have no reader, [s].
_PATIENCE: Final = 2.0


def write_output(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """
    Write a file, in a folder that is made if it must be.

    Parameters
    ----------
    path : Path
    write : callable
        Writes the content into a file it is given.

    Raises
    ------
    UserError
        If it cannot be written; what was there before then stays.

    """
    content = io.BytesIO()
    write(content)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content.getvalue())
    except OSError as error:
        raise UserError(f'cannot write {path}: {error.strerror}') from None


def write_whole(path: Path, content: bytes) -> None:
    """
    Write a file whole or not at all; devices and pipes are written to as they are.

    Raises
    ------
    OSError
        If it cannot be written; of a pipe also if nobody reads it for a while.

    """
    if path.exists() and not path.is_file():
        with os.fdopen(_opened(path), 'wb') as file:
            file.write(content)
        return
    replace_file(path.resolve(), content)


def _opened(path: Path) -> int:
    """Open a device or a pipe for writing; a pipe would wait for a reader for ever."""
    deadline = time.monotonic() + _PATIENCE
    while True:
        try:
            file = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
            break
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() > deadline:
                raise OSError(errno.ENXIO, 'it is a pipe or socket that nobody reads') from None
        time.sleep(0.05)
    os.set_blocking(file, True)
    return file
