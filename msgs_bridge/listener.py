"""Hearing topics in a thread of its own, so that what arrives waits for nobody's work."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Event, Thread
import time
from typing import Any, Final

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription


#: Gets a message's bytes, and when it arrived, [ns].
Heard = Callable[[bytes, int], None]

#: Longest time until the end is noticed, and between two calls of who is to be called, [s].
_PERIOD: Final = 0.2
#: Time that the middleware may take to hand over what it received, [ns].
_MOST_DELAY: Final = 600 * 1_000_000_000
#: Of so many messages it is known that they came already.
_N_KNOWN: Final = 4000


class _AskFirst(MutuallyExclusiveCallbackGroup):
    """Asks before a message is taken from the middleware: that holds all of Python up."""

    def __init__(self, ask: Callable[[], None]) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._ask = ask

    def beginning_execution(self, entity: Any) -> bool:
        """Wait for leave; the executor takes the message next."""
        if isinstance(entity, Subscription):
            self._ask()
        may: bool = super().beginning_execution(entity)  # type: ignore[no-untyped-call]
        return may


class _Ear:
    """One topic: heard through one subscription or several, and taken once."""

    def __init__(
        self, node: Node, kind: type, topic: str, spare: QoSProfile | None,
        callback: Callable[[bytes, Any], None], lost: Counter[str], group: _AskFirst,
    ) -> None:
        self._node, self._kind, self._topic, self._group = node, kind, topic, group
        self._spare = spare
        self._may_come_twice = spare is not None
        self._callback = callback
        self._lost = lost
        self._known: dict[Any, None] = {}

    def subscribe(self, profile: QoSProfile) -> None:
        """Hear the topic through a profile, too."""
        self._node.create_subscription(
            self._kind, self._topic, self._read, profile, raw=True,  # type: ignore[arg-type]
            callback_group=self._group, event_callbacks=SubscriptionEventCallbacks(
                message_lost=self._note_lost, incompatible_qos=self._hear_less,
                use_default_callbacks=False))

    def _read(self, cdr: bytes, info: Any) -> None:
        if not (self._may_come_twice and self._is_known(info)):
            self._callback(cdr, info)

    def _is_known(self, info: Any) -> bool:
        about = info['source_timestamp'], info.get('publication_sequence_number', 0)
        if about in self._known:
            return True
        self._known[about] = None
        if len(self._known) > _N_KNOWN:
            del self._known[next(iter(self._known))]
        return False

    def _hear_less(self, _: Any) -> None:
        """Hear those who offer less, once there is one."""
        spare, self._spare = self._spare, None
        if spare is not None:
            self.subscribe(spare)

    def _note_lost(self, info: Any) -> None:
        self._lost[self._topic] += info.total_count_change


class Listener:
    """
    Hears topics through a node, an executor and a thread of its own.

    The middleware receives in threads that Python does not hold up; the queues of its
    subscriptions are as deep as the profiles say, and bridge what holds all of Python up.

    Parameters
    ----------
    owner : Node
        In whose name and namespace, and on whose kind of clock.
    lost : counter
        Counts the messages that the middleware says were lost, by topic.
    again : callable
        Is called in the thread of the listener every now and then.
    part : str
        What its node, its thread are called, behind the owner's name.
    ask : callable
        Is called in the thread of the listener before each message is taken, and may wait.

    """

    def __init__(
        self, owner: Node, lost: Counter[str], again: Callable[[], None] = lambda: None,
        part: str = 'recorder', ask: Callable[[], None] = lambda: None,
    ) -> None:
        is_simulated = owner.get_parameter('use_sim_time').value
        # With the global arguments it would be renamed like its owner, and have the same name.
        self._node = Node(
            f'{owner.get_name()}_{part}', namespace=owner.get_namespace(),
            context=owner.context, use_global_arguments=False, start_parameter_services=False,
            enable_rosout=False, parameter_overrides=[
                Parameter(  # type: ignore[no-untyped-call]
                    'use_sim_time', Parameter.Type.BOOL, is_simulated)])
        self._is_simulated = is_simulated
        self._again = again
        self._is_over = Event()
        self._lost = lost
        self._thread = Thread(target=self._work, name=part, daemon=True)
        self._group = _AskFirst(ask)

    def hear(
        self, kind: type, topic: str, callback: Heard, profiles: Sequence[QoSProfile],
        spare: QoSProfile | None = None,
    ) -> None:
        """
        Hear a topic, serialised; before `start`.

        Parameters
        ----------
        kind : type
            Of its messages.
        topic : str
            Its full name, after remapping.
        callback : callable
            Gets the bytes and the time of arrival, [ns], in the listener's thread.
        profiles : sequence of QoSProfile
            It is heard once through each.
        spare : QoSProfile, optional
            The same for publishers that offer less: heard once there is one, and then too.

        """
        ear = _Ear(self._node, kind, topic, spare,
                   lambda cdr, info: callback(cdr, self._arrived(info)), self._lost, self._group)
        for profile in profiles:
            ear.subscribe(profile)

    def _arrived(self, info: Any) -> int:
        """Return when the middleware got a message: a thread that was held up comes later."""
        now = int(self._node.get_clock().now().nanoseconds)
        received = int(info.get('received_timestamp') or 0)
        if self._is_simulated or not now - _MOST_DELAY < received < now:
            return now
        return received

    def start(self) -> None:
        """Begin to hear."""
        self._thread.start()

    def close(self) -> None:
        """Hear no more; what was being heard is done when this returns."""
        self._is_over.set()
        if self._thread.is_alive():
            self._thread.join()
        with suppress(rcl.InvalidHandle, rcl.RCLError):
            self._node.destroy_node()  # type: ignore[no-untyped-call]

    def _work(self) -> None:
        executor: Any = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        last = time.monotonic()
        try:
            while not self._is_over.is_set() and self._node.context.ok():
                executor.spin_once(_PERIOD)
                if time.monotonic() - last >= _PERIOD:
                    last = time.monotonic()
                    self._again()
        except ExternalShutdownException:
            pass
        finally:
            executor.shutdown()
