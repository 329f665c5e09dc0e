"""Bags from other recorders: sqlite3, compressed, split; the only module that uses rosbags."""

from pathlib import Path

from rosbags.rosbag2 import Reader

from msgs_bridge.bag_folder import BagError
from msgs_bridge.bag_records import RawMessages


class ForeignBag:
    """
    Read a bag that `BagReader` cannot, through `rosbags`.

    Parameters
    ----------
    path : Path
        A bag's folder, or a file in ``.mcap`` or ``.db3``.

    Raises
    ------
    BagError
        If it cannot be read.

    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        # rosbags raises what it runs into, of many types, on a bag that is damaged.
        try:
            with Reader(self.path) as reader:
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
            with Reader(self.path) as reader:
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
