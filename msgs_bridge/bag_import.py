"""Drives that other recorders recorded, taken over as demonstrations of a task."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from control_field.grid import Grid
from control_field.plausibility import SPEED_MAX
from msgs_bridge.any_bag import open_bag
from msgs_bridge.bag_file import BagWriter
from msgs_bridge.bag_folder import BagError
from msgs_bridge.bag_making import NewBags
from msgs_bridge.bag_records import Bag
from msgs_bridge.episode_header import EpisodeHeader
from msgs_bridge.episodes import read_foreign_demonstration

#: Types that a topic may have to stand for a role, the most likely first.
ROLES: Final = {
    'odom': ('nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseStamped',
             'geometry_msgs/msg/PoseWithCovarianceStamped'),
    'neighbourhood': ('nav_msgs/msg/OccupancyGrid',),
    'cmd_vel': ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped')}


def roles_of_topics(bag: Bag, names: Mapping[str, str]) -> dict[str, str]:
    """
    Return which topic of a bag stands for which role.

    A role that is not named is played by the topic whose name ends in it, `odom` also by the
    only Odometry, or else the only one of its types.

    Parameters
    ----------
    bag : Bag
    names : mapping of str to str
        Topics by role, see `ROLES`; with or without the leading slash.

    Raises
    ------
    BagError
        If there is no such topic, it has another type, or nobody knows which one is `odom`; the
        message names those there are.

    """
    found = {role: _named(bag, role, name) for role, name in names.items()}
    for role in ROLES.keys() - names.keys():
        fitting = _fitting(bag, role)
        ending = [topic for topic in fitting if topic.rpartition('/')[2] == role]
        picked = ending or (_likely(bag, fitting) if role == 'odom' else [])
        if len(picked) == 1:
            found[role] = picked[0]
        elif role == 'odom' and fitting:
            raise BagError(f'{bag.path}: which topic is odom? Name one of {_choices(bag, role)} '
                           f'with --odom-topic')
        elif role == 'odom':
            raise BagError(f'{bag.path}: no topic is odom, there are {_choices(bag, role)}')
    return found


def _likely(bag: Bag, topics: list[str]) -> list[str]:
    """Leave only those of the likeliest type that there is for `odom`."""
    odometry = [topic for topic in topics if bag.topics[topic] == ROLES['odom'][0]]
    return odometry or topics


@dataclass(frozen=True, eq=False)
class ForeignDrive:
    """
    A drive that another recorder recorded, and that teaches something.

    Parameters
    ----------
    path : Path
        As it was named.
    bag : Bag
    topics : dict of str to str
        Topics by role.

    """

    path: Path
    bag: Bag
    topics: dict[str, str]


def check_drive(
    path: Path | str, grid: Grid, names: Mapping[str, str], speed_max: float = SPEED_MAX,
) -> ForeignDrive:
    """
    Make sure that a foreign bag teaches something in a workspace.

    Parameters
    ----------
    path : Path
        The foreign bag, see `open_bag`.
    grid : Grid
    names : mapping of str to str
        Topics by role, see `roles_of_topics`.
    speed_max : float, [m/s]
        A robot that drives faster is none.

    Raises
    ------
    BagError
        If it cannot be read, or teaches nothing in that workspace.

    """
    bag = open_bag(path)
    topics = roles_of_topics(bag, names)
    read_foreign_demonstration(path, grid, topics, speed_max=speed_max)
    return ForeignDrive(Path(path), bag, topics)


def import_demonstration(drive: ForeignDrive, bags: NewBags, header: EpisodeHeader) -> None:
    """
    Write what matters of a foreign bag into the next bag of a task, bytes as they are.

    Parameters
    ----------
    drive : ForeignDrive
        Was checked in the header's workspace.
    bags : NewBags
        Those in the making; it is one of the task once they are kept.
    header : EpisodeHeader
        Workspace and parameters of the new bag, and its task.

    Raises
    ------
    BagError
        If it cannot be read any more, or not be written.

    """
    values = EpisodeHeader(
        header.kind, header.task, header.grid, header.parameters, drive.topics,
        header.speed_max).to_mapping()
    _copy(drive.bag, drive.topics,
          bags.begin(header.kind, {**values, 'imported_from': drive.path.name}))


def _copy(bag: Bag, topics: Mapping[str, str], writer: BagWriter) -> None:
    """Write the messages of some topics in the order they were recorded."""
    tables = [bag.messages(topic) for topic in sorted(set(topics.values()))]
    times = np.concatenate([table.log_times for table in tables])
    which = np.repeat(np.arange(len(tables)), [len(table) for table in tables])
    rows = np.concatenate([np.arange(len(table)) for table in tables])
    for place in np.argsort(times, kind='stable').tolist():
        table = tables[which[place]]
        writer.write(table.topic, table.type_name, table[int(rows[place])], int(times[place]))


def _named(bag: Bag, role: str, name: str) -> str:
    topic = name if name in bag.topics else f'/{name.lstrip("/")}'
    if topic not in bag.topics:
        raise BagError(f'{bag.path} has no topic {name} ({role}), there are '
                       f'{_choices(bag, role)}')
    if not bag.counts[topic]:
        raise BagError(f'{bag.path}: there is no message on {topic} ({role}), there are '
                       f'{_choices(bag, role)}')
    if bag.topics[topic] not in ROLES[role]:
        raise BagError(f'{bag.path}: {topic} is {bag.topics[topic]}, {role} must be '
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
