"""Who else is on a topic, by the names that the graph of ROS has for them."""

from typing import Any, Final

from msgs_bridge.foreign_text import printable

#: What the graph calls a node that it has not heard the name of yet.
NOT_YET_KNOWN: Final = '_NODE_NAME_UNKNOWN_'


def publishers_on(node: Any, topic: str) -> list[str]:
    """
    Return the full names of the other nodes that publish on a topic, each once.

    Parameters
    ----------
    node : rclpy.node.Node
        This node; it is left out.
    topic : str
        Relative, as the node has it before remapping.

    """
    own = node.get_fully_qualified_name()
    names = {full_name(peer) for peer in node.get_publishers_info_by_topic(
        node.resolve_topic_name(topic)) if peer.node_name != NOT_YET_KNOWN}
    return sorted(map(printable, names - {own}))


def full_name(peer: Any) -> str:
    """Return the name of the node that an endpoint belongs to, with its namespace."""
    return f'{peer.node_namespace.rstrip("/")}/{peer.node_name}'
