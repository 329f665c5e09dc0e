"""
Two publishers where there can be but one.

The graph of ROS names them, but forgets a killed one only after 20 s. What tells is who sends:
each publisher numbers its messages, and of two that send the numbers take turns.
"""

from collections.abc import Iterable
from typing import Any, Final

from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from msgs_bridge.node.graph import full_name, NOT_YET_KNOWN
from msgs_bridge.node.qos import RECORDING_BEST_EFFORT
from msgs_bridge.node.statements import REMEDY
from msgs_bridge.node.take import QuietTaker
from msgs_bridge.untrusted.text import printable

#: For how long two publishers have to be there until that is said, [s]: where nobody is heard to
#: send, and where one of them may have been killed, which the graph forgets after 20 s.
_SURE: Final = 2.0
_SURE_OF_GHOSTS: Final = 25.0
#: So often a publisher has to be heard again after another one until both are known to send.
_RETURNS: Final = 3
#: So many messages in a row may be lost, and so many publishers are told apart.
_MOST_LOST: Final = 1000
_MOST: Final = 16
#: So many messages are taken in one go: that is a few milliseconds.
_MOST_TAKEN: Final = 200


class Senders:
    """Whether one or several send on a topic, by the numbers of their messages."""

    def __init__(self) -> None:
        """Start with nothing heard."""
        #: How many messages with a number have come.
        self.n_heard = 0
        self._n_returns = 0
        self._last: list[int] = []  # number of the last message of each, the latest sender last

    @property
    def are_several(self) -> bool:
        """Tell whether several have sent in turns; one that was started anew never comes back."""
        return self._n_returns >= _RETURNS

    def saw(self, number: int | None) -> None:
        """Take in the number that its publisher gave a message; None where there are none."""
        if not number:
            return
        self.n_heard += 1
        before = [last for last in self._last if last < number <= last + _MOST_LOST]
        if before:
            sender = max(before)
            self._n_returns += sender != self._last[-1]
            self._last.remove(sender)
        self._last = [*self._last, number][-_MOST:]


class Doubles:
    """Two publishers of one topic, as the graph of ROS and what they send have them."""

    def __init__(self) -> None:
        """Start with none."""
        self._since: dict[str, float] = {}

    def look(
        self, topic: str, publishers: Iterable[Any], now: float, senders: Senders | None = None,
    ) -> str:
        """
        Say that several publish on a topic; empty if not, or if one may only be a ghost.

        Parameters
        ----------
        topic : str
            Full name.
        publishers : iterable of TopicEndpointInfo
        now : float, [s]
        senders : Senders, optional
            What was heard since there are several.

        """
        peers = [peer for peer in publishers if peer.node_name != NOT_YET_KNOWN]
        if len(peers) < 2:
            self._since.pop(topic, None)
            return ''
        waited = now - self._since.setdefault(topic, now)
        names = sorted({full_name(peer) for peer in peers})
        processes = {bytes(peer.endpoint_gid[:12]) for peer in peers}
        are_heard = senders is not None and senders.are_several
        # Of those that are silent, one may be a ghost if it is called like the other; of those
        # of which one alone is heard, however they are called.
        is_open = len(processes) > 1 and (
            len(names) == 1 or (senders is not None and senders.n_heard > 0))
        if not are_heard and waited < (_SURE_OF_GHOSTS if is_open else _SURE):
            return ''
        who = ' and '.join(map(printable, names[:4]))
        remedy = ('give each suite a ROS_DOMAIN_ID of its own, or set publish_clock:=false for '
                  'all but one') if topic == '/clock' else REMEDY
        return (f'{len(peers)} publish {topic}: {who}{" more than once" * (len(names) == 1)}. '
                f'Two robots or two suites have met: {remedy}')


class _Ear:
    """
    Hears who sends on a topic, in a node that nobody spins.

    The controller's executor has no callbacks that are told the numbers of messages.
    """

    def __init__(self, owner: Any, topic: str, kind: type) -> None:
        self.senders = Senders()
        self._node: Any = Node(
            f'{owner.get_name()}_doubles', namespace=owner.get_namespace(),
            context=owner.context, use_global_arguments=False, start_parameter_services=False,
            enable_rosout=False)
        self._subscription = self._node.create_subscription(
            kind, topic, lambda _: None, RECORDING_BEST_EFFORT, raw=True)
        self._taker = QuietTaker()

    def listen(self) -> Senders:
        """Take what has come; return who sends."""
        handle = self._subscription.handle
        with handle:
            for _ in range(_MOST_TAKEN):
                if self._taker.take(handle.pointer, 0) is None:
                    break
                self.senders.saw(self._taker.number)
        return self.senders

    def close(self) -> None:
        """Hear no more."""
        self._taker.close()
        self._node.destroy_node()


class DuplicateMonitor:
    """
    Looks for two publishers of `odom` and of `/clock`; where there are, it listens who sends.

    Parameters
    ----------
    node : rclpy.node.Node
        In whose name.

    """

    def __init__(self, node: Any) -> None:
        """Hear nothing yet."""
        self._node, self._doubles = node, Doubles()
        self._kinds = {node.resolve_topic_name('odom'): Odometry, '/clock': Clock}
        self._ears: dict[str, _Ear] = {}

    def look(self, now: float) -> list[str]:
        """Say of which topics there are several publishers."""
        said = [self._look_at(topic, kind, now) for topic, kind in self._kinds.items()]
        return [text for text in said if text]

    def _look_at(self, topic: str, kind: type, now: float) -> str:
        publishers = self._node.get_publishers_info_by_topic(topic)
        if len(publishers) < 2:
            if ear := self._ears.pop(topic, None):
                ear.close()
            return self._doubles.look(topic, publishers, now)
        if topic not in self._ears:
            self._ears[topic] = _Ear(self._node, topic, kind)
        return self._doubles.look(topic, publishers, now, self._ears[topic].listen())
