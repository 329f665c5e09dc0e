"""Taking and reading control fields without holding up who guards the robot."""

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any, Final

from sensor_msgs.msg import PointCloud2

from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.ready_states import ReadyStates
from msgs_bridge.messages.raw_cloud import cloud_from_cdr
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from msgs_bridge.node.reader_threads import ReaderThreads

#: How often it is looked whether a state is to be made ready, [s].
_PERIOD: Final = 0.05

#: A field, or what is wrong with it.
Outcome = ControlField | ValueError


def outcome_from_cdr(message: bytes | memoryview) -> Outcome:
    """Read a control field from the bytes of its message; none of them is kept."""
    try:
        return field_from_cloud(cloud_from_cdr(message))
    except ValueError as error:
        return error
    except MemoryError:
        return ValueError('control_field: it does not fit into memory')


class FieldReader:
    """
    Takes fields from the middleware and reads them, in a thread beside the one that guards.

    However large a field is, no call on the way holds Python's lock for long: its bytes are read
    where the middleware has put them, slice by slice (ADR 41). With it the thread makes all that a
    trial on it begins with. Who guards takes both over in no time (`take_finished`).

    Parameters
    ----------
    states : ReadyStates
    parameters : callable
        Returns those of the trial under way, or the next.

    """

    def __init__(self, states: ReadyStates, parameters: Callable[[], Parameters]) -> None:
        """Start with nothing to read."""
        self._states, self._parameters = states, parameters
        self._done: SimpleQueue[Outcome] = SimpleQueue()
        self._current: ControlField | None = None

    def subscribe(
        self, node: Any, threads: ReaderThreads, settle: Callable[[Outcome], None] | None = None,
    ) -> None:
        """
        Subscribe to `control_field`.

        Parameters
        ----------
        node : rclpy.node.Node
            In whose name.
        threads : ReaderThreads
            Of that node.
        settle : callable, optional
            Where time waits: fields are taken and read at once, in the node's thread, and it gets
            what came of it.

        """
        if settle is not None:
            node.create_subscription(
                PointCloud2, 'control_field', lambda message: settle(outcome_from_cdr(message)),
                qos.LATCHED, raw=True)
            return
        threads.subscribe(PointCloud2, 'control_field', self.take, (qos.LATCHED,),
                          is_locked=False, lends=True)
        threads.repeat(self.keep_ready, _PERIOD)

    def take(self, message: bytes | memoryview) -> None:
        """Read what was taken, and make ready what a trial needs, in the thread that takes."""
        outcome = outcome_from_cdr(message)
        if isinstance(outcome, ControlField):
            self._states.make(outcome, self._parameters())
        self._done.put(outcome)

    def keep_ready(self) -> None:
        """Make ready what the next trial needs on the field in force, unless it is."""
        if self._current is not None:
            self._states.make(self._current, self._parameters())

    def take_finished(self, current: ControlField | None) -> Outcome | None:
        """Take what has been read, None if nothing is; ``current`` is the field in force."""
        self._current = current
        try:
            return self._done.get_nowait()
        except Empty:
            return None
