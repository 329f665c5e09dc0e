"""
The one place where files are opened that are not ours, and where files are replaced.

Whoever gives a folder can put anything into it: pipes and devices that never end, links that lead
elsewhere, a gigabyte of text. Such a file raises `OddFileError`, which is an OSError: code that
reports why a file cannot be read reports this, too.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import errno
import os
from pathlib import Path
import stat
from typing import BinaryIO, Final

#: A file's size unless something else is said, [bytes]: ``metadata.yaml`` of 5000 files has 2 MB.
MOST_BYTES: Final = 4 * 2**20
_KINDS: Final = (
    (stat.S_ISDIR, 'a folder'), (stat.S_ISFIFO, 'a named pipe'), (stat.S_ISSOCK, 'a socket'),
    (stat.S_ISCHR, 'a device'), (stat.S_ISBLK, 'a device'))
#: Ending of the name of a draft, after letters that nobody can predict.
DRAFT: Final = '.tmp'
#: So much of the name of the file comes before them: names have at most 255 bytes.
_MOST_NAME: Final = 50


class OddFileError(OSError):
    """
    A file that is not read, whatever its content.

    Parameters
    ----------
    path : Path
        Which one.
    problem : str
        What is wrong with it and what to do; follows the name of the file in messages.

    """

    def __init__(self, path: Path | str, problem: str) -> None:
        super().__init__(errno.EINVAL, problem, str(path))


def open_regular(path: Path | str, within: Path | str | None = None) -> BinaryIO:
    """
    Open a regular file for reading, nothing else, and never wait for it.

    Parameters
    ----------
    path : Path
        The file.
    within : Path, optional
        A folder that a link must not lead out of. None, for paths that a person typed, lets a
        link lead anywhere.

    Raises
    ------
    OddFileError
        If it is a folder, pipe, socket or device, or leads out of the folder.
    OSError
        If it is missing or cannot be read.

    """
    real = path if within is None else _held_in(Path(path), Path(within))
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY
    try:
        file = os.open(real, flags | (0 if within is None else os.O_NOFOLLOW))
    except OSError as error:
        if error.errno in (errno.ENXIO, errno.ENODEV):  # what Linux says of a socket
            raise OddFileError(path, 'it is a socket, it must be a regular file') from None
        raise
    try:
        _check_regular(path, os.fstat(file))
        return os.fdopen(file, 'rb')
    except BaseException:
        os.close(file)
        raise


def read_bytes(
    path: Path | str, limit: int = MOST_BYTES, within: Path | str | None = None,
) -> bytes:
    """
    Read a regular file of bounded size.

    Parameters
    ----------
    path, within
        See `open_regular`.
    limit : int, [bytes]
        The most it may hold.

    Raises
    ------
    OddFileError
        If it is larger, or see `open_regular`.
    OSError
        If it is missing or cannot be read.

    """
    with open_regular(path, within) as file:
        size = os.fstat(file.fileno()).st_size
        # Files of /proc tell no size, and a file may grow meanwhile.
        data = file.read(limit + 1) if size <= limit else b''
    if size > limit or len(data) > limit:
        raise OddFileError(path, f'it has {max(size, len(data))} bytes, a file of this kind has '
                                 f'at most {limit}')
    return data


def read_text(
    path: Path | str, limit: int = MOST_BYTES, within: Path | str | None = None,
    errors: str = 'strict',
) -> str:
    """Read a regular text file in UTF-8, see `read_bytes`; UnicodeDecodeError if it is none."""
    return read_bytes(path, limit, within).decode(errors=errors)


def replace_file(path: Path | str, content: bytes) -> None:
    """
    Replace a file, whole or not at all, also when the power goes; raises OSError.

    A link is replaced, not followed, and so is whatever else has the name of the file.
    """
    path = Path(path)
    with replacing(path) as draft:
        with draft.open('xb') as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        with suppress(FileNotFoundError):
            before = path.lstat()
            if stat.S_ISREG(before.st_mode):
                draft.chmod(stat.S_IMODE(before.st_mode))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """
    Yield the name of a draft to be made and synced, which then takes the place of a file.

    After an error the file stays as it was. Raises OSError.
    """
    with draft_beside(path) as draft:
        yield draft
        draft.replace(path)
    sync_folder(path.parent)


@contextmanager
def draft_beside(path: Path) -> Iterator[Path]:
    """
    Yield a name beside a file that is not in use and that nobody can predict.

    A draft that is still there at the end is removed; `is_draft` knows those of killed processes.
    """
    draft = path.with_name(f'.{path.name[:_MOST_NAME]}.{os.urandom(6).hex()}{DRAFT}')
    try:
        yield draft
    finally:
        with suppress(OSError):
            draft.unlink()


def is_draft(name: str) -> bool:
    """Return True if the name is that of a draft that a killed process left behind."""
    return name.startswith('.') and name.endswith(DRAFT)


def open_lock(path: Path | str, create: bool = True) -> int:
    """
    Open a file to be locked, never through a link.

    Raises
    ------
    OddFileError
        If it is a link, or no regular file.
    OSError
        If it cannot be opened.

    """
    flags = os.O_RDWR | os.O_CREAT if create else os.O_RDONLY
    try:
        file = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OddFileError(path, 'it is a link, remove it') from None
        if error.errno in (errno.EISDIR, errno.ENXIO, errno.ENODEV):
            raise OddFileError(path, 'it must be a regular file, remove it') from None
        raise
    try:
        _check_regular(path, os.fstat(file))
    except OSError:
        os.close(file)
        raise
    return file


def check_folder(path: Path | str) -> None:
    """
    Refuse a folder of ours that is a link or not a folder; it may be missing.

    Raises
    ------
    OddFileError
        If it is.

    """
    with suppress(FileNotFoundError):
        mode = os.lstat(path).st_mode
        if stat.S_ISLNK(mode):
            raise OddFileError(path, 'it is a link, which is not followed: remove it')
        if not stat.S_ISDIR(mode):
            raise OddFileError(path, 'it must be a folder')


def check_held(path: Path | str, within: Path | str) -> None:
    """
    Refuse a file that is not regular, or leads out of a folder, without opening it.

    Raises
    ------
    OddFileError
        See `open_regular`.
    OSError
        If it is missing or cannot be looked at.

    """
    _check_regular(path, os.lstat(_held_in(Path(path), Path(within))))


def sync_folder(folder: Path) -> None:
    """Make a rename in a folder survive a power cut; raises OSError."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _held_in(path: Path, folder: Path) -> str:
    """Return where a file really is, if that is within a folder."""
    if path.parent == folder and path.name != '..' and not path.is_symlink():
        return str(path)  # the usual case, which need not ask of every folder above
    real, root = os.path.realpath(path), os.path.realpath(folder)
    if os.path.commonpath((real, root)) != root:
        raise OddFileError(path, f'it leads out of {folder}: copy the file into the folder')
    return real


def _check_regular(path: Path | str, about: os.stat_result) -> None:
    if stat.S_ISREG(about.st_mode):
        return
    kind = next((words for test, words in _KINDS if test(about.st_mode)), 'something else')
    raise OddFileError(path, f'it is {kind}, it must be a regular file')
