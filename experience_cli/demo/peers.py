"""Which of the demo's nodes are not there yet, and how they are started."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

COMMAND_TYPE: Final = 'geometry_msgs/msg/TwistStamped'
_STAMPED: Final = '-p enable_stamped_cmd_vel:=true'
#: The nodes that are needed, and what else they are started with.
_NODES: Final = {
    'sim_node': '', 'control_field_node': '',
    'learner_node': ' -p simulation:=true -p task:=task1'}
#: Topics that the learner must have received before it can record.
_NEEDED: Final = ('odom', 'neighbourhood', 'trial')


def absent_nodes(names: Iterable[str]) -> list[str]:
    """Return which nodes are missing, given the names of those that are there."""
    there = set(names)
    return [name for name in _NODES if name not in there]


def what_is_missing(absent: list[str], has_odometry: bool, learner: Mapping[str, str]) -> str:
    """
    Say in a few words what is waited for.

    Parameters
    ----------
    absent : list of str
        Nodes that are not there.
    has_odometry : bool
        Whether a message has arrived on `odom`.
    learner : mapping of str to str
        Its values on `/diagnostics`; empty if none have arrived yet.

    """
    if absent:
        return listed(absent)
    if not has_odometry:
        return 'odometry on odom'
    if not learner:
        return 'the state of learner_node on /diagnostics'
    if learner.get('phase') != 'idle':
        return f'learner_node, which is busy: {learner.get("doing", "")}'
    missing = [name for name in _NEEDED if name not in learner.get('heard', '').split()]
    if missing:
        return f'learner_node to hear {listed(missing)}'
    return 'the nodes to find each other on cmd_vel and initialpose'


def start_hint(absent: list[str], namespace: str) -> str:
    """Return the commands that start what is missing, for a person to copy."""
    place = '' if namespace == '/' else f' -r __ns:={namespace}'
    return ' and '.join(
        f'`{name} --ros-args{place} {_STAMPED}{_NODES[name]}`' for name in absent)


def mistyped(subscriptions: Iterable[Any]) -> str:
    """Say which of the nodes reads `cmd_vel` as another type; empty if none does."""
    for info in subscriptions:
        if info.node_name in _NODES and info.topic_type != COMMAND_TYPE:
            return (f'{info.node_name} reads cmd_vel as {info.topic_type}, the demonstration is '
                    f'driven with {COMMAND_TYPE}: start the nodes with {_STAMPED}')
    return ''


def listed(words: list[str]) -> str:
    """Return words as people list them."""
    return ' and '.join(filter(None, (', '.join(words[:-1]), words[-1])))
