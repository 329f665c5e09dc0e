"""Who publishes on a topic, by the graph of ROS."""

from collections.abc import Iterable, Sequence
from typing import Any, Final

from msgs_bridge.untrusted.text import printable

#: What the graph calls a node whose name is not known yet.
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


def type_conflict(topic: str, publishers: Iterable[Any], kind: str) -> str:
    """
    Return a line if all publishers of a topic have another type than is read; else nothing.

    Parameters
    ----------
    topic : str
        Full name.
    publishers : iterable of TopicEndpointInfo
    kind : str
        The type that is read, as the graph has it.

    """
    peers = [peer for peer in publishers
             if peer.node_name != NOT_YET_KNOWN and peer.topic_type]
    if not peers or any(peer.topic_type == kind for peer in peers):
        return ''
    found = sorted({f'{printable(full_name(peer))} publishes it as '
                    f'{printable(peer.topic_type, 80)}' for peer in peers})
    return (f'nothing of use can arrive on {topic}: {" and ".join(found[:4])}, must be {kind}; '
            f'remap it (-r), or start what publishes that')


def found_elsewhere(topic: str, kind: str, known: Iterable[tuple[str, Sequence[str]]]) -> str:
    """
    Return a line if a topic without publishers is published under another name; else nothing.

    Parameters
    ----------
    topic : str
        Full name.
    kind : str
        The type that is read, as the graph has it.
    known : iterable of (str, sequence of str)
        All topics that are published, with their types.

    """
    last = topic.rpartition('/')[2]
    found = sorted(name for name, kinds in known
                   if name != topic and kind in kinds and name.rpartition('/')[2] == last)
    if not found:
        return ''
    name = printable(found[0])
    namespace = name.rpartition('/')[0] or '/'
    return (f'nobody publishes {topic}, but there is {" and ".join(map(printable, found[:4]))}: '
            f'if that is this robot, start this node with -r __ns:={namespace}, or with '
            f'-r {last}:={name}')


def full_name(peer: Any) -> str:
    """Return the name of the node that an endpoint belongs to, with its namespace."""
    return f'{peer.node_namespace.rstrip("/")}/{peer.node_name}'
