"""Several subscriptions to one topic that give each message once."""

from collections import Counter
from collections.abc import Callable, Sequence
import time
from typing import Any, Final

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

#: Number of messages recognised when they come again: more than any publisher keeps.
_N_KNOWN: Final = 10_000


class MergedSubscription:
    """
    Subscribes to a topic once or several times, and calls back once a message.

    Parameters
    ----------
    node : Node
        Makes the subscriptions.
    kind : type
        Of the messages.
    topic : str
        Its full name.
    callback : callable
        Gets the bytes and what the middleware knows of them.
    lost : counter
        Counts the messages that the middleware reports as lost, by topic.
    group : CallbackGroup
        Of the subscriptions.
    fallback : QoSProfile, optional
        For publishers that offer less: subscribed to as well once there is one.
    history : QoSProfile, optional
        Profile to `fetch` what publishers keep with.

    """

    def __init__(
        self, node: Node, kind: type, topic: str, callback: Callable[[bytes, Any], None],
        lost: Counter[str], group: CallbackGroup, fallback: QoSProfile | None = None,
        history: QoSProfile | None = None,
    ) -> None:
        self._node, self._kind, self._topic, self._group = node, kind, topic, group
        self._fallbacks = [] if fallback is None else [fallback]
        self._history = history
        self._main: Subscription | None = None
        self._may_come_twice = fallback is not None or history is not None
        self._callback = callback
        self._lost = lost
        self._known: dict[Any, None] = {}
        self._since = time.time_ns()
        self._has_received = False
        #: Whether a publisher was lost: what it publishes until it is discovered again is missing.
        self.has_lost_publisher = False

    def subscribe(self, profiles: Sequence[QoSProfile]) -> None:
        """Subscribe once through each profile."""
        subscriptions = [self._subscribe(profile) for profile in profiles]
        if self._history is not None:
            self._main = subscriptions[0]
            self._fallbacks.insert(0, profiles[0])

    def _subscribe(self, profile: QoSProfile) -> Subscription:
        return self._node.create_subscription(
            self._kind, self._topic, self._read, profile, raw=True,  # type: ignore[arg-type]
            callback_group=self._group, event_callbacks=SubscriptionEventCallbacks(
                message_lost=self._note_lost, incompatible_qos=self._subscribe_fallback,
                matched=self._note_matched, use_default_callbacks=False))

    def fetch(self) -> None:
        """
        Fetch what was published while this process slept, or was not discovered.

        Only publishers that keep messages have it. It comes in order, before what is new, without
        what has come already or was published before this subscription was there.
        """
        self.has_lost_publisher = False
        if self._main is None or self._history is None:
            return
        self._drain(self._main)
        self._node.destroy_subscription(self._main)
        self._main = self._subscribe(self._history)

    def _drain(self, subscription: Any) -> None:
        """Take the messages that are waiting."""
        handle = subscription.handle
        with handle:
            while found := handle.take_message(subscription.msg_type, subscription.raw):
                self._read(*found)

    def _read(self, cdr: bytes, info: Any) -> None:
        if not (self._may_come_twice and self._is_known(info)):
            self._callback(cdr, info)

    def _is_known(self, info: Any) -> bool:
        sent = info['source_timestamp']
        if not self._has_received:
            self._has_received, self._since = True, sent
        about = sent, info.get('publication_sequence_number', 0)
        if about in self._known or sent < self._since:
            return True
        self._known[about] = None
        if len(self._known) > _N_KNOWN:
            del self._known[next(iter(self._known))]
        return False

    def _subscribe_fallback(self, _: Any) -> None:
        """Subscribe for publishers that offer less, once there is one."""
        if self._fallbacks:
            self._subscribe(self._fallbacks.pop(0))

    def _note_matched(self, info: Any) -> None:
        self.has_lost_publisher |= info.current_count_change < 0

    def _note_lost(self, info: Any) -> None:
        self._lost[self._topic] += info.total_count_change
