"""A drive to be gone through: where the robot was, what it decided, how it stood, and when."""

from collections.abc import Iterator
from contextlib import suppress
from itertools import groupby
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.topic_tables import local_grid_table, statuses
from msgs_bridge.messages.trial_status import TrialStatus
from page_node.big_frames import bytes_from_frame
from page_node.memory.opened import reading
from page_node.memory.way import commands_at, Way, way_of

#: Changes of state that are sent, at most.
_MOST_STATUSES: Final = 5000

Columns = dict[str, npt.NDArray[Any]]


def replay_of(bags: str, task: str, number: str) -> bytes:
    """
    Return a drive as a big frame.

    Its header has ``name``, ``kind``, ``seconds``, ``resolution``, ``fields`` (when each field
    came into force, [s]), ``statuses`` (see `_status`), ``holes`` (from, to [s]: nothing was
    recorded), ``damage`` and ``note`` (what is wrong with the bag, a word of `Damage.state` and a
    sentence).

    Arrays: of each pose ``t x y yaw`` and ``v w`` (what went to the wheels, NaN for nothing); of
    each decision ``d_t d_x d_y`` (the middle of its cell) ``d_heading d_kind d_reward``; of what
    was seen around the robot, whenever that changed, ``g_t g_x g_y g_blocked g_unknown`` (masks).

    Raises
    ------
    RefusedError
        If there is no such bag, or no drive in it.

    """
    with reading(bags, task, number) as episode:
        way = way_of(episode)
        if not len(way):
            raise NothingToLearnError(episode.path, 'it holds no odometry')
        arrays = {**_poses(episode, way), **_decisions(episode), **_seen(episode)}
        return bytes_from_frame(_header(episode, way), {
            name: array.astype(np.float32) if array.dtype.kind == 'f' else array
            for name, array in arrays.items()})


def _header(episode: Episode, way: Way) -> dict[str, Any]:
    damage = episode.damage
    fields = episode.messages('control_field')
    return {
        'type': 'replay', 'name': episode.folder.name, 'kind': str(episode.folder.kind),
        'seconds': float(way.seconds[-1]), 'resolution': episode.header.grid.resolution,
        'fields': way.second_of(fields.log_times).tolist(),
        'statuses': list(_statuses(episode, way)),
        'holes': [[hole.start, hole.end] for hole in damage.gaps.holes if hole.role == 'odom'],
        'damage': damage.state, 'note': damage.cut or str(damage.gaps)}


def _poses(episode: Episode, way: Way) -> Columns:
    v, w = commands_at(episode, way)
    return {'t': way.seconds, 'x': way.xy[:, 0], 'y': way.xy[:, 1], 'yaw': way.yaw, 'v': v, 'w': w}


def _decisions(episode: Episode) -> Columns:
    rows = episode.decisions
    rows = rows[np.argsort(rows['stamp'], kind='stable')]
    xy = episode.header.grid.world_from_cells(np.stack([rows['row'], rows['col']], axis=1))
    return {'d_t': rows['stamp'] - episode.start, 'd_x': xy[:, 0], 'd_y': xy[:, 1],
            'd_heading': rows['action'], 'd_kind': rows['kind'], 'd_reward': rows['reward']}


def _seen(episode: Episode) -> Columns:
    header = episode.header
    table = local_grid_table(episode.messages('neighbourhood'), header.grid, header.fitted)
    order = np.argsort(table.stamps, kind='stable')
    cells, blocked, unknown = table.cells[order], table.blocked[order], table.unknown[order]
    state = np.column_stack([cells, blocked, unknown])
    kept = np.ones(len(state), dtype=np.bool_)
    kept[1:] = (np.diff(state, axis=0) != 0).any(axis=1)
    xy = header.grid.world_from_cells(cells[kept])
    return {'g_t': table.stamps[order][kept] - episode.start, 'g_x': xy[:, 0], 'g_y': xy[:, 1],
            'g_blocked': blocked[kept], 'g_unknown': unknown[kept]}


def _statuses(episode: Episode, way: Way) -> Iterator[dict[str, Any]]:
    """Yield how it stood, whenever that changed."""
    messages, found = episode.messages('trial'), []
    received = way.second_of(messages.log_times) if len(messages) else np.zeros(0)
    with suppress(BagError, ValueError):
        for i, status in statuses(messages):
            # Its stamp is that of the odometry it answers; it may have been received late.
            second = status.stamp - episode.start if status.stamp else float(received[i])
            found.append((min(max(second, 0.0), float(way.seconds[-1])), status))
    found.sort(key=lambda each: each[0])
    changes = [next(same) for _, same in groupby(found, key=lambda each: _what(each[1]))]
    for second, status in changes[:_MOST_STATUSES]:
        yield _status(second, status)


def _what(status: TrialStatus) -> tuple[object, ...]:
    return status.trial, status.state, status.outcome, status.stop_reason, status.reason


def _status(second: float, status: TrialStatus) -> dict[str, Any]:
    """Return it by name; ``at`` is in seconds, of trial 0 speaks the learner."""
    return {'at': second, 'trial': status.trial, 'state': str(status.state),
            'outcome': str(status.outcome or ''), 'stop_reason': str(status.stop_reason or ''),
            'reason': status.reason}
