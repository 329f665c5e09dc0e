"""Taking and reading control fields without holding up who guards the robot."""

from collections import Counter
from collections.abc import Callable
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any, Final

from sensor_msgs.msg import PointCloud2

from control_field.records import ControlField
from msgs_bridge.messages.raw_cloud import cloud_from_cdr
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from msgs_bridge.node.listener import Listener

#: Cells that are read, and taken over by a trial, in a few milliseconds; bytes of as many.
FEW_CELLS: Final = 5000
_FEW_BYTES: Final = 100 * FEW_CELLS
#: How often who waits for leave looks whether there is nobody left to give it, [s].
_PATIENCE: Final = 0.1


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
    Takes fields from the middleware and reads them, in a thread beside the one that guards.

    How large a message is shows only once it has been taken, and taking holds all of Python up:
    a tenth of a second for 60 MB. So nothing is taken before the other thread, which first lets
    the robot stand, gives leave (ADR 19). Who takes calls `ask` and then `take`; who guards looks
    at `is_asking`, `is_busy` and `is_reading`, calls `give_leave` and `take_finished`.
    """

    def __init__(self) -> None:
        """Start with nothing to read."""
        #: Whether a field waits to be taken, is taken, or is read: the robot has to stand.
        self.is_busy = False
        #: Whether a large one is read, which takes longer than a moment.
        self.is_reading = False
        self._leave, self._is_over = Event(), False
        self._done: SimpleQueue[Outcome] = SimpleQueue()
        self._listener: Listener | None = None

    def subscribe(self, node: Any, settle: Callable[[Outcome], None] | None = None) -> None:
        """
        Subscribe to `control_field`.

        Parameters
        ----------
        node : rclpy.node.Node
            In whose name.
        settle : callable, optional
            Where time waits: fields are taken and read at once, in the node's thread, and it gets
            what came of it.

        """
        if settle is not None:
            node.create_subscription(
                PointCloud2, 'control_field', lambda message: settle(outcome_from_cdr(message)),
                qos.LATCHED, raw=True)
            return
        self._listener = Listener(node, Counter(), part='fields', ask=self.ask)
        self._listener.subscribe(
            PointCloud2, node.resolve_topic_name('control_field'),
            lambda message, _: self.take(message), (qos.LATCHED,))
        self._listener.start()

    @property
    def is_asking(self) -> bool:
        """Return whether a field waits until the robot stands."""
        return self.is_busy and not self._leave.is_set()

    def ask(self) -> None:
        """Wait for leave, in the thread that takes; it ends with `close`, too."""
        self.is_busy = True
        while not self._is_over and not self._leave.wait(_PATIENCE):
            pass

    def take(self, message: bytes) -> None:
        """Read what was taken, in the thread that takes."""
        self.is_reading = len(message) > _FEW_BYTES
        self._done.put(outcome_from_cdr(message))

    def give_leave(self) -> None:
        """Let the field be taken that waits: the robot stands."""
        self._leave.set()

    def take_finished(self) -> Outcome | None:
        """Take what has been read; return None if nothing is."""
        try:
            outcome = self._done.get_nowait()
        except Empty:
            return None
        self._leave.clear()
        self.is_busy = self.is_reading = False
        return outcome

    def close(self) -> None:
        """Unsubscribe; nobody waits any longer."""
        self._is_over = True
        if self._listener is not None:
            self._listener.close()
