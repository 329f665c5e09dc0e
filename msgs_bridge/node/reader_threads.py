"""Threads that take messages beside the executor, so that none holds up who guards a robot."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from functools import partial, wraps
from threading import Event, RLock, Thread
from typing import Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.qos import QoSProfile

from msgs_bridge.node.qos import subscribe_all
from msgs_bridge.node.raw_messages import MOST_BYTES, small_only
from msgs_bridge.node.rcl_take import RclTaker
from msgs_bridge.node.remaps import note_subscription

#: Gets a message's bytes, or their number where they are too many.
RawCallback = Callable[[Any], None]

#: Longest time until `close` is noticed, [ns].
_PERIOD: Final = 200_000_000


@dataclass(frozen=True)
class _RawSubscription:
    subscription: Any
    callback: RawCallback
    max_bytes: int
    is_locked: bool
    lends: bool


class ReaderThreads:
    """
    Takes the messages of some topics in threads of its own, once enabled.

    However large a message is, only its own thread waits while it is taken (see
    `msgs_bridge.node.rcl_take`). In lock-step the threads stay disabled: there time waits, and the
    executor does the same things in the same order every time. The node's `subscriptions` must be
    `for_executor`.

    Parameters
    ----------
    node : Node
        Owner of the subscriptions.

    Attributes
    ----------
    is_enabled : bool
    lock : RLock
        Held by every callback that works with what the node knows.
    error : BaseException or None
        What ended a thread, see `check`.

    """

    def __init__(self, node: Node) -> None:
        """Start disabled."""
        self._node = node
        self.lock = RLock()
        self.is_enabled = False
        self._groups: dict[str, dict[int, _RawSubscription]] = {}
        self._works: list[Callable[[], None]] = []
        self._threads: list[Thread] = []
        self._end = Event()
        self.error: BaseException | None = None

    def enable(self) -> None:
        """Use threads from now on; before the first subscription."""
        self.is_enabled = True

    def subscribe(
        self, kind: type, topic: str, callback: RawCallback, profiles: Sequence[QoSProfile],
        max_bytes: int = MOST_BYTES, is_locked: bool = True, group: str = '',
        lends: bool = False,
    ) -> None:
        """
        Subscribe to a topic, once through each profile.

        Parameters
        ----------
        kind : type
        topic : str
            Relative.
        callback : callable
            Gets the bytes, in a thread if enabled.
        profiles : sequence of QoSProfile
        max_bytes : int
            Of a longer message a thread hands on the length only.
        is_locked : bool
            Whether the callback is to hold the lock.
        group : str, optional
            Topics of one group share a thread, which costs less; else each has its own.
        lends : bool
            Whether messages of any length are only lent, as a memoryview, while the callback runs.

        """
        if not self.is_enabled:
            subscribe_all(self._node, kind, topic, callback, profiles, raw=True)
            return
        for subscription in subscribe_all(
                self._node, kind, topic, lambda _: None, profiles, raw=True):
            note_subscription(subscription.topic_name)
            members = self._groups.setdefault(group or topic, {})
            members[subscription.handle.pointer] = _RawSubscription(
                subscription, callback, max_bytes, is_locked, lends)

    def subscribe_small(
        self, kind: type, topic: str, callback: Callable[[Any], None],
        refuse: Callable[[str], None], *profiles: QoSProfile,
        skip: Callable[[bytes], bool] = lambda _: False, group: str = '',
    ) -> None:
        """
        Subscribe to a topic of small messages, see `small_only`.

        ``skip`` returns True for the bytes of a message that a thread is to ignore.
        """
        take = small_only(kind, topic, callback, refuse)
        is_skipped = skip if self.is_enabled else lambda _: False
        self.subscribe(
            kind, topic, lambda message: None if isinstance(message, bytes) and is_skipped(
                message) else take(message), profiles, group=group)

    def repeat(self, work: Callable[[], None], period: float) -> None:
        """Call something every so many seconds, in a thread of its own and without the lock."""
        def loop() -> None:
            while not self._end.wait(period):
                work()

        self._works.append(loop)

    def locked(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback for the executor that holds the lock."""
        @wraps(callback)
        def work(*values: Any) -> Any:
            with self.lock:
                return callback(*values)

        return work

    def for_executor(self, subscriptions: Iterable[Any]) -> Iterator[Any]:
        """Return the subscriptions that are left to the executor."""
        ours = {id(member.subscription) for members in self._groups.values()
                for member in members.values()}
        return (each for each in subscriptions if id(each) not in ours)

    def start(self) -> None:
        """Start the threads."""
        works = [*self._works, *(partial(self._take, group) for group in self._groups.values())]
        self._threads = [Thread(target=self._run, args=(work,), daemon=True) for work in works]
        for thread in self._threads:
            thread.start()

    def mute(self) -> None:
        """Call no callback any more; whoever holds the lock knows that none runs."""
        self._end.set()

    def close(self) -> None:
        """End the threads; without the lock."""
        self.mute()
        for thread in self._threads:
            thread.join()

    def check(self) -> None:
        """Raise what has ended a thread."""
        if self.error is not None:
            raise self.error

    def _run(self, work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:
            self.error = self.error or error

    def _take(self, members: dict[int, _RawSubscription]) -> None:
        taker = RclTaker()
        try:
            with ExitStack() as stack:
                for member in members.values():
                    stack.enter_context(member.subscription.handle)  # not destroyed meanwhile
                self._wait_and_take(members, taker)
        finally:
            taker.close()

    def _wait_and_take(self, members: dict[int, _RawSubscription], taker: RclTaker) -> None:
        context: Any = self._node.context
        waiting = rcl.WaitSet(len(members), 0, 0, 0, 0, 0, context.handle)
        handles = [member.subscription.handle for member in members.values()]
        while not self._end.is_set() and context.ok():
            waiting.clear_entities()
            for handle in handles:
                waiting.add_subscription(handle)
            waiting.wait(_PERIOD)
            # One message of each topic: where more wait, those of the others come first.
            for pointer in waiting.get_ready_entities('subscription'):
                member = members[pointer]
                if member.lends:
                    self._lend(member, pointer, taker)
                elif (message := taker.take(pointer, member.max_bytes)) is not None:
                    self._call(member, message)

    def _lend(self, member: _RawSubscription, pointer: int, taker: RclTaker) -> None:
        if (message := taker.lend(pointer)) is None:
            return
        try:
            self._call(member, message)
        finally:
            taker.give_back()

    def _call(self, member: _RawSubscription, message: bytes | memoryview | int) -> None:
        with self.lock if member.is_locked else nullcontext():
            if not self._end.is_set():
                member.callback(message)
