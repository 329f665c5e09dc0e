"""What has arrived and the session has not seen yet."""

from collections import deque
from dataclasses import dataclass
from threading import Lock
import time
from typing import Final

#: What may wait in all, [bytes]: minutes of what a robot says.
_MOST_BYTES: Final = 256 * 1024 * 1024


@dataclass(frozen=True)
class Raw:
    """A message as it arrived: topic, type, CDR bytes, and when, [ns]."""

    topic: str
    type_name: str
    cdr: bytes
    stamp: int


@dataclass
class Arrival:
    """
    A message that has arrived.

    Parameters
    ----------
    name : str
        Of its topic among ours, such as ``odom``.
    message : Raw
    since : float, [s]
        When it came here, on a steady clock.
    place : int or None
        Which message of the open bag it is; None if it is not in it.

    """

    name: str
    message: Raw
    since: float
    place: int | None = None


class Waiting:
    """The arrivals in their order, within bounds; for one thread that puts and one that pops."""

    def __init__(self) -> None:
        """Start with none."""
        self._arrivals: deque[Arrival] = deque()
        self._n_bytes = 0
        # Of its own, and never held for long: who puts must not wait for a disk.
        self._lock = Lock()

    def put(self, name: str, message: Raw) -> bool:
        """Take in a message; tell whether there was room for it."""
        with self._lock:
            if self._n_bytes + len(message.cdr) > _MOST_BYTES:
                return False
            self._n_bytes += len(message.cdr)
            self._arrivals.append(Arrival(name, message, time.monotonic()))
            return True

    def oldest(self) -> Arrival | None:
        """Return the oldest, which goes on waiting; None if none waits."""
        return self._arrivals[0] if self._arrivals else None

    def pop(self) -> Arrival:
        """Return the oldest, which waits no more; IndexError if none waits."""
        with self._lock:
            arrival = self._arrivals.popleft()
            self._n_bytes -= len(arrival.message.cdr)
            return arrival

    def unwritten(self) -> list[Arrival]:
        """Return those that are not in the open bag."""
        with self._lock:
            return [arrival for arrival in self._arrivals if arrival.place is None]

    def take_back(self) -> set[int]:
        """Return which messages of the open bag wait here; they are in no bag from now on."""
        with self._lock:
            places = {arrival.place for arrival in self._arrivals if arrival.place is not None}
            for arrival in self._arrivals:
                arrival.place = None
            return places
