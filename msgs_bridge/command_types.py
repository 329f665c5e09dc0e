"""Who has the other type of velocity message on a topic: Twist against TwistStamped."""

from typing import Any, Final

#: What the graph calls a node that it has not heard the name of yet.
_NOT_YET_KNOWN: Final = '_NODE_NAME_UNKNOWN_'


def remedy(kind: str) -> str:
    """Return what a node that has Twist or TwistStamped is to be set to for the other one."""
    return f'set enable_stamped_cmd_vel:={str(not kind.endswith("Stamped")).lower()}'


def mismatch(node: Any, topic: str, kind: type) -> str:
    """
    Say in one line who has the other type on a topic, and which parameter to set.

    Parameters
    ----------
    node : Node
        This node.
    topic : str
        Name of the topic, relative.
    kind : type
        Message that this node has there, Twist or TwistStamped.

    Returns
    -------
    str
        Empty if all have the same.

    """
    name, mine = node.resolve_topic_name(topic), f'geometry_msgs/msg/{kind.__name__}'
    found = [
        f'{peer.node_name} {verb} {topic} as {peer.topic_type}'
        for verb, peers in (('publishes', node.get_publishers_info_by_topic(name)),
                            ('subscribes to', node.get_subscriptions_info_by_topic(name)))
        for peer in peers if peer.topic_type != mine and peer.node_name != _NOT_YET_KNOWN]
    if not found:
        return ''
    return f'{" and ".join(dict.fromkeys(found))} but this node has {mine}: {remedy(mine)}'
