"""The one error that every map reader raises, and the careful opening of files."""

from pathlib import Path
from typing import BinaryIO

from control_field.grid import MOST_CELLS


class WorldError(ValueError):
    """A world that cannot be read; the message is one line that names the file and the remedy."""

    def __init__(self, path: Path, problem: str) -> None:
        """Put file and problem on one line, whatever the file is called."""
        super().__init__(' '.join(f'{path}: {problem}'.split()))


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
        if not path.is_file():
            raise WorldError(path, 'is no regular file, name a map file')
        return path.open('rb')
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
    if not (n_rows >= 1 and n_cols >= 1 and n_rows * n_cols <= MOST_CELLS
            and max(n_rows, n_cols) <= 100_000):
        raise WorldError(path, f'{n_cols} x {n_rows} cells, must be 1 to {MOST_CELLS} in all and '
                               'at most 100000 a side')

