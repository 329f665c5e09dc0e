"""Bags of rosbag2 in sqlite3, through `rosbags`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory
import weakref

from rosbags.rosbag2 import Reader

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag, MOST_IN_MEMORY, RawMessages
from episode_store.rosbag2.sqlite_recovery import recovered
from episode_store.rosbag2.unpacking import Room


class SqliteBag(Bag):
    """
    Read a file in ``.db3``, with what SQLite has left beside it.

    Parameters
    ----------
    path : Path
        The file.
    where : Path, optional
        A copy of it that is read in its place.

    Raises
    ------
    BagError
        If it cannot be read.

    """

    def __init__(self, path: Path, where: Path | None = None) -> None:
        self.path, self._where = path, where or path
        if copy := recovered(self._where):
            weakref.finalize(self, shutil.rmtree, copy.path.parent, ignore_errors=True)
            self._where, self.notes = copy.path, (copy.note,)
        # rosbags raises what it runs into, of many types, on a bag that is damaged.
        try:
            with _opened(self._where) as reader:
                self.topics = {item.topic: item.msgtype for item in reader.connections}
                self.counts = dict.fromkeys(self.topics, 0)
                for item in reader.connections:
                    self.counts[item.topic] += item.msgcount
                if any(self.counts.values()):
                    self.recorded = reader.start_time, reader.end_time
        except Exception as error:
            raise self._error(error) from None

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the bag."""
        found: list[bytes] = []
        times: list[int] = []
        try:
            with _opened(self._where) as reader:
                wanted = [item for item in reader.connections if item.topic == topic]
                # No connection at all would mean every one.
                room = Room(MOST_IN_MEMORY)
                for _, time, message in reader.messages(wanted) if wanted else ():
                    room.take(len(message))
                    found.append(bytes(message))
                    times.append(time)
        except Exception as error:
            raise self._error(error) from None
        return RawMessages.of(topic, self.topics.get(topic, ''), found, times)

    def _error(self, error: Exception) -> BagError:
        text = ' '.join(str(error).split()) or type(error).__name__
        if isinstance(error, MemoryError):
            text = 'it claims sizes that no memory holds'
        return BagError(f'cannot read {self.path}: {text}')


@contextmanager
def _opened(path: Path) -> Iterator[Reader]:
    """Open a file, under a name without what SQLite takes for the end of it (``run #3``)."""
    if not set('?#%') & set(str(path)):
        with Reader(path) as reader:
            yield reader
        return
    with TemporaryDirectory() as folder:
        plain = Path(folder) / 'bag.db3'
        plain.symlink_to(path.resolve())
        with Reader(plain) as reader:
            yield reader
