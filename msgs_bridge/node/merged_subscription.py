"""One topic as a listener hears it: through several subscriptions, and each message once."""

from collections import Counter
from collections.abc import Callable, Sequence
import time
from typing import Any, Final

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

#: Of so many messages it is known that they came already: of more than any publisher keeps.
_N_KNOWN: Final = 10_000


class Ear:
    """
    One topic: heard through one subscription or several, and taken once.

    Parameters
    ----------
    node : Node
        Makes the subscriptions.
    kind : type
        Of the messages.
    topic : str
        Its full name.
    callback : callable
        Gets the bytes and what the middleware says of them.
    lost : counter
        Counts the messages that the middleware says were lost, by topic.
    group : CallbackGroup
        Of the subscriptions.
    spare : QoSProfile, optional
        For publishers that offer less than the others: heard once there is one, and then too.
    kept : QoSProfile, optional
        How what publishers keep is fetched, see `fetch`.

    """

    def __init__(
        self, node: Node, kind: type, topic: str, callback: Callable[[bytes, Any], None],
        lost: Counter[str], group: CallbackGroup, spare: QoSProfile | None = None,
        kept: QoSProfile | None = None,
    ) -> None:
        self._node, self._kind, self._topic, self._group = node, kind, topic, group
        self._spares = [] if spare is None else [spare]
        self._kept = kept
        self._main: Subscription | None = None
        self._may_come_twice = spare is not None or kept is not None
        self._callback = callback
        self._lost = lost
        self._known: dict[Any, None] = {}
        self._since = time.time_ns()
        self._has_heard = False
        #: Whether a publisher was taken for gone: what it publishes until it is found is missing.
        self.has_lost_local_grid = False

    def subscribe(self, profiles: Sequence[QoSProfile]) -> None:
        """Hear the topic once through each profile."""
        subscriptions = [self._subscribe(profile) for profile in profiles]
        if self._kept is not None:
            self._main = subscriptions[0]
            self._spares.insert(0, profiles[0])

    def _subscribe(self, profile: QoSProfile) -> Subscription:
        return self._node.create_subscription(
            self._kind, self._topic, self._read, profile, raw=True,  # type: ignore[arg-type]
            callback_group=self._group, event_callbacks=SubscriptionEventCallbacks(
                message_lost=self._note_lost, incompatible_qos=self._hear_less,
                matched=self._note_matched, use_default_callbacks=False))

    def fetch(self) -> None:
        """
        Fetch what was published while this process was away, or was not found.

        Only from who keeps it. It comes in order, before what is new, and what was heard already
        is not taken again, nor what was published before this ear was there.
        """
        self.has_lost_local_grid = False
        if self._main is None or self._kept is None:
            return
        self._drain(self._main)
        self._node.destroy_subscription(self._main)
        self._main = self._subscribe(self._kept)

    def _drain(self, subscription: Any) -> None:
        """Take what waits yet."""
        handle = subscription.handle
        with handle:
            while found := handle.take_message(subscription.msg_type, subscription.raw):
                self._read(*found)

    def _read(self, cdr: bytes, info: Any) -> None:
        if not (self._may_come_twice and self._is_known(info)):
            self._callback(cdr, info)

    def _is_known(self, info: Any) -> bool:
        sent = info['source_timestamp']
        if not self._has_heard:
            self._has_heard, self._since = True, sent
        about = sent, info.get('publication_sequence_number', 0)
        if about in self._known or sent < self._since:
            return True
        self._known[about] = None
        if len(self._known) > _N_KNOWN:
            del self._known[next(iter(self._known))]
        return False

    def _hear_less(self, _: Any) -> None:
        """Hear those who offer less, once there is one."""
        if self._spares:
            self._subscribe(self._spares.pop(0))

    def _note_matched(self, info: Any) -> None:
        self.has_lost_local_grid |= info.current_count_change < 0

    def _note_lost(self, info: Any) -> None:
        self._lost[self._topic] += info.total_count_change
