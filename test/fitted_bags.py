"""Bags of workspaces that fit themselves: drives and trials anywhere."""

from itertools import pairwise

import numpy as np
from rclpy.serialization import serialize_message

from bridge_helpers import (
    CLOUD, nanoseconds, ODOMETRY, raw_decisions, raw_odometry, raw_status, STATUS)
from control_field.grid import default_lattice, fitted_workspace, Grid
from control_field.headings import heading_from_step
from control_field.records import DECISION_DTYPE, Kind, Outcome
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.task_folder import EpisodeKind, TaskFolder
from msgs_bridge.messages.tables import cloud_from_field, cloud_from_prototypes
from msgs_bridge.messages.trial_status import State
from strategies import segment

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


def demo(task, corners, lattice=HERE, local_grids=(), fitted=True, grid=None, instead=None,
         begins=None):
    """
    Record a demonstration along lines; local grids are (stamp, raw message).

    ``instead`` has the places of poses that are wrong, by number; the bag begins with the field
    of the fold ``begins``.
    """
    stamps, xy = way_of(corners)
    for number, place in (instead or {}).items():
        xy[number] = place
    grid = grid or fitted_workspace(lattice, xy[:1])
    header = EpisodeHeader(EpisodeKind.DEMO, task.task, grid, fitted=fitted).to_mapping()
    with start_bag(task, EpisodeKind.DEMO, header) as bag:
        records = [(stamp, '/odom', ODOMETRY, raw_odometry(stamp, x, y, grid.frame_id))
                   for stamp, (x, y) in zip(stamps.tolist(), xy.tolist(), strict=True)]
        write(bag, records + begun_with(begins), local_grids)
    return task.episodes()[-1]


def write(bag, records, local_grids):
    """Write records in the order of their stamps."""
    records += [(stamp, '/neighbourhood', 'nav_msgs/msg/OccupancyGrid', raw)
                for stamp, raw in local_grids]
    for stamp, topic, kind, raw in sorted(records, key=lambda each: each[0]):
        bag.write(topic, kind, raw, nanoseconds(stamp))


def begun_with(fold):
    """Return what a bag begins with: the field of a fold, and its prototypes."""
    if fold is None or fold.refresh is None:
        return []
    field, prototypes = fold.field(), fold.refresh.prototypes
    return [(9.8, '/control_field', CLOUD, serialize_message(cloud_from_field(field))),
            (9.8, '/prototypes', CLOUD, serialize_message(
                cloud_from_prototypes(prototypes, field.grid)))]


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
          local_grids=(), unknown=255, begins=None):
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
        end = float(rows['stamp'][-1]) + 0.5
        records.append((end, '/trial', STATUS, raw_status(
            State.ENDED, 1, outcome, decisions=len(rows), steps=len(rows), stamp=end)))
        write(bag, records + begun_with(begins), local_grids)
    return task.episodes()[-1]


#: Where trials lead, to the edge of every workspace before, in cells of HERE.
FARTHER = ([(0, 0), (0, 1), (1, 2)], [(0, -1), (0, -8), (-8, -8)], [(12, 20), (15, 23)])


def recorded(task, fold):
    """Record a demonstration and trials that lead farther and farther, learning from each."""
    first = demo(task, [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0)])
    learnt = [fold.learn(Episode(first))]
    for corners in FARTHER:
        cells = np.array(segment(*corners)) + HERE.offset_to(fold.grid)
        bag = trial(task, cells, fold.grid, outcome=Outcome.GAVE_UP, begins=fold)
        learnt.append(fold.learn(Episode(bag)))
    return learnt
