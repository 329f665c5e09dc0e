"""Hearing in threads that wait for whatever comes, so that who guards does not."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from functools import partial
from threading import Event, RLock, Thread
from typing import Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.qos import QoSProfile

from msgs_bridge.node.qos import hear_all
from msgs_bridge.node.rcl_take import RclTaker
from msgs_bridge.node.remaps import note_heard

#: Gets a message's bytes; how many they are where those are too many.
Heard = Callable[[bytes | int], None]

#: Longest time until the end is noticed, [ns].
_PERIOD: Final = 200_000_000


@dataclass(frozen=True)
class _Ear:
    subscription: Any
    callback: Heard
    most: int
    is_locked: bool


class Ears:
    """
    Takes messages in threads, and acts on the small ones there, one at a time.

    However large a message is, only what its thread takes waits for it; nothing else of this
    process does (see `msgs_bridge.node.rcl_take`). The subscriptions are the owner's, whose
    executor must not take them, too: its `subscriptions` are to be `others`.

    Parameters
    ----------
    owner : Node
        Of the subscriptions.
    lock : RLock
        Is held while a message is acted on. Who else works with the same things holds it, too.

    Attributes
    ----------
    error : BaseException or None
        What ended a thread; for the owner to raise.

    """

    def __init__(self, owner: Node, lock: RLock) -> None:
        """Start deaf."""
        self._owner, self._lock = owner, lock
        self._parts: dict[str, dict[int, _Ear]] = {}
        self._works: list[Callable[[], None]] = []
        self._threads: list[Thread] = []
        self._end = Event()
        self.error: BaseException | None = None

    def hear(
        self, kind: type, topic: str, callback: Heard, profiles: Sequence[QoSProfile],
        most: int, is_locked: bool = True, part: str = '',
    ) -> None:
        """
        Hear a topic; before `start`.

        Parameters
        ----------
        kind : type
            Of its messages.
        topic : str
            Relative.
        callback : callable
            Gets what comes, in a thread of the ears.
        profiles : sequence of QoSProfile
            It is heard once through each.
        most : int
            So many bytes a message has at most.
        is_locked : bool
            Whether the callback works with what others work with, too.
        part : str, optional
            What has the same is taken by one thread, which costs less; else by one of its own.

        """
        for subscription in hear_all(
                self._owner, kind, topic, lambda _: None, profiles, raw=True):
            note_heard(subscription.topic_name)
            ears = self._parts.setdefault(part or topic, {})
            ears[subscription.handle.pointer] = _Ear(subscription, callback, most, is_locked)

    def repeat(self, work: Callable[[], None], period: float) -> None:
        """Do something every so many seconds, in a thread of its own and without the lock."""
        def go_on() -> None:
            while not self._end.wait(period):
                work()

        self._works.append(go_on)

    def others(self, subscriptions: Iterable[Any]) -> list[Any]:
        """Return those subscriptions that are none of these ears."""
        mine = {id(ear.subscription) for ears in self._parts.values() for ear in ears.values()}
        return [subscription for subscription in subscriptions if id(subscription) not in mine]

    def start(self) -> None:
        """Begin to hear."""
        works = [*self._works, *(partial(self._take, ears) for ears in self._parts.values())]
        self._threads = [Thread(target=self._work, args=(work,), daemon=True) for work in works]
        for thread in self._threads:
            thread.start()

    def mute(self) -> None:
        """Act on nothing more; who holds the lock knows that nothing is acted on when it ends."""
        self._end.set()

    def close(self) -> None:
        """Hear no more; without the lock."""
        self.mute()
        for thread in self._threads:
            thread.join()

    def check(self) -> None:
        """Raise what has ended a thread."""
        if self.error is not None:
            raise self.error

    def _work(self, work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:
            self.error = self.error or error

    def _take(self, ears: dict[int, _Ear]) -> None:
        taker = RclTaker()
        try:
            with ExitStack() as stack:
                for ear in ears.values():
                    stack.enter_context(ear.subscription.handle)  # nobody destroys it meanwhile
                self._listen(ears, taker)
        finally:
            taker.close()

    def _listen(self, ears: dict[int, _Ear], taker: RclTaker) -> None:
        context: Any = self._owner.context
        waiting = rcl.WaitSet(len(ears), 0, 0, 0, 0, 0, context.handle)
        handles = [ear.subscription.handle for ear in ears.values()]
        while not self._end.is_set() and context.ok():
            waiting.clear_entities()
            for handle in handles:
                waiting.add_subscription(handle)
            waiting.wait(_PERIOD)
            # One of each: where more wait, the others' come first.
            for pointer in waiting.get_ready_entities('subscription'):
                ear = ears[pointer]
                if (message := taker.take(pointer, ear.most)) is not None:
                    self._act(ear, message)

    def _act(self, ear: _Ear, message: bytes | int) -> None:
        with self._lock if ear.is_locked else nullcontext():
            if not self._end.is_set():
                ear.callback(message)
