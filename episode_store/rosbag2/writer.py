"""Write bags: MCAP as rosbag2 writes it, in small chunks that survive a kill."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import re
import time
from typing import cast, Final, IO

from mcap.writer import CompressionType, Writer

from episode_store.rosbag2.errors import BagError, error_line, mcap_path
from episode_store.rosbag2.metadata import (
    BagSummary, known_qos, OfferedQos, TopicSummary, write_metadata)
from episode_store.rosbag2.type_definitions import message_definition, type_hash

#: Name of the MCAP metadata record that a bag of ours begins with.
HEADER_NAME: Final = 'experience_controller'

#: A chunk is written when it holds so many bytes, or so much time has gone by since the last
#: one, on the wall clock or on the messages' own.
CHUNK_BYTES: Final = 16 * 1024
CHUNK_SECONDS: Final = 0.5
TOPIC: Final = re.compile(r'/?[A-Za-z_~][A-Za-z0-9_/]*')


class _WholeRecords:
    """
    A file that holds whole records only.

    MCAP's writer hands over one or more whole records at a time. When the disk is full in the
    middle of one, what was written of it is cut off again, so that the file stays readable.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._size = 0

    def write(self, data: bytes) -> int:
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._file, view):]
        except OSError:
            os.ftruncate(self._file, self._size)
            os.lseek(self._file, self._size, os.SEEK_SET)
            raise
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Do nothing: every write goes to the system at once."""

    def close(self) -> None:
        """Let the file survive a power cut, and close it."""
        try:
            os.fsync(self._file)
        finally:
            os.close(self._file)


class McapFile:
    """
    An MCAP file that is being written, with the channels and schemas of a ROS 2 bag.

    All methods raise OSError if it cannot be written.

    Parameters
    ----------
    path : Path
        The file, which must not exist.
    header : mapping of str to str, or None
        Metadata record to begin with.

    """

    def __init__(self, path: Path, header: Mapping[str, str] | None) -> None:
        self.path = path
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._start = self._end = 0
        self.n_messages = 0
        self._stream = _WholeRecords(path)
        self._writer = Writer(
            cast('IO[bytes]', self._stream), chunk_size=CHUNK_BYTES,
            compression=CompressionType.NONE)
        try:
            self._writer.start(profile='ros2', library='experience_controller')
            if header is not None:
                self._writer.add_metadata(HEADER_NAME, dict(header))
        except OSError:
            self.abandon()
            raise

    def type_name(self, topic: str) -> str | None:
        """Return the type of a topic; None if it is not in the file yet."""
        channel = self._channels.get(topic)
        return None if channel is None else channel.type_name

    def add_channel(
        self, topic: str, type_name: str, definition: bytes, metadata: Mapping[str, str],
    ) -> None:
        """Name a topic with its definition and its channel's metadata."""
        key = type_name, definition
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(type_name, 'ros2msg', definition)
        number = self._writer.register_channel(topic, 'cdr', self._schemas[key], dict(metadata))
        self._channels[topic] = _Channel(number, topic, type_name, dict(metadata))

    def add(self, topic: str, cdr: bytes, log_time: int, publish_time: int) -> None:
        """Write a message of a topic that was named."""
        channel = self._channels[topic]
        self._writer.add_message(channel.number, log_time, cdr, publish_time)
        self._start = min(self._start, log_time) if self.n_messages else log_time
        self._end = max(self._end, log_time)
        self.n_messages += 1
        channel.count += 1

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self._writer.add_metadata(name, dict(values))

    def flush(self) -> None:
        """End the chunk and hand it to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self, name: str) -> BagSummary:
        """Write the index and close the file, which will have the name ``name``."""
        try:
            summary = BagSummary(name, self._start, self._end,
                                 [channel.summary() for channel in self._channels.values()])
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._writer.add_metadata('rosbag2', {'serialized_metadata': summary.to_yaml()})
            self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._stream.close()
        return summary

    def abandon(self) -> None:
        """Close the file without its index; its records are whole."""
        self._stream.close()


class _Channel:
    """A topic of the file that is being written."""

    def __init__(
        self, number: int, name: str, type_name: str, metadata: Mapping[str, str],
    ) -> None:
        self.number, self.name, self.type_name = number, name, type_name
        self.metadata = metadata
        self.count = 0

    def summary(self) -> TopicSummary:
        return TopicSummary(
            self.name, self.type_name, self.metadata.get('topic_type_hash', ''),
            self.metadata.get('offered_qos_profiles', ''), self.count)


class BagWriter:
    """
    Write one bag; for one thread.

    Parameters
    ----------
    folder : Path
        The bag's folder, which exists and has no MCAP file yet.
    header : mapping of str to str
        Goes into the metadata record `experience_controller`, before the first message.

    Raises
    ------
    BagError
        If the file cannot be made.

    Notes
    -----
    After a `BagError` from `write` or `flush` because the file could not be written, the bag takes
    nothing more; what was written before stays readable, but for its index, which `repair_bag`
    adds. What `add_topic` refuses is left out, and the bag goes on.

    """

    def __init__(self, folder: Path | str, header: Mapping[str, str]) -> None:
        self.folder = Path(folder)
        self.path = mcap_path(self.folder)
        #: What could not be written; from then on the bag takes nothing more. Empty if all could.
        self.failure = ''
        self._closed = False
        self._flushed_wall = time.monotonic()
        self._flushed_log: int | None = None
        with self._guarded():
            self._file = McapFile(self.path, header)

    def __enter__(self) -> 'BagWriter':
        """Return the writer."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the bag."""
        self.close()

    @property
    def n_messages(self) -> int:
        """Return the number of messages written so far."""
        return self._file.n_messages

    def add_topic(self, topic: str, type_name: str, qos: OfferedQos | None = None) -> None:
        """
        Name a topic before its first message.

        Parameters
        ----------
        topic : str
            Its name, with its namespace.
        type_name : str
            Such as ``nav_msgs/msg/Odometry``; its package must be installed.
        qos : OfferedQos, optional
            How it is offered; that of our topics by default.

        Raises
        ------
        BagError
            If the name or the type is none, or it had another type before.

        """
        known = self._file.type_name(topic)
        if known == type_name:
            return
        if known is not None:
            raise BagError(f'{topic} is {type_name}, but was {known} in this bag')
        if TOPIC.fullmatch(topic) is None:
            raise BagError(f'{topic!r} is no topic name')
        self._file.add_channel(topic, type_name, message_definition(type_name).encode(), {
            'offered_qos_profiles': (qos or known_qos(topic)).to_yaml(),
            'topic_type_hash': type_hash(type_name)})

    def write(
        self, topic: str, type_name: str, cdr: bytes, log_time_ns: int,
        publish_time_ns: int | None = None,
    ) -> None:
        """
        Write a message as it arrived.

        Parameters
        ----------
        topic, type_name : str
            As for `add_topic`.
        cdr : bytes
            The message, serialised.
        log_time_ns, publish_time_ns : int, [ns]
            When it was received, and sent (the same by default).

        Raises
        ------
        BagError
            If it cannot be written, now or since an earlier failure.

        """
        log_time = max(int(log_time_ns), 0)
        sent = log_time if publish_time_ns is None else max(int(publish_time_ns), 0)
        with self._guarded():
            self.add_topic(topic, type_name)
            self._file.add(topic, cdr, log_time, sent)
        if self._flushed_log is None:
            self._flushed_log = log_time
        if (time.monotonic() - self._flushed_wall >= CHUNK_SECONDS
                or abs(log_time - self._flushed_log) >= CHUNK_SECONDS * 1e9):
            self.flush()

    def flush(self) -> None:
        """
        Hand all messages to the operating system, so that a kill loses none of them.

        Raises
        ------
        BagError
            If they cannot be written.

        """
        self._flushed_wall, self._flushed_log = time.monotonic(), None
        with self._guarded():
            self._file.flush()

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """
        Write a metadata record of a name.

        Raises
        ------
        BagError
            If it cannot be written.

        """
        with self._guarded():
            self._file.add_metadata(name, values)

    def close(self) -> None:
        """
        Finish the bag: index, ``metadata.yaml``, all of it on the disk. Idempotent.

        Raises
        ------
        BagError
            If that fails and nothing failed before; messages written so far stay readable.

        """
        if self._closed:
            return
        if self.failure:
            self._closed = True
            with suppress(OSError):
                self._file.abandon()
            return
        with self._guarded():
            self._closed = True
            write_metadata(self.folder, self._file.finish(self.path.name))

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Refuse to go on after a failure, and turn an OSError into one line."""
        if self.failure or self._closed:
            raise BagError(self.failure or f'{self.path} is closed')
        try:
            yield
        except OSError as error:
            self.failure = error_line('record into', self.path, error)
            raise BagError(self.failure) from None
