"""What `/tf` and `/tf_static` of a bag say: which frame is where in which other one, and when."""

import struct

import numpy as np

from episode_store.external.span import Span
from episode_store.rosbag2.reader import Bag
from msgs_bridge.messages.poses import MAX_PLACE, QUATERNION_TOLERANCE
from msgs_bridge.sensing.frame_tree import Edge, Lost, TF_TYPE, Transforms, transforms_in
from msgs_bridge.sensing.rigid_motions import Motions


def topics_of(bag: Bag, namespace: str = '') -> tuple[list[str], str]:
    """
    Return the topics that tell of frames, and why none does.

    Parameters
    ----------
    bag : Bag
    namespace : str
        Where several robots have such topics, that of the robot's others.

    """
    found = sorted(topic for topic, kind in bag.topics.items()
                   if kind == TF_TYPE and bag.counts[topic])
    homes = sorted({topic.rpartition('/')[0] for topic in found})
    if len(homes) > 1 and namespace not in homes:
        return [], f'{" and ".join(found)} are of several robots'
    home = namespace if namespace in homes else ''.join(homes)
    return [topic for topic in found if topic.rpartition('/')[0] == home], ''


def read_transforms(bag: Bag, topics: list[str], span: Span | None = None) -> Transforms:
    """
    Read all transforms of some topics; what is none is left out and counted.

    Parameters
    ----------
    bag : Bag
    topics : list of str
    span : Span, optional
        Of several frames above one, that one counts that is there in this part of the drive.

    """
    tree, rows = Transforms(), dict[str, list[tuple[int, int, str, tuple[float, ...]]]]()
    for topic in topics:
        messages = bag.messages(topic)
        for message, log_time in zip(messages, messages.log_times.tolist(), strict=True):
            try:
                for stamp, parent, child, values in transforms_in(message):
                    rows.setdefault(child, []).append((stamp, log_time, parent, values))
            except (struct.error, UnicodeDecodeError):
                tree.n_refused += 1
    begins = min((row[1] for found in rows.values() if len(found) > 1 for row in found), default=0)
    for child, found in rows.items():
        edge = _edge(child, found, tree, span or Span(), begins)
        if edge is not None:
            tree.edges[child] = edge
    return tree


def _edge(
    child: str, rows: list[tuple[int, int, str, tuple[float, ...]]], tree: Transforms, span: Span,
    begins: int,
) -> Edge | None:
    """Put what is said of a frame in order; of several parents the one that says most."""
    said = np.array([row[1] for row in rows], dtype=np.int64)
    names = [row[2] for row in rows]
    names = [name for name, counts in zip(names, span.holds(said, begins).tolist(), strict=True)
             if counts] or names
    parent = max(sorted(set(names)), key=names.count)
    first_stamp = min(row[0] for row in rows)
    others = [row[2] for row in rows if row[2] != parent]
    rows = [row for row in rows if row[2] == parent]
    values = np.array([row[3] for row in rows])
    length = np.linalg.norm(values[:, 3:], axis=1)
    with np.errstate(invalid='ignore'):
        sound = (np.abs(values[:, :3]) <= MAX_PLACE).all(axis=1)
        sound &= np.abs(length - 1.0) <= QUATERNION_TOLERANCE
    tree.n_refused += int((~sound).sum())
    stamps, logs = (np.array([row[i] for row in rows], dtype=np.int64)[sound] for i in (0, 1))
    values = values[sound]
    if not len(values) or parent == child:
        return None
    why = (f'{child} is under {others[-1]!r} and not {parent!r}' if others else
           f'where {child} is in {parent!r} is no number')
    lost = (Lost(why, int(logs.min()), said[said < logs.min()]),
            Lost(why, int(logs.max()), said[said > logs.max()]))
    _, first = np.unique(stamps, return_index=True)
    turn = values[first, 3:] / length[sound][first, np.newaxis]
    return Edge(parent, child, stamps[first], logs[first], Motions(values[first, :3], turn),
                lost, first_stamp)

