"""
What SQLite has not finished with: messages beside a ``.db3`` file that are not in it yet.

A recorder that was killed leaves its newest messages in ``-wal``, or a half-written change that is
to be taken back with ``-journal``. SQLite's own recovery sees to both, on a copy: nothing of the
recording is touched.
"""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
import shutil
import sqlite3
import struct
from tempfile import mkdtemp
from typing import Final, NamedTuple

from control_field.words import counted
from episode_store.rosbag2.bag_files import JOURNAL, WAL
from episode_store.rosbag2.errors import BagError, error_line
from msgs_bridge.untrusted.files import open_regular

#: How a journal ends that names another file, which SQLite would look into and may delete.
_NAMES_ANOTHER: Final = b'\xd9\xd5\x05\xf9\x20\xa1\x63\xd7'
_MESSAGES: Final = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = 'messages'"
#: How a log of SQLite begins (https://www.sqlite.org/fileformat2.html, 4.1): its size of a page is
#: the third number. Before each page stand so many bytes.
_WAL_HEAD: Final = struct.Struct('>8I')
_WAL_MAGIC: Final = (0x377F0682, 0x377F0683)
_WAL_FRAME: Final = 24


class Recovered(NamedTuple):
    """
    A copy of a file with what stood beside it.

    Parameters
    ----------
    path : Path
        The file, in a temporary folder of its own, which whoever asked for it removes.
    note : str
        What was found.

    """

    path: Path
    note: str


def recovered(path: Path) -> Recovered | None:
    """
    Take in what SQLite has left beside a file; None if it has left nothing.

    Raises
    ------
    BagError
        If that cannot be done, or the file is being written just now.

    """
    beside = [path.with_name(path.name + ending) for ending in (WAL, JOURNAL)]
    beside = [file for file in beside if file.exists() and file.stat().st_size]
    if not beside:
        return None
    names = ' and '.join(file.name for file in beside)
    with folder_kept_if_well() as folder:
        try:
            copy = _copied(path, beside, folder)
            n_before, n_after = _count(path), _recover(copy)
        except OSError as error:
            raise BagError(error_line(f'take in {names} for', path, error)) from None
        except sqlite3.Error as error:
            raise BagError(f'cannot read {path} together with {names}: {error}') from None
    cut = ''.join(f'; {file.name} is damaged or cut off: what else it held cannot be read'
                  for file in beside if file.name.endswith(WAL) and not _is_whole(file))
    return Recovered(copy, _note(path, names, n_before, n_after) + cut)


@contextmanager
def folder_kept_if_well() -> Iterator[Path]:
    """Make a temporary folder, which is removed if an error is raised."""
    try:
        folder = Path(mkdtemp())
    except OSError as error:
        raise BagError(f'there is no room to copy a bag: {error.strerror or error}') from None
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _note(path: Path, names: str, n_before: int | None, n_after: int) -> str:
    """Return a sentence on what was found beside a file."""
    why = f'{path.name} was not closed by its recorder'
    if n_before is None:
        return f'{why}: {counted(n_after, "message")} are read with what {names} holds'
    if n_after > n_before:
        return f'{why}: {n_after - n_before} of {n_after} messages are read from {names}'
    if n_after < n_before:
        return f'{why}: {n_before - n_after} half-written messages are taken back as {names} says'
    return f'{why}: {names} beside it adds no message'


def _is_whole(wal: Path) -> bool:
    """Return True if a log of SQLite begins as one and ends with a whole page."""
    with open_regular(wal, wal.parent) as file:
        head = file.read(_WAL_HEAD.size)
        size = file.seek(0, 2)
    if len(head) < _WAL_HEAD.size:
        return False
    magic, _, page = _WAL_HEAD.unpack(head)[:3]
    return magic in _WAL_MAGIC and not (size - _WAL_HEAD.size) % (_WAL_FRAME + max(page, 1))


def _copied(path: Path, beside: list[Path], folder: Path) -> Path:
    """Copy a file and what belongs to it; BagError if it changes meanwhile."""
    files = [path, *beside]
    before = _state(files)
    for file in files:
        # The name of the copy is ours: SQLite finds what belongs to it by that.
        name = 'bag.db3' + file.name.removeprefix(path.name)
        # A person may have named the file by a link; what lies beside it does not lead away.
        within = None if file == path else path.parent
        with open_regular(file, within) as source, (folder / name).open('wb') as target:
            shutil.copyfileobj(source, target, 2**20)
    if _state(files) != before:
        raise BagError(f'cannot read {path}: it is being written just now, stop its recorder')
    journal = folder / f'bag.db3{JOURNAL}'
    if journal.exists() and journal.read_bytes()[-len(_NAMES_ANOTHER):] == _NAMES_ANOTHER:
        raise BagError(f'cannot read {path}: {path.name}{JOURNAL} names another database, which '
                       f'is not followed')
    return folder / 'bag.db3'


def _state(files: list[Path]) -> list[tuple[int, int]]:
    return [(about.st_size, about.st_mtime_ns) for about in (file.stat() for file in files)]


def _recover(copy: Path) -> int:
    """Let SQLite finish a copy; return the number of its messages."""
    with closing(sqlite3.connect(copy, isolation_level=None)) as database:
        database.execute('PRAGMA trusted_schema = OFF')
        if not database.execute(_MESSAGES).fetchone()[0]:
            raise sqlite3.DatabaseError('it has no messages')
        n = int(database.execute('SELECT count(*) FROM messages').fetchone()[0])
        # Out of the log and into the file, which alone is read then.
        database.execute('PRAGMA journal_mode = DELETE')
        return n


def _count(path: Path) -> int | None:
    """Return how many messages are in a file by itself; None if that makes no sense."""
    address = path.absolute().as_uri() + '?mode=ro&immutable=1'
    try:
        with closing(sqlite3.connect(address, uri=True)) as database:
            database.execute('PRAGMA trusted_schema = OFF')
            if database.execute(_MESSAGES).fetchone()[0]:
                return int(database.execute('SELECT count(*) FROM messages').fetchone()[0])
    except sqlite3.Error:
        pass
    return None
