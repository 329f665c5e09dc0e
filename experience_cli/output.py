"""Files that commands write: whole, or not at all."""

from collections.abc import Callable
import io
from pathlib import Path
from typing import BinaryIO

from experience_cli.errors import UserError
from msgs_bridge.safe_files import replace_file


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
    """Write a file whole or not at all; devices and pipes are written to as they are."""
    if path.exists() and not path.is_file():
        path.write_bytes(content)
        return
    replace_file(path.resolve(), content)
