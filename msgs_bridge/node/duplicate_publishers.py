"""
Two publishers of a topic that may have but one.

The graph of ROS names both, but keeps a killed one for 20 s. Sequence numbers tell who sends: each
publisher counts its own messages, and where two send, two series of numbers alternate.
"""

from collections.abc import Iterable
from typing import Any, Final

from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from msgs_bridge.node.graph import full_name, NOT_YET_KNOWN
from msgs_bridge.node.node_info import REMEDY
from msgs_bridge.node.qos import RECORDING_BEST_EFFORT
from msgs_bridge.node.rcl_take import RclTaker
from msgs_bridge.untrusted.text import printable

#: Time that two publishers must coexist until that is reported, [s]: usually, and where one of
#: them may have been killed, which the graph forgets after 20 s.
_PATIENCE: Final = 2.0
_PATIENCE_IF_KILLED: Final = 25.0
#: Number of alternations after which two series of numbers are two publishers.
_ALTERNATIONS: Final = 3
#: Greatest gap in one series, and greatest number of series.
_MAX_GAP: Final = 1000
_MAX_SERIES: Final = 16
#: Messages taken in one go: a few milliseconds.
_MAX_TAKEN: Final = 200


class SequenceNumbers:
    """Whether one publisher sends on a topic or several, by the numbers of its messages."""

    def __init__(self) -> None:
        """Start with no message."""
        #: Number of messages with a sequence number.
        self.n_messages = 0
        self._n_alternations = 0
        self._last: list[int] = []  # last number of each series, the latest series last

    @property
    def are_several(self) -> bool:
        """Return whether several publishers alternate; after a restart the old one never does."""
        return self._n_alternations >= _ALTERNATIONS

    def add(self, number: int | None) -> None:
        """Add the sequence number of a message; None or 0 where the middleware gives none."""
        if not number:
            return
        self.n_messages += 1
        before = [last for last in self._last if last < number <= last + _MAX_GAP]
        if before:
            series = max(before)
            self._n_alternations += series != self._last[-1]
            self._last.remove(series)
        self._last = [*self._last, number][-_MAX_SERIES:]


class DuplicateChecker:
    """Decides when several publishers of a topic are reported; ROS-free."""

    def __init__(self) -> None:
        """Start with no duplicates."""
        self._since: dict[str, float] = {}

    def check(
        self, topic: str, publishers: Iterable[Any], now: float,
        numbers: SequenceNumbers | None = None,
    ) -> str:
        """
        Return a line about several publishers of a topic; empty if one may have been killed.

        Parameters
        ----------
        topic : str
            Full name.
        publishers : iterable of TopicEndpointInfo
        now : float, [s]
        numbers : SequenceNumbers, optional
            Of the messages since there are several publishers.

        """
        peers = [peer for peer in publishers if peer.node_name != NOT_YET_KNOWN]
        if len(peers) < 2:
            self._since.pop(topic, None)
            return ''
        waited = now - self._since.setdefault(topic, now)
        names = sorted({full_name(peer) for peer in peers})
        processes = {bytes(peer.endpoint_gid[:12]) for peer in peers}
        # Of silent publishers one may have been killed if both have one name; where messages of
        # only one come, whatever their names.
        may_be_killed = len(processes) > 1 and (
            len(names) == 1 or (numbers is not None and numbers.n_messages > 0))
        is_proven = numbers is not None and numbers.are_several
        if not is_proven and waited < (_PATIENCE_IF_KILLED if may_be_killed else _PATIENCE):
            return ''
        who = ' and '.join(map(printable, names[:4]))
        remedy = ('give each suite a ROS_DOMAIN_ID of its own, or set publish_clock:=false for '
                  'all but one') if topic == '/clock' else REMEDY
        return (f'{len(peers)} publish {topic}: {who}{" more than once" * (len(names) == 1)}. '
                f'Two robots or two suites have met: {remedy}')


class _NumberReader:
    """
    Reads the sequence numbers of a topic, through a node that nobody spins.

    The controller's executor has no callbacks that get sequence numbers.
    """

    def __init__(self, owner: Any, topic: str, kind: type) -> None:
        self._numbers = SequenceNumbers()
        self._node: Any = Node(
            f'{owner.get_name()}_doubles', namespace=owner.get_namespace(),
            context=owner.context, use_global_arguments=False, start_parameter_services=False,
            enable_rosout=False)
        self._subscription = self._node.create_subscription(
            kind, topic, lambda _: None, RECORDING_BEST_EFFORT, raw=True)
        self._taker = RclTaker()

    def read(self) -> SequenceNumbers:
        """Take the messages that have arrived; return the numbers of all so far."""
        handle = self._subscription.handle
        with handle:
            for _ in range(_MAX_TAKEN):
                if self._taker.take(handle.pointer, 0) is None:
                    break
                self._numbers.add(self._taker.number)
        return self._numbers

    def close(self) -> None:
        """Unsubscribe."""
        self._taker.close()
        self._node.destroy_node()


class DuplicateMonitor:
    """
    Watches `odom` and `/clock` for a second publisher; where there is one, reads who sends.

    Parameters
    ----------
    node : rclpy.node.Node

    """

    def __init__(self, node: Any) -> None:
        """Subscribe to nothing yet."""
        self._node, self._checker = node, DuplicateChecker()
        self._kinds = {node.resolve_topic_name('odom'): Odometry, '/clock': Clock}
        self._readers: dict[str, _NumberReader] = {}

    def look(self, now: float) -> list[str]:
        """Return a line about each topic with several publishers."""
        lines = [self._look_at(topic, kind, now) for topic, kind in self._kinds.items()]
        return [line for line in lines if line]

    def _look_at(self, topic: str, kind: type, now: float) -> str:
        publishers = self._node.get_publishers_info_by_topic(topic)
        if len(publishers) < 2:
            if reader := self._readers.pop(topic, None):
                reader.close()
            return self._checker.check(topic, publishers, now)
        if topic not in self._readers:
            self._readers[topic] = _NumberReader(self._node, topic, kind)
        return self._checker.check(topic, publishers, now, self._readers[topic].read())
