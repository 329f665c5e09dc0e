"""Files that commands write: completely, or not at all."""

from collections.abc import Callable
import errno
import io
import os
from pathlib import Path
import tempfile
import time
from typing import BinaryIO, Final

from experience_cli.errors import UserError
from msgs_bridge.untrusted.files import replace_file

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


class Output:
    """
    A file that is written at the end of long work; that it can be is checked beforehand.

    Parameters
    ----------
    name : str
        What the user has called it.
    option : str
        The option that names it.

    Raises
    ------
    UserError
        If it is a folder or a disk, cannot be written, or is a pipe that nobody reads for a while.

    """

    def __init__(self, name: str, option: str) -> None:
        self.path = Path(name)
        self._about = f'{option} {name or repr(name)}'
        self._pipe: int | None = None
        if not name or self.path.is_dir():
            raise UserError(f'{self._about}: is a folder, name a file')
        try:
            self._look()
        except OSError as error:
            raise UserError(f'{self._about}: cannot be written ({error.strerror})') from error

    def _look(self) -> None:
        if self.path.is_block_device():
            raise UserError(f'{self._about}: is a disk, name a file')
        if self.path.exists() and not self.path.is_file():
            # Opened once and for all: a reader that saw it closed would be gone at the end.
            self._pipe = _opened(self.path)
            return
        real = self.path.resolve()
        if not real.parent.is_dir():
            raise UserError(f'{self._about}: there is no folder {real.parent}, make it first')
        if self.path.exists():
            self.path.open('ab').close()
        # What is there is replaced, which takes a place beside it.
        tempfile.TemporaryFile(dir=real.parent).close()

    def write(self, content: bytes) -> None:
        """
        Write it, whole or not at all.

        Raises
        ------
        UserError
            If it cannot be written after all.

        """
        try:
            if self._pipe is None:
                write_whole(self.path, content)
                return
            with os.fdopen(self._pipe, 'wb') as file:
                file.write(content)
        except OSError as error:
            raise UserError(f'{self._about}: cannot be written ({error.strerror})') from error


def _opened(path: Path) -> int:
    """Open a device or a pipe for writing; wait only so long for a reader of a pipe."""
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
