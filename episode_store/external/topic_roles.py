"""Which topic of a bag that others recorded plays which role."""

from collections.abc import Mapping, Sequence
from typing import Final

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag
from msgs_bridge.sensing.frame_tree import TF_TYPE

#: Types that a topic may have to stand for a role, the most likely first.
ROLES: Final = {
    'odom': ('nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseStamped',
             'geometry_msgs/msg/PoseWithCovarianceStamped', TF_TYPE),
    'neighbourhood': ('nav_msgs/msg/OccupancyGrid',),
    'scan': ('sensor_msgs/msg/LaserScan',),
    'cmd_vel': ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped')}
#: Poses that say where somebody wants the robot to be.
_WISHES: Final = ('goal', 'goal_pose', 'initialpose')


class WhichOdometryError(BagError):
    """
    Several topics may say where the robot was.

    Parameters
    ----------
    message : str
    topics : sequence of str
        Those of Odometry among them.

    """

    def __init__(self, message: str, topics: Sequence[str]) -> None:
        """Keep both."""
        super().__init__(message)
        self.topics = topics


def roles_of_topics(
    bag: Bag, names: Mapping[str, str], with_frames: bool = True,
) -> dict[str, str]:
    """
    Return which topic of a bag stands for which role; those without messages do not count.

    A role that is not named is played by the topic whose name ends in it; `odom` also by the
    only Odometry, else by `tf`, else by the only one of its types; `scan` by the only LaserScan.

    Parameters
    ----------
    bag : Bag
    names : mapping of str to str
        Topics by role, see `ROLES`; with or without the leading slash.
    with_frames : bool
        Whether `tf` may stand for `odom` without being named.

    Raises
    ------
    WhichOdometryError
        If nobody knows which one is `odom`; the message names those there are.
    BagError
        If there is no such topic, or it has another type.

    """
    found = {role: _named(bag, role, name) for role, name in names.items()}
    for role in ROLES.keys() - names.keys():
        fitting = [topic for topic in _fitting(bag, role) if is_meant(bag, topic, with_frames)]
        ending = [topic for topic in fitting if topic.rpartition('/')[2] == role]
        picked = ending or (_likely(bag, fitting) if role in ('odom', 'scan') else [])
        if len(picked) == 1:
            found[role] = picked[0]
        elif role == 'odom' and fitting:
            raise WhichOdometryError(
                f'which topic is odom? Name one of {_choices(bag, role)} with --odom-topic',
                [topic for topic in picked if bag.topics[topic] == ROLES['odom'][0]])
        elif role == 'odom':
            raise BagError(f'no topic is odom, there are {_choices(bag, role)}')
    return found


def why_odom(bag: Bag, topic: str, is_named: bool) -> str:
    """Say why a topic plays the role of `odom`."""
    if is_named:
        return 'it was named'
    if topic.rpartition('/')[2] == 'odom':
        return 'it is called so'
    if bag.topics[topic] == ROLES['odom'][0]:
        n = [bag.topics[each] for each in _fitting(bag, 'odom')].count(bag.topics[topic])
        return 'it is the only Odometry' + (' that /tf repeats' if n > 1 else '')
    if bag.topics[topic] == TF_TYPE:
        return 'no topic is Odometry'
    return 'it is the only one with poses'


def pose_topics(bag: Bag) -> list[str]:
    """Return the topics that may say where something was, those for `odom` first."""
    return sorted(_fitting(bag, 'odom'), key=lambda topic: (
        topic.rpartition('/')[2] in _WISHES, ROLES['odom'].index(bag.topics[topic])))


def scans_in(bag: Bag) -> list[str]:
    """Return the topics that a local grid could be made from."""
    return _fitting(bag, 'scan')


def is_meant(bag: Bag, topic: str, with_frames: bool = True) -> bool:
    """Return whether a topic of a fitting type may be taken without being named."""
    name = topic.rpartition('/')[2]
    if bag.topics[topic] == TF_TYPE:
        return with_frames and name == 'tf'
    return name not in _WISHES


def _likely(bag: Bag, topics: list[str]) -> list[str]:
    """Leave only those of the likeliest type that there is for `odom`."""
    for kind in (ROLES['odom'][0], TF_TYPE):
        if found := [topic for topic in topics if bag.topics[topic] == kind]:
            return found
    return topics


def _named(bag: Bag, role: str, name: str) -> str:
    topic = name if name in bag.topics else f'/{name.lstrip("/")}'
    if topic not in bag.topics:
        raise BagError(f'it has no topic {name} ({role}), there are '
                       f'{_choices(bag, role)}')
    if not bag.counts[topic]:
        raise BagError(f'there is no message on {topic} ({role}), there are '
                       f'{_choices(bag, role)}')
    if bag.topics[topic] not in ROLES[role]:
        raise BagError(f'{topic} is {bag.topics[topic]}, {role} must be '
                       f'{" or ".join(ROLES[role])}; there are {_choices(bag, role)}')
    return topic


def _fitting(bag: Bag, role: str) -> list[str]:
    return sorted(topic for topic, kind in bag.topics.items()
                  if kind in ROLES[role] and bag.counts[topic])


def _choices(bag: Bag, role: str) -> str:
    fitting = [f'{topic} ({bag.topics[topic].rpartition("/")[2]})'
               for topic in _fitting(bag, role)]
    if fitting:
        return ', '.join(fitting)
    others = ', '.join(f'{topic} ({kind})' for topic, kind in sorted(bag.topics.items())
                       if bag.counts[topic])
    others = others or 'none at all'
    return f'none of type {" or ".join(ROLES[role])} (topics: {others})'
