"""Bags of workspaces that fit themselves: drives and trials anywhere."""

from itertools import pairwise

import numpy as np

from bridge_helpers import (
    CLOUD, nanoseconds, ODOMETRY, raw_decisions, raw_odometry, raw_status, STATUS)
from control_field.grid import default_lattice, fitted_workspace, Grid
from control_field.headings import heading_from_step
from control_field.records import DECISION_DTYPE, Kind, Outcome
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.task_folder import EpisodeKind, TaskFolder
from msgs_bridge.messages.trial_status import State

#: The lattice of a robot that begins at (0, 0).
HERE = default_lattice(0.25)
SPEED = 0.2


def way_of(corners):
    """Return stamps [s] and places [m] of a drive along straight lines, at 10 Hz."""
    places = [np.array(corners[:1], dtype=float)]
    for start, end in pairwise(corners):
        n = max(int(np.hypot(*np.subtract(end, start)) / SPEED * 10), 1)
        share = np.arange(1, n + 1)[:, np.newaxis] / n
        places.append(np.array(start) + share * np.subtract(end, start))
    xy = np.concatenate(places)
    return 10.0 + np.arange(len(xy)) * 0.1, xy


def header_of(task: TaskFolder, kind: EpisodeKind, grid: Grid, **more) -> dict[str, str]:
    return dict(EpisodeHeader(kind, task.task, grid, fitted=True, **more).to_mapping())


def demo(task, corners, lattice=HERE, local_grids=(), fitted=True, grid=None, instead=None):
    """
    Record a demonstration along lines; local grids are (stamp, raw message).

    ``instead`` has the places of poses that are wrong, by number.
    """
    stamps, xy = way_of(corners)
    for number, place in (instead or {}).items():
        xy[number] = place
    grid = grid or fitted_workspace(lattice, xy[:1])
    header = EpisodeHeader(EpisodeKind.DEMO, task.task, grid, fitted=fitted).to_mapping()
    with start_bag(task, EpisodeKind.DEMO, header) as bag:
        records = [(stamp, '/odom', ODOMETRY, raw_odometry(stamp, x, y, grid.frame_id))
                   for stamp, (x, y) in zip(stamps.tolist(), xy.tolist(), strict=True)]
        records += [(stamp, '/neighbourhood', 'nav_msgs/msg/OccupancyGrid', raw)
                    for stamp, raw in local_grids]
        for stamp, topic, kind, raw in sorted(records, key=lambda each: each[0]):
            bag.write(topic, kind, raw, nanoseconds(stamp))
    return task.episodes()[-1]


def decisions_along(cells, unknown=255):
    """Return the rows of a trial from cell to cell, half a second each."""
    rows = np.zeros(len(cells) - 1, DECISION_DTYPE)
    cells = np.array(cells)
    rows['row'], rows['col'] = cells[:-1].T
    rows['next_row'], rows['next_col'] = cells[1:].T
    rows['stamp'] = 10.0 + 0.5 * np.arange(len(rows))
    rows['step'], rows['trial'], rows['kind'] = np.arange(len(rows)), 1, Kind.AVOID
    rows['reward'], rows['unknown'] = 1, unknown
    rows['action'] = [heading_from_step(*step) for step in np.diff(cells, axis=0).tolist()]
    return rows


def trial(task, cells, grid, *, driven=None, odometry=None, outcome=Outcome.GOAL,
          local_grids=(), unknown=255):
    """
    Record a trial from cell to cell of ``driven`` (None: ``grid``, that of the header).

    The robot drives from centre to centre, of the cells of ``odometry`` (None: of ``driven``).
    """
    driven = driven or grid
    rows = decisions_along(cells, unknown)
    places = (odometry or driven).world_from_cells(np.array(cells))
    header = header_of(task, EpisodeKind.TRIAL, grid)
    with start_bag(task, EpisodeKind.TRIAL, header) as bag:
        records = [(9.9, '/trial', STATUS, raw_status(State.RUNNING, 1))]
        for i in range(5 * len(rows) + 1):
            share = i / 5 - i // 5
            after = places[min(i // 5 + 1, len(places) - 1)]
            x, y = (1 - share) * places[i // 5] + share * after
            records.append((10.0 + 0.1 * i, '/odom', ODOMETRY, raw_odometry(10 + 0.1 * i, x, y)))
        records += [(float(row['stamp']), '/experience', CLOUD,
                     raw_decisions(rows[i:i + 1], driven)) for i, row in enumerate(rows)]
        records += [(stamp, '/neighbourhood', 'nav_msgs/msg/OccupancyGrid', raw)
                    for stamp, raw in local_grids]
        end = float(rows['stamp'][-1]) + 0.5
        records.append((end, '/trial', STATUS, raw_status(
            State.ENDED, 1, outcome, decisions=len(rows), steps=len(rows), stamp=end)))
        for stamp, topic, kind, raw in sorted(records, key=lambda each: each[0]):
            bag.write(topic, kind, raw, nanoseconds(stamp))
    return task.episodes()[-1]
