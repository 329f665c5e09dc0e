"""Who else publishes commands, and as which type."""

from typing import Any

from msgs_bridge.node.command_types import mismatch
from msgs_bridge.node.graph import full_name


class CommandPublishers:
    """
    The publishers of `cmd_vel`, as the graph of ROS has them.

    Parameters
    ----------
    node : rclpy.node.Node
    kind : type
        Message that this node has on `cmd_vel` and `cmd_vel_teleop`.

    Attributes
    ----------
    others : list of str
        Full names of the other nodes that publish.
    mismatch : str
        One line about peers with the other type; empty if there are none.

    """

    def __init__(self, node: Any, kind: type) -> None:
        """Start alone."""
        self.others: list[str] = []
        self.mismatch = ''
        self._node, self._kind = node, kind
        self._name = node.resolve_topic_name('cmd_vel')
        self._n_publishers = 0

    @property
    def have_changed(self) -> bool:
        """Return whether there are more or fewer publishers than at the last update."""
        return bool(self._node.count_publishers(self._name) != self._n_publishers)

    @property
    def have_namesake(self) -> bool:
        """Return whether another publisher is called like this node, in whatever namespace."""
        own = self._node.get_name()
        return any(other.rpartition('/')[2] == own for other in self.others)

    def update(self) -> str:
        """Look at the graph; return a line to log if there is a new mismatch."""
        publishers = self._node.get_publishers_info_by_topic(self._name)
        self._n_publishers = len(publishers)
        self.others = [full_name(peer) for peer in publishers]
        own = self._node.get_fully_qualified_name()
        if own in self.others:
            self.others.remove(own)
        before = self.mismatch
        self.mismatch = (mismatch(self._node, 'cmd_vel', self._kind)
                         or mismatch(self._node, 'cmd_vel_teleop', self._kind))
        return self.mismatch if self.mismatch != before else ''
