"""Bags from other recorders: sqlite3, compressed, split; the only module that uses rosbags."""

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.rosbag2 import Reader

from msgs_bridge.bag_folder import BagError
from msgs_bridge.bag_metadata import NAME
from msgs_bridge.bag_records import RawMessages


class ForeignBag:
    """
    Read a bag that `BagReader` cannot, through `rosbags`.

    Parameters
    ----------
    path : Path
        A bag's folder, or a file in ``.mcap`` or ``.db3``, also with ``.zstd`` behind it.

    Raises
    ------
    BagError
        If it cannot be read.

    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        # rosbags raises what it runs into, of many types, on a bag that is damaged.
        try:
            with _opened(self.path) as reader:
                self._topics = {item.topic: item.msgtype for item in reader.connections}
        except Exception as error:
            raise self._error(error) from None

    @property
    def topics(self) -> dict[str, str]:
        """Return the type of every topic."""
        return self._topics

    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic; none if it is not in the bag.

        Raises
        ------
        BagError
            If it cannot be read.

        """
        found: list[bytes] = []
        times: list[int] = []
        try:
            with _opened(self.path) as reader:
                wanted = [item for item in reader.connections if item.topic == topic]
                # No connection at all would mean every one.
                for _, time, message in reader.messages(wanted) if wanted else ():
                    found.append(bytes(message))
                    times.append(time)
        except Exception as error:
            raise self._error(error) from None
        return RawMessages.of(topic, self._topics.get(topic, ''), found, times)

    def _error(self, error: Exception) -> BagError:
        text = ' '.join(str(error).split()) or type(error).__name__
        if isinstance(error, MemoryError):
            text = 'it claims sizes that no memory holds'
        if 'File end magic' in text:
            text = 'it is cut off or was not closed, `mcap recover` mends that'
        return BagError(f'cannot read {self.path}: {text}')


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open what has connections and messages: a bag, or a file that may be compressed as one."""
    if path.is_dir() or path.suffix != '.zstd':
        with Reader(path) as reader:
            yield reader
        return
    # rosbags unpacks a file if a metadata.yaml says so; without one its topics are not asked for.
    nothing = {'nanoseconds': 0, 'nanoseconds_since_epoch': 0}
    about = {
        'version': 9, 'relative_file_paths': [path.name], 'compression_format': 'zstd',
        'compression_mode': 'file', 'topics_with_message_count': [], 'message_count': 0,
        'storage_identifier': 'mcap' if path.stem.endswith('.mcap') else 'sqlite3',
        'duration': nothing, 'starting_time': nothing}
    with TemporaryDirectory() as folder:
        (Path(folder) / path.name).symlink_to(path.resolve())
        (Path(folder) / NAME).write_text(json.dumps({'rosbag2_bagfile_information': about}))
        with Reader(folder) as reader:
            storage: Any = reader.storage
            yield storage.storages[0]
