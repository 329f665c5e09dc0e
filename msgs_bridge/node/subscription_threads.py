"""Which thread hears what, so that nothing that arrives holds up who moves a robot."""

from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from threading import RLock
from typing import Any

from msgs_bridge.node.raw_messages import hear_small, MOST_BYTES, small_only
from msgs_bridge.node.reader_threads import Ears


class Hearing:
    """
    Hears for a node: in threads beside its executor's, or in that one.

    In lock-step time waits, and one thread does the same things in the same order every time:
    there nobody steps aside. The node's `subscriptions` have to be `others`.

    Parameters
    ----------
    node : rclpy.node.Node
        Of the subscriptions.

    Attributes
    ----------
    ears : Ears or None
        The threads beside, for who has its own way to read what comes.
    lock : RLock
        Is held while anybody works with what the node knows.

    """

    def __init__(self, node: Any) -> None:
        """Start deaf."""
        self._node = node
        self.lock = RLock()
        self.ears: Ears | None = None

    def step_aside(self) -> None:
        """Hear in threads of its own; before anything is heard."""
        self.ears = Ears(self._node, self.lock)

    def hear(
        self, kind: type, topic: str, callback: Callable[[Any], None],
        refuse: Callable[[str], None], *profiles: Any,
        skip: Callable[[bytes], bool] = lambda _: False, part: str = '',
    ) -> None:
        """
        Hear a topic of small messages, once through each profile; see `small_only`.

        In a thread aside, what `skip` says so of is passed over by its bytes; topics of one
        `part` are taken by one thread.
        """
        if self.ears is None:
            hear_small(self._node, kind, topic, callback, profiles, refuse)
            return
        take = small_only(kind, topic, callback, refuse)
        self.ears.hear(kind, topic, lambda message: (
            None if isinstance(message, bytes) and skip(message) else take(message)),
            profiles, MOST_BYTES, part=part)

    def locked(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback of the executor's thread, which waits until the others are done."""
        @wraps(callback)
        def work(*values: Any) -> Any:
            with self.lock:
                return callback(*values)

        return work

    def others(self, subscriptions: Iterable[Any]) -> Iterator[Any]:
        """Return those subscriptions that are left to the executor."""
        return iter(subscriptions if self.ears is None else self.ears.others(subscriptions))

    def start(self) -> None:
        """Begin to hear."""
        if self.ears is not None:
            self.ears.start()

    def check(self) -> None:
        """Raise what ended a thread, if one has ended."""
        if self.ears is not None:
            self.ears.check()

    def mute(self) -> None:
        """Act on nothing more, from when who holds the lock lets go of it."""
        if self.ears is not None:
            self.ears.mute()

    def close(self) -> None:
        """Hear no more; without the lock."""
        if self.ears is not None:
            self.ears.close()
