"""Reading control fields without holding up who guards the robot: large ones in a thread."""

from queue import Empty, SimpleQueue
import threading
from typing import Final

from control_field.records import ControlField
from msgs_bridge.raw_messages import cloud_from_cdr
from msgs_bridge.tables import field_from_cloud

#: Cells that are read, and taken over by a trial, in a few milliseconds; bytes of as many.
FEW_CELLS: Final = 5000
_FEW_BYTES: Final = 100 * FEW_CELLS


#: A field, or what is wrong with it.
Outcome = ControlField | ValueError


def outcome_from_cdr(message: bytes) -> Outcome:
    """Read a control field from the bytes of its message."""
    try:
        return field_from_cloud(cloud_from_cdr(message))
    except ValueError as error:
        return error
    except MemoryError:
        return ValueError('control_field: it does not fit into memory')


class FieldReader:
    """
    Reads large fields one after the other, the newest that waits next.

    Attributes
    ----------
    is_reading : bool
        Whether one is read or waits.

    """

    def __init__(self) -> None:
        """Start with nothing to read."""
        self.is_reading = False
        self._waiting: bytes | None = None
        self._is_outdated = False
        self._done: SimpleQueue[Outcome] = SimpleQueue()

    def read(self, message: bytes, aside: bool = True) -> Outcome | None:
        """
        Read a message at once if it is small or is not to be read aside; else return None.

        One that waits to be read is passed over for a newer one.
        """
        if not aside or len(message) <= _FEW_BYTES:
            self._waiting, self._is_outdated = None, self.is_reading
            return outcome_from_cdr(message)
        if self.is_reading:
            self._waiting, self._is_outdated = message, False
        else:
            self._begin(message)
        return None

    def finished(self) -> Outcome | None:
        """Return what has been read; None if that is nothing, or a newer one came meanwhile."""
        try:
            outcome = self._done.get_nowait()
        except Empty:
            return None
        message, self._waiting, self.is_reading = self._waiting, None, False
        is_outdated, self._is_outdated = self._is_outdated, False
        if message is not None:
            self._begin(message)
        return None if is_outdated else outcome

    def _begin(self, message: bytes) -> None:
        self.is_reading = True
        threading.Thread(
            target=lambda: self._done.put(outcome_from_cdr(message)), daemon=True).start()
