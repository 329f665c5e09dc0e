"""Which of several topics of odometry is the robot's: the one that `/tf` repeats."""

from collections.abc import Sequence

import numpy as np

from episode_store.external.drive_poses import poses_from_messages
from episode_store.external.transforms import read_transforms, topics_of
from episode_store.rosbag2.reader import Bag
from msgs_bridge.sensing.frame_tree import Transforms

#: Places that differ by less are the same, [m]; so many of them are compared.
_SAME, _SOME = 0.02, 200


def repeated_by_frames(bag: Bag, topics: Sequence[str]) -> str | None:
    """
    Return the only one of some topics whose poses are those that `/tf` gives; None if none is.

    Parameters
    ----------
    bag : Bag
    topics : sequence of str
        Of Odometry.

    """
    homes, _ = topics_of(bag)
    if not homes:
        return None
    tree = read_transforms(bag, homes)
    found = [topic for topic in topics if _is_repeated(bag, topic, tree)]
    return found[0] if len(found) == 1 else None


def _is_repeated(bag: Bag, topic: str, tree: Transforms) -> bool:
    poses = poses_from_messages(bag.messages(topic))
    edge = tree.edges.get(poses.base)
    if edge is None or edge.parent != poses.frame_id or len(edge.stamps_ns) < 2:
        return False
    known = np.flatnonzero((poses.stamps_ns >= edge.stamps_ns[0])
                           & (poses.stamps_ns <= edge.stamps_ns[-1]))
    some = known[::max(len(known) // _SOME, 1)]
    off = np.linalg.norm(edge.at(poses.stamps_ns[some]).shift - poses.motions.shift[some], axis=1)
    return bool(len(some)) and bool(np.median(off) < _SAME)
