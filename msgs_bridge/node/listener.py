"""Subscribing in a node and thread of its own, so that messages wait for nobody's work."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
import math
from threading import Event, Thread
import time
from typing import Any, Final

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import (
    ExternalShutdownException, ShutdownException, SingleThreadedExecutor, TimeoutException)
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile

from msgs_bridge.node.merged_subscription import MergedSubscription
from msgs_bridge.node.remaps import note_subscription

#: Gets a message's bytes, and when it arrived, [ns].
RawCallback = Callable[[bytes, int], None]

#: Longest time until `close` is noticed, and between two periodic calls, [s].
_PERIOD: Final = 0.2
#: Time that the middleware may take to hand over what it received, [ns].
_MOST_DELAY: Final = 600 * 1_000_000_000
#: Longer between two looks, by a clock that goes on in a suspended computer, and this process
#: was asleep; others may have forgotten it meanwhile, [s].
_ASLEEP: Final = 5.0


class Listener:
    """
    Subscribes through a node, an executor and a thread of its own.

    The middleware receives in threads that Python does not hold up; the queues of its
    subscriptions are as deep as the profiles say, and bridge what holds all of Python up.

    Parameters
    ----------
    owner : Node
        Gives the name, the namespace and the kind of clock.
    lost : counter
        Counts the messages that the middleware reports as lost, by topic.
    again : callable
        Is called periodically, in the thread of the listener.
    part : str
        Name of its thread, and of its node behind the owner's name.

    """

    def __init__(
        self, owner: Node, lost: Counter[str], again: Callable[[], None] = lambda: None,
        part: str = 'recorder',
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
        self._group = MutuallyExclusiveCallbackGroup()  # type: ignore[no-untyped-call]
        self._subscriptions: list[MergedSubscription] = []
        self._executor: Any = SingleThreadedExecutor(context=owner.context)
        self._is_asked = False
        self._caught_up = -math.inf

    def subscribe(
        self, kind: type, topic: str, callback: RawCallback, profiles: Sequence[QoSProfile],
        fallback: QoSProfile | None = None, history: QoSProfile | None = None,
    ) -> None:
        """
        Subscribe to a topic, serialised; before `start`.

        Parameters
        ----------
        kind : type
            Of its messages.
        topic : str
            Its full name, after remapping.
        callback : callable
            Gets the bytes and the time of arrival, [ns], in the listener's thread.
        profiles : sequence of QoSProfile
            One subscription each.
        fallback : QoSProfile, optional
            For publishers that offer less: subscribed to as well once there is one.
        history : QoSProfile, optional
            Replaces the first profile to fetch what publishers have kept, after this process slept
            or lost a publisher.

        """
        note_subscription(topic)
        merged = MergedSubscription(
            self._node, kind, topic, lambda cdr, info: callback(cdr, self._arrived(info)),
            self._lost, self._group, fallback, history)
        merged.subscribe(profiles)
        self._subscriptions.append(merged)

    def _arrived(self, info: Any) -> int:
        """Return when the middleware received a message; a held up thread takes it later."""
        now = int(self._node.get_clock().now().nanoseconds)
        received = int(info.get('received_timestamp') or 0)
        if self._is_simulated or not now - _MOST_DELAY < received < now:
            return now
        return received

    def caught_up(self, since: float) -> float | None:
        """
        Return when nothing waited with the middleware, at ``since`` or later, [s].

        None until that has been so; ask again then. Times are those of a steady clock.
        """
        if self._caught_up >= since:
            return self._caught_up
        self._is_asked = True
        self._executor.wake()
        return None

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; no callback runs when this returns."""
        self._is_over.set()
        if self._thread.is_alive():
            self._thread.join()
        with suppress(rcl.InvalidHandle, rcl.RCLError):
            self._node.destroy_node()  # type: ignore[no-untyped-call]

    def _work(self) -> None:
        self._executor.add_node(self._node)
        last, looked = time.monotonic(), _awake()
        try:
            while not self._is_over.is_set() and self._node.context.ok():
                self._take_one()
                before, looked = looked, _awake()
                for merged in self._subscriptions:
                    if merged.has_lost_publisher or looked - before > _ASLEEP:
                        merged.fetch()
                if time.monotonic() - last >= _PERIOD:
                    last = time.monotonic()
                    self._again()
        except (ExternalShutdownException, ShutdownException):
            pass
        finally:
            self._executor.shutdown()

    def _take_one(self) -> None:
        """Take a message, or note that none waits if somebody asks for that."""
        if not self._is_asked:
            self._executor.spin_once(_PERIOD)
            return
        began, n_taken = time.monotonic(), 0
        # It gives up after each look, also after one at which something was taken.
        with suppress(TimeoutException):
            while True:
                handler, *_ = self._executor.wait_for_ready_callbacks(timeout_sec=0.0)
                handler()
                handler.result()  # raises what the callback raised
                n_taken += 1
        if not n_taken:
            self._is_asked, self._caught_up = False, began


def _awake() -> float:
    """Return the time by a clock that goes on while the computer is suspended, [s]."""
    return time.clock_gettime(getattr(time, 'CLOCK_BOOTTIME', time.CLOCK_MONOTONIC))
