"""Bags of ROS 1, read through `rosbags` as if ROS 2 had recorded them."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import decompressors
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag, MOST_IN_MEMORY, RawMessages
from episode_store.rosbag2.ros1_recovery import UnclosedBag, Unpackers
from episode_store.rosbag2.unpacking import Room, unpack
from msgs_bridge.untrusted.files import open_regular

_UNPACKERS: Final[Unpackers] = {
    'none': bytes, 'bz2': partial(unpack, kind='bz2'), 'lz4': partial(unpack, kind='lz4')}
#: What stands for the decompressors of rosbags, which know no bounds.
_BOUNDED: Final = {decompressors[name]: unpacker for name, unpacker in _UNPACKERS.items()}
#: Types that ROS 1 called otherwise.
_NOW: Final = {'tf/msg/tfMessage': 'tf2_msgs/msg/TFMessage'}


class Ros1Bag(Bag):
    """
    Read a ``.bag`` file.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BagError
        If it cannot be read.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._unclosed: UnclosedBag | None = None
        # rosbags raises what it runs into, of many types, on a bag that is damaged.
        try:
            open_regular(path).close()
            with self._opened() as reader:
                connections = list(reader.connections)
                if any(item.msgcount for item in connections):
                    self.recorded = reader.start_time, reader.end_time
        except Exception as error:
            self._unclosed = _unclosed(path)
            if self._unclosed is None:
                raise self._error(error) from None
            connections = self._unclosed.connections
        self.notes = (self._unclosed.note,) if self._unclosed else ()
        self.topics = {item.topic: _now(item.msgtype) for item in connections}
        self.counts = dict.fromkeys(self.topics, 0)
        for item in connections:
            self.counts[item.topic] += item.msgcount

    def messages(self, topic: str) -> RawMessages:
        """
        Return the messages of a topic as ROS 2 serialises them; none if it is not in the bag.

        Raises
        ------
        BagError
            If it cannot be read, or the topic's type is not the one that goes by that name.

        """
        found: list[bytes] = []
        times: list[int] = []
        try:
            room = Room(MOST_IN_MEMORY)
            with self._opened() as reader:
                wanted = [item for item in reader.connections if item.topic == topic]
                for item in wanted:
                    self._check_type(item)
                # No connection at all would mean every one.
                for item, time, message in reader.messages(wanted) if wanted else ():
                    room.take(len(message))
                    found.append(bytes(_jazzy().ros1_to_cdr(message, _now(item.msgtype))))
                    times.append(time)
        except BagError:
            raise
        except Exception as error:
            raise self._error(error) from None
        return RawMessages.of(topic, self.topics.get(topic, ''), found, times)

    @contextmanager
    def _opened(self) -> Iterator[Any]:
        if self._unclosed is not None:
            yield self._unclosed
        else:
            with _opened(self.path) as reader:
                yield reader

    def _check_type(self, connection: Any) -> None:
        """Refuse a type that is called like a standard one and is none: its bytes differ."""
        name, known = _now(connection.msgtype), _noetic()
        if name not in known.fielddefs or name not in _jazzy().fielddefs:
            raise BagError(f'{self.path}: {connection.topic} is {name}, which is no message of '
                           f'ROS itself')
        if connection.digest not in ('*', known.generate_msgdef(name)[1]):
            raise BagError(f'{self.path}: {connection.topic} is {name} of another version of ROS')

    def _error(self, error: Exception) -> BagError:
        text = ' '.join(str(error).split()) or type(error).__name__
        if 'not indexed' in text or self.path.suffix == '.active':
            text = ('it was not closed by its recorder; `rosbag reindex '
                    f'{self.path.name}` mends it')
        return BagError(f'cannot read {self.path}: {text}')


def _unclosed(path: Path) -> UnclosedBag | None:
    """Return the readable part of a bag without an index; None if there is none."""
    try:
        found = UnclosedBag(path, _UNPACKERS)
    except (OSError, ValueError):
        return None
    return found if found.connections else None


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a file; a chunk of it that would fill the memory is refused when it is unpacked."""
    with Reader(path) as reader:
        for at, chunk in getattr(reader, 'chunks', {}).items():
            unpacker = _BOUNDED.get(chunk.decompressor, chunk.decompressor)
            reader.chunks[at] = chunk._replace(decompressor=unpacker)
        yield reader


@cache
def _noetic() -> Any:
    """Return the type store of ROS 1."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(
        'geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))
    return store


@cache
def _jazzy() -> Any:
    """Return the type store of ROS 2."""
    return get_typestore(Stores.ROS2_JAZZY)


def _now(name: str) -> str:
    return _NOW.get(name, name)
