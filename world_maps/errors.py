"""The one error that every map reader raises, and the careful opening of files."""

import math
from pathlib import Path
from typing import BinaryIO, Final

from control_field.grid import MOST_CELLS
from msgs_bridge.untrusted.files import OddFileError, open_regular

#: The most cells along one side.
_LONGEST: Final = 100_000


class WorldError(ValueError):
    """
    A world that cannot be read; the message is one line that names the file and the remedy.

    Parameters
    ----------
    path : Path
        The file.
    problem : str
        What is wrong with it and what to do, without its name.

    """

    def __init__(self, path: Path, problem: str) -> None:
        """Put file and problem on one line, whatever the file is called."""
        super().__init__(' '.join(f'{path}: {problem}'.split()))
        self.path, self.problem = path, problem


def open_map(path: Path) -> BinaryIO:
    """
    Open a regular file for reading.

    Raises
    ------
    WorldError
        If it is missing, no regular file or unreadable.

    """
    try:
        if path.is_dir():
            raise WorldError(path, 'is a folder, name the map file in it')
        if not path.exists():
            raise WorldError(path, 'there is no such file, check the name')
        return open_regular(path)
    except OddFileError:
        raise WorldError(path, 'is no regular file, name a map file') from None
    except OSError as error:
        raise WorldError(path, f'cannot be read ({error.strerror}), check the path and its '
                               'permissions') from error


def read_bytes(path: Path, limit: int) -> bytes:
    """
    Read a regular file of bounded size.

    Parameters
    ----------
    path : Path
        The file.
    limit : int
        The most bytes it may hold.

    Raises
    ------
    WorldError
        If it is missing, no regular file, unreadable or too large.

    """
    with open_map(path) as file:
        data = file.read(limit + 1)
    if len(data) > limit:
        raise WorldError(path, f'is larger than {limit} bytes, which no map of this kind is')
    return data


def check_size(path: Path, n_rows: int, n_cols: int) -> None:
    """Raise `WorldError` for a map of no size or of too many cells."""
    if n_rows < 1 or n_cols < 1:
        raise WorldError(path, f'has {n_cols} x {n_rows} cells, must have at least 1 a side')
    shrink = max(math.ceil(math.sqrt(n_rows * n_cols / MOST_CELLS)),
                 math.ceil(max(n_rows, n_cols) / _LONGEST))
    if shrink > 1:
        raise WorldError(
            path, f'{n_cols} x {n_rows} cells are too many (at most {MOST_CELLS}, {_LONGEST} a '
                  f'side): make the image {shrink} times smaller each way and the resolution '
                  f'{shrink} times larger')
