"""Messages that have arrived and the session has not seen yet."""

from collections import deque
from dataclasses import dataclass
from threading import Lock
import time
from typing import Final

#: What may wait in all, [bytes]: minutes of what a robot says.
_MOST_BYTES: Final = 256 * 1024 * 1024


@dataclass(frozen=True)
class RawMessage:
    """A message as it arrived: topic, type, CDR bytes, and when, [ns]."""

    topic: str
    type_name: str
    cdr: bytes
    stamp: int


@dataclass
class QueuedMessage:
    """
    A message that has arrived.

    Parameters
    ----------
    name : str
        Of its topic among ours, such as ``odom``.
    message : RawMessage
    since : float, [s]
        When it came here, on a steady clock.
    place : int or None
        Which message of the open bag it is; None if it is not in it.

    """

    name: str
    message: RawMessage
    since: float
    place: int | None = None


class MessageQueue:
    """The messages in their order, within bounds; for one thread that puts and one that pops."""

    def __init__(self) -> None:
        """Start with none."""
        self._messages: deque[QueuedMessage] = deque()
        self._n_bytes = 0
        # Of its own, and never held for long: who puts must not wait for a disk.
        self._lock = Lock()

    def put(self, name: str, message: RawMessage) -> bool:
        """Append a message; return False if there is no room for it."""
        with self._lock:
            if self._n_bytes + len(message.cdr) > _MOST_BYTES:
                return False
            self._n_bytes += len(message.cdr)
            self._messages.append(QueuedMessage(name, message, time.monotonic()))
            return True

    def oldest(self) -> QueuedMessage | None:
        """Return the oldest, which goes on waiting; None if none waits."""
        return self._messages[0] if self._messages else None

    def pop(self) -> QueuedMessage:
        """Return the oldest, which waits no more; IndexError if none waits."""
        with self._lock:
            queued = self._messages.popleft()
            self._n_bytes -= len(queued.message.cdr)
            return queued

    def unwritten(self) -> list[QueuedMessage]:
        """Return those that are not in the open bag."""
        with self._lock:
            return [queued for queued in self._messages if queued.place is None]

    def take_back(self) -> set[int]:
        """Return which messages of the open bag wait here; they are in no bag from now on."""
        with self._lock:
            places = {queued.place for queued in self._messages if queued.place is not None}
            for queued in self._messages:
                queued.place = None
            return places
