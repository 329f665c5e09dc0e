"""Who has the other type of velocity message on a topic: Twist against TwistStamped."""

from typing import Any, Final

from msgs_bridge.node.graph import NOT_YET_KNOWN

#: Who reads `cmd_vel` and is no robot.
_RECORDER: Final = 'learner_node'


def remedy(kind: str) -> str:
    """Return what a node that has Twist or TwistStamped is to be set to for the other one."""
    return f'set enable_stamped_cmd_vel:={str(not kind.endswith("Stamped")).lower()}'


def remedy_for_publisher(kind: str) -> str:
    """Return how others that publish commands are started to have this type."""
    stamped = str(kind.endswith('Stamped')).lower()
    return (f'start it with stamped:={stamped} (teleop_twist_keyboard), publish_stamped_twist:='
            f'{stamped} (teleop_twist_joy) or enable_stamped_cmd_vel:={stamped} (teleop_node)')


def mismatch(node: Any, topic: str, kind: type) -> str:
    """
    Say in one line who has the other type on a topic, and which parameter to set.

    What the robot reads on `cmd_vel` decides whose parameter that is: where it has the type of
    this node, the one of whoever publishes the other.

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
    readers = node.get_subscriptions_info_by_topic(node.resolve_topic_name('cmd_vel'))
    found = [
        f'{peer.node_name} {verb} {topic} as {peer.topic_type}'
        for verb, peers in (('publishes', node.get_publishers_info_by_topic(name)),
                            ('subscribes to', node.get_subscriptions_info_by_topic(name)))
        for peer in peers if peer.topic_type != mine and peer.node_name != NOT_YET_KNOWN]
    if not found:
        return ''
    line = f'{" and ".join(dict.fromkeys(found))} but this node has {mine}'
    robots = [peer for peer in readers if peer.node_name not in (NOT_YET_KNOWN, _RECORDER)
              and (peer.node_name, peer.node_namespace) != (
                  node.get_name(), node.get_namespace())]
    if robots and all(peer.topic_type == mine for peer in robots):
        line += f', as {robots[0].node_name} has, which reads cmd_vel'
        return f'{line}: {remedy_for_publisher(mine)}'
    return f'{line}: {remedy(mine)}'
