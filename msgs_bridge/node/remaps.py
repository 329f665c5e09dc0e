"""Remappings (``-r FROM:=TO``) that change nothing: ROS drops them without a word."""

from collections.abc import Collection, Iterable, Sequence
from typing import Any, Final

from msgs_bridge.node.close_names import close_name

#: What can be set of a node by a remapping.
_SPECIAL: Final = ('__ns', '__node', '__name')
#: Topics that other nodes of ours have, or that launch files remap for all: no slip of the pen.
_OF_OTHERS: Final = frozenset({
    'amcl_pose', 'clock', 'cmd_vel', 'cmd_vel_requested', 'cmd_vel_teleop', 'contact',
    'control_field', 'costmap', 'diagnostics', 'experience', 'goal_pose', 'initialpose',
    'localised_odom', 'map', 'markers', 'neighbourhood', 'odom', 'prototypes', 'robot_description',
    'joint_states', 'scan', 'teleop_heartbeat', 'tf', 'tf_static', 'trial'})
#: From how many letters on a topic's name may be off by one, and by two.
_LETTERS: Final = (4, 10)
#: Topics that this process subscribes to for its node, through another node or thread.
_other_subscriptions: Final[set[str]] = set()


def note_subscription(topic: str) -> None:
    """Note a subscription of this process beside its node, by the full name of the topic."""
    _other_subscriptions.add(topic)


def problem_with_special(rules: Iterable[str]) -> str:
    """Say that a remapping sets something of a node that there is not; empty if none does."""
    for rule in rules:
        name = rule.partition(':=')[0].rpartition(':')[2]
        if name.startswith('__') and name not in _SPECIAL:
            near = close_name(name, _SPECIAL, (2, 6)) or ' or '.join(_SPECIAL[:2])
            return f'-r {rule}: there is no {name} to set, is {near} meant?'
    return ''


def idle_rules(
    rules: Sequence[str], node: Any, program: str,
) -> tuple[list[str], list[str]]:
    """
    Return what to say of remappings that change nothing of a node.

    Parameters
    ----------
    rules : sequence of str
        As they were given, such as ``odom:=wheels/odom``.
    node : rclpy.node.Node
        With all its topics and services.
    program : str
        Name of its executable.

    Returns
    -------
    warnings, notes : list of str
        Of those that are mistakes; and of those that may be meant for other nodes.

    """
    warnings: list[str] = []
    notes: list[str] = []
    names = names_of(node)
    known = {*_short(names, node), *_OF_OTHERS}
    for rule in rules:
        source, _, target = rule.partition(':=')
        whose, _, name = source.removeprefix('rostopic://').removeprefix(
            'rosservice://').rpartition(':')
        if name.startswith('__'):
            continue
        if whose and whose not in (node.get_name(), program):
            warnings.append(f'-r {rule} is for a node {whose}, this one is {node.get_name()}: it '
                            f'changes nothing')
        elif node.resolve_topic_name(target, only_expand=True) not in names:
            line = f'-r {rule} changes nothing: {node.get_name()} has no {name}'
            near = close_name(name.strip('/'), known, _LETTERS)
            is_others = name.strip('/') in _OF_OTHERS
            (notes if is_others else warnings).append(
                line if is_others or near is None else f'{line}, is {near} meant?')
    return warnings, notes


def names_of(node: Any) -> set[str]:
    """Return the full names of a node's topics and services, after remapping."""
    topics = {end.topic_name for end in (*node.publishers, *node.subscriptions)}
    services = {service.service_name if hasattr(service, 'service_name') else service.srv_name
                for service in (*node.services, *node.clients)}
    return topics | services | _other_subscriptions


def _short(names: Collection[str], node: Any) -> list[str]:
    """Return names as people write them: relative to the namespace, private ones with a tilde."""
    own, namespace = node.get_fully_qualified_name() + '/', node.get_namespace().rstrip('/') + '/'
    return sorted(f'~/{name.removeprefix(own)}' if name.startswith(own)
                  else name.removeprefix(namespace).lstrip('/') for name in names)
