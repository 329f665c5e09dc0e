"""The field that was in force at a moment of a drive, and the prototypes that it is made of."""

import numpy as np

from control_field.robot.policy import rules_of
from episode_store.episode import Episode
from page_node.big_frames import bytes_from_frame
from page_node.field_frames import field_frame, Frame, ground_frame, prototypes_frame
from page_node.memory.ground import ground_seen
from page_node.memory.opened import reading


def field_at(bags: str, task: str, number: str, at: float) -> bytes:
    """
    Return the field at a second of a drive, as a big frame.

    Where none was recorded it points nowhere, has revision -1, and its ground is what the local
    grids of the whole drive show.

    Raises
    ------
    RefusedError
        If there is no such bag, or it cannot be read.

    """
    with reading(bags, task, number) as episode:
        field = episode.field(_log_time(episode, at))
        frame = ground_frame(*ground_seen(episode)) if field is None else (
            field_frame(field, rules_of(episode.header.parameters)))
        return _written('field', frame)


def prototypes_at(bags: str, task: str, number: str, at: float) -> bytes:
    """Return the prototypes at a second of a drive, none where none were recorded."""
    with reading(bags, task, number) as episode:
        end = _log_time(episode, at)
        field, prototypes = episode.field(end), episode.prototypes(end)
        if field is None or prototypes is None:
            return bytes_from_frame({'type': 'prototypes'}, {
                name: np.zeros(0, dtype=kind) for name, kind in (
                    ('x', 'f4'), ('y', 'f4'), ('q', 'f4'), ('heading', 'i1'),
                    ('demonstrated', 'u1'))})
        return _written('prototypes', prototypes_frame(prototypes, field.grid))


def _written(kind: str, frame: Frame) -> bytes:
    header, arrays = frame
    return bytes_from_frame({'type': kind, **header}, arrays)


def _log_time(episode: Episode, at: float) -> int | None:
    """Return when the last odometry at a second was received, [ns]; None for the end."""
    poses = episode.poses
    if not len(poses.stamps):
        return None
    before = np.flatnonzero(poses.stamps <= episode.start + at + 1e-6)
    # What was in force at the first odometry may have been recorded before it, or just after.
    return max(int(poses.log_times[before[-1]] if len(before) else 0), int(poses.log_times[0]))
