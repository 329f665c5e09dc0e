"""The recorder: writes messages into the bag of the episode under way."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
import struct
from threading import RLock
import time
from typing import Final

from episode_store.header import LOST_NAME
from episode_store.making import start_bag
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import episode_from_path, EpisodeFolder, EpisodeKind, TaskFolder
from episode_store.trim import drop_messages
from episode_store.undo import take_away
from learner_node.recording.message_queue import MessageQueue, QueuedMessage, RawMessage

#: Messages of decisions that may arrive before their trial is recorded: while a demonstration is
#: kept, or the learner learns, a person may start one.
_N_EARLY: Final = 4096
#: How many bytes they may have in all: what is no decision at all can be of any size.
_EARLY_BYTES: Final = 4 * 1024 * 1024
#: Where the stamp of a serialised message lies that begins with a header.
_STAMP_AT: Final = 4
#: How long a message waits for the session before it is recorded nevertheless, [s].
_PATIENCE: Final = 0.5


class BagGoneError(BagError):
    """The bag, or its folder, was removed or renamed while it was recorded."""


class Recorder:
    """
    At most one open bag of a task, and what the next one begins with; for two threads.

    One thread says what arrives, another takes it one by one, as far as it has come, and says
    where bags begin and end: exactly there, in the order of what has arrived. While that one is
    held up, the first writes what waits into the open bag: nothing is lost if the process dies.

    Parameters
    ----------
    task : TaskFolder
    header : callable
        Returns the header of a bag of a kind.

    """

    def __init__(
        self, task: TaskFolder, header: Callable[[EpisodeKind], Mapping[str, str]],
    ) -> None:
        self.task = task
        self._header = header
        self._folder = _identity(task.path)
        self._writer: BagWriter | None = None
        self._file: tuple[int, int] | None = None
        self._kind = EpisodeKind.DEMO
        #: The field and its prototypes, as they were published: every bag begins with them.
        self.latched: list[RawMessage] = []
        self._local_grid: RawMessage | None = None
        self._contact = b''
        self._early: deque[RawMessage] = deque()
        self._n_early_bytes = 0
        self._lock = RLock()
        self._queue = MessageQueue()
        #: Messages that are lost, by topic: since the start, and then as the open bag began.
        self.lost: Counter[str] = Counter()
        self._lost_before: Counter[str] = Counter()

    def change_task(
        self, task: TaskFolder, header: Callable[[EpisodeKind], Mapping[str, str]],
    ) -> None:
        """Make the next bags in another folder; no bag is open, and what came early is not its."""
        with self._lock:
            assert self._writer is None
            self.task, self._header = task, header
            self._folder = _identity(task.path)
            self._early.clear()
            self._n_early_bytes = 0

    @property
    def kind(self) -> EpisodeKind | None:
        """Return the kind of the open bag; None without one."""
        return None if self._writer is None else self._kind

    def start(self, kind: EpisodeKind, now: int) -> EpisodeFolder:
        """
        Open the next bag; it begins with what is latched and what the robot saw last.

        Parameters
        ----------
        kind : EpisodeKind
        now : int, [ns]
            When these are logged: who plays the bag must not wait for what was sent long before.

        Raises
        ------
        BagError
            If it cannot be made.
        BagGoneError
            If the task's folder is not the one there was at first: no other is held against a
            second learner, or known to hold what was learnt.

        """
        with self._lock:
            self.close()
            if self._folder != _identity(self.task.path):
                raise BagGoneError(
                    f'cannot record into {self.task.path}: it was removed or renamed since the '
                    f'learner started; restart the learner')
            self._kind = kind
            self._writer = start_bag(self.task, kind, self._header(kind))
            self._file = _identity(self._writer.path)
            self._lost_before = Counter(self.lost)
            local_grid = [self._local_grid] if self._local_grid else []
            for message in (*self.latched, *self._early, *local_grid):
                self.write(message, now)
            self._early.clear()
            self._n_early_bytes = 0
            return episode_from_path(self._writer.folder)

    def arrived(self, name: str, message: RawMessage) -> None:
        """
        Queue a message that has arrived on a topic, for `take`.

        Parameters
        ----------
        name : str
            Of the topic among ours, such as ``odom``.
        message : RawMessage

        """
        if not self._queue.put(name, message):
            self.lost[message.topic] += 1

    def catch_up(self) -> None:
        """Write what has waited too long into the bag; `take` or `close` reports a failure."""
        with self._lock, suppress(BagError):
            late = self._queue.unwritten()
            if self._writer is None or not late or (
                    time.monotonic() - late[0].since < _PATIENCE):
                return
            for queued in late:
                place = self._writer.n_messages
                _write(self._writer, queued.message)
                queued.place = place
            self._writer.flush()

    def oldest(self) -> QueuedMessage | None:
        """Return the message that `take` takes next; None if the queue is empty."""
        return self._queue.oldest()

    def take(self) -> None:
        """
        Take the oldest message from the queue: write it, and keep what the next bag needs.

        Raises
        ------
        BagError
            If it cannot be written.

        """
        with self._lock:
            queued = self._queue.pop()
            name, message = queued.name, queued.message
            if name == 'contact':
                if message.cdr == self._contact:
                    return  # it is read more than once, and a bumper may say it all the time
                self._contact = message.cdr
            if name == 'neighbourhood':
                self._local_grid = message
            if queued.place is None:
                self.write(message)
            if name == 'experience' and self.kind is not EpisodeKind.TRIAL:
                self._keep_early(message)

    def _keep_early(self, message: RawMessage) -> None:
        """Keep a message for the next bag, within bounds; the oldest go first."""
        if len(message.cdr) > _EARLY_BYTES:
            return
        self._early.append(message)
        self._n_early_bytes += len(message.cdr)
        while len(self._early) > _N_EARLY or self._n_early_bytes > _EARLY_BYTES:
            self._n_early_bytes -= len(self._early.popleft().cdr)

    def write(self, message: RawMessage, log_time: int | None = None) -> None:
        """
        Write a message, if a bag is open.

        Parameters
        ----------
        message : RawMessage
        log_time : int, [ns]
            Of the record; when the message arrived by default.

        Raises
        ------
        BagError
            If it cannot be written; what was written before is kept. This is said once: a bag
            that failed is closed, and no other is open.

        """
        with self._said_once() as writer:
            if writer is not None:
                _write(writer, message, log_time)

    def flush(self) -> None:
        """
        Hand what was written to the system, so that a kill does not take it along.

        Raises
        ------
        BagError
            If it cannot be written.
        BagGoneError
            If it was removed or renamed meanwhile; nothing is recorded any more.

        """
        with self._said_once() as writer:
            if writer is not None:
                self._check_there(writer)
                writer.flush()

    def close(self) -> EpisodeFolder | None:
        """
        Finish the bag; return which one it was, None if none was open.

        Raises
        ------
        BagError
            If it cannot be finished, or a failure was not said before.
        BagGoneError
            If it was removed or renamed meanwhile.

        """
        with self._said_once() as writer:
            if writer is None:
                return None
            self._check_there(writer)
            if writer.failure:  # in `catch_up`, which tells nobody
                raise BagError(writer.failure)
            later = self._queue.take_back()
            lost = self.lost - self._lost_before
            if lost:
                writer.note(LOST_NAME, {topic: str(n) for topic, n in lost.items()})
            self._writer = None
            writer.close()
            episode = episode_from_path(writer.folder)
            if later:
                drop_messages(episode, later)
            return episode

    @contextmanager
    def _said_once(self) -> Iterator[BagWriter | None]:
        """Give the open bag; close one that fails or is gone, so that nothing fails again."""
        with self._lock:
            writer = self._writer
            try:
                yield writer
            except BagError as error:
                if writer is not None and (writer.failure or isinstance(error, BagGoneError)):
                    self._writer = None
                    self._queue.take_back()
                    with suppress(BagError):
                        writer.close()
                raise

    def _check_there(self, writer: BagWriter) -> None:
        """Refuse to go on with a bag that was moved or removed: that would be silent."""
        if _identity(writer.path) != self._file:
            raise BagGoneError(f'cannot record into {writer.folder}: it was removed or renamed '
                               f'while it was recorded')

    def discard(self) -> None:
        """
        Remove the open bag, which holds nothing that somebody wants.

        Raises
        ------
        BagError
            If it cannot be removed.

        """
        with self._lock:
            writer, self._writer = self._writer, None
            self._queue.take_back()
            if writer is not None:
                writer.close()
                self.task.remove(episode_from_path(writer.folder).number)

    def throw_away(self) -> EpisodeFolder | None:
        """
        Close the open bag and take it away, so that it can be brought back; return which it was.

        Raises
        ------
        BagError
            If it cannot be finished or moved.

        """
        episode = self.close()
        return episode and take_away(self.task, [episode.number])[0]


def _write(writer: BagWriter, message: RawMessage, log_time: int | None = None) -> None:
    """Write a message into a bag; BagError if that fails."""
    writer.write(message.topic, message.type_name, message.cdr,
                 message.stamp if log_time is None else log_time, message.stamp)


def _identity(path: Path) -> tuple[int, int] | None:
    """Return device and inode of a path; None if nothing is there."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def stamp_of(cdr: bytes) -> int:
    """Return the stamp of a serialised message that begins with a header, [ns]; 0 without one."""
    if len(cdr) < _STAMP_AT + 8:
        return 0
    seconds, nanoseconds = struct.unpack_from('<iI' if cdr[1] else '>iI', cdr, _STAMP_AT)
    return max(int(seconds) * 1_000_000_000 + int(nanoseconds), 0)
