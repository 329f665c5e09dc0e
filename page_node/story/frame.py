"""A picture of the field's history: what was in force after an episode, and its way."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.robot.policy import rules_of
from page_node.big_frames import bytes_from_frame
from page_node.field_frames import field_frame, Frame
from page_node.memory.opened import folder_of, folders_of, reading, task_of
from page_node.memory.way import way_of
from page_node.story.story import bag_after

#: Points of a way: a picture is small.
_MOST_POINTS: Final = 600


def frame_after(bags: str, task: str, number: str) -> bytes:
    """
    Return the field that was in force after an episode, as a big frame like that of the live one.

    It is the newest that the bag after it holds. Its header has ``number`` as well, its arrays
    ``way_x way_y``, where the robot went in the episode, [m]. Without such a bag the way is all
    there is: the field is the live one, if any.

    Raises
    ------
    RefusedError
        Whatever opening a bag may come to.

    """
    folder = folder_of(bags, task, number)
    way = _way(bags, task, number)
    header, arrays = _field_after(bags, task, folder.number)
    return bytes_from_frame(
        {'type': 'story_field', 'number': folder.number, **header},
        {**arrays, 'way_x': way[:, 0], 'way_y': way[:, 1]})


def _field_after(bags: str, task: str, number: int) -> Frame:
    after, _ = bag_after(folders_of(task_of(bags, task)), number)
    if after is None:
        return {}, {}
    with reading(bags, task, str(after.number)) as episode:
        field = episode.field()
        if field is None:  # it holds prototypes alone
            return {}, {}
        return field_frame(field, rules_of(episode.header.parameters))


def _way(bags: str, task: str, number: str) -> npt.NDArray[np.float32]:
    """Return where the robot went in an episode, in few points, shape (n, 2)."""
    with reading(bags, task, number) as episode:
        xy = way_of(episode).xy.astype(np.float32)
    if not len(xy):
        return xy
    return xy[np.unique(np.linspace(0, len(xy) - 1, _MOST_POINTS).astype(np.int64))]
