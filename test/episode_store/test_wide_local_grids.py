"""Bags whose local grids show more than the cells around the robot: what of them is learnt."""

import numpy as np
import pytest

from bridge_helpers import (
    content_of, demonstration_bag, GRID, nanoseconds, OCCUPANCY, ODOMETRY, raw_decisions,
    raw_local_grid, raw_odometry, raw_status, spoil, STATUS, trial_bag)
from control_field.records import DECISION_DTYPE, Outcome
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import relearn
from episode_store.task_folder import TaskFolder
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.serialized import cdr_from_message
from msgs_bridge.messages.trial_status import State

#: A robot that drives along row 5 from column 3, a cell a second.
ROW, COL, N = 5, 3, 6


def cells_with(*blocked, n=7):
    cells = np.zeros((n, n), np.int8)
    for cell in blocked:
        cells[cell] = 100
    return cells


def drive(bag, wide, offset=0):
    """Write odometry, and what is seen, each second; ``offset`` columns off the robot's cell."""
    for second in range(N):
        stamp = 10.0 + second
        for k in range(20):
            x, y = GRID.world_from_cell(ROW, COL + second)
            bag.write('/odom', ODOMETRY, raw_odometry(
                stamp + k / 20, x + k / 20 * GRID.resolution, y), nanoseconds(stamp + k / 20))
        bag.write('/neighbourhood', OCCUPANCY, raw_local_grid(
            stamp, ROW, COL + second + offset, wide(second)), nanoseconds(stamp))


def demonstration(folder, wide, offset=0):
    header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(folder, 'task1'), 'demo', header) as bag:
        drive(bag, wide, offset)
    return bag.folder


def decisions():
    rows = np.zeros(N, DECISION_DTYPE)
    rows['stamp'] = 10.0 + np.arange(N)
    rows['trial'], rows['step'] = 1, np.arange(N)
    rows['row'] = rows['next_row'] = ROW
    rows['col'] = COL + np.arange(N)
    rows['next_col'] = rows['col'] + 1
    return rows


def trial(folder, wide, offset=0):
    def write(bag):
        bag.write('/trial', STATUS, raw_status(State.RUNNING, 1, stamp=10.0), nanoseconds(10.0))
        drive(bag, wide, offset)
        bag.write('/experience', 'sensor_msgs/msg/PointCloud2', raw_decisions(decisions()),
                  nanoseconds(15.0))
        bag.write('/trial', STATUS, raw_status(
            State.ENDED, 1, Outcome.GAVE_UP, decisions=N, stamp=15.9), nanoseconds(15.9))

    return trial_bag(folder, write)


@pytest.mark.parametrize('make', [demonstration, trial])
def test_what_is_seen_far_away_is_part_of_the_record(tmp_path, make):
    record = content_of(make(tmp_path, lambda second: cells_with((0, second % 2)))).record
    seen = record.local_grids
    assert seen['stamp'].tolist() == [10.0 + second for second in range(N)]
    assert seen['col'].tolist() == [COL + second for second in range(N)]
    assert (seen['cells'][1] == cells_with((0, 1))).all()


@pytest.mark.parametrize('make', [demonstration, trial])
def test_nine_cells_are_in_the_masks_alone(tmp_path, make):
    record = content_of(make(tmp_path, lambda _: cells_with(n=3))).record
    assert len(record.local_grids) == 0


@pytest.mark.parametrize(('make', 'offset'), [(demonstration, 3), (trial, 1)])
def test_what_was_seen_from_elsewhere_is_left_out(tmp_path, make, offset):
    """As of a controller that corrects odometry."""
    record = content_of(make(tmp_path, lambda _: cells_with((0, 0)), offset)).record
    assert len(record.local_grids) < N / 2


def test_the_map_remembers_it_whether_live_or_relearnt(tmp_path):
    demonstration(tmp_path, lambda second: cells_with((0, 0)) if second == 2 else cells_with())
    relearner, _ = relearn(TaskFolder(tmp_path, 'task1').episodes())
    known = relearner.field().known
    assert known[ROW - 3, COL + 2 - 3] == 0  # seen free from the cell before and after
    assert (known[ROW - 3:ROW + 4, COL:COL + N + 3] == 0).all()
    assert (known[ROW + 4:] == -1).all()


def test_the_masks_of_a_decision_come_after_what_was_seen_before_it(tmp_path):
    """A door far away stood open, then it was shut before the robot."""
    door = (3, 6)  # three columns ahead, in the robot's row
    folder = demonstration(
        tmp_path, lambda second: cells_with(door) if second == 3 else cells_with())
    record = content_of(folder).record
    assert record.local_grids['cells'][3][door] == 100
    relearner, _ = relearn(TaskFolder(tmp_path, 'task1').episodes())
    # Seen free before and occupied then, in one episode: something that moves.
    assert relearner.field().known[ROW, COL + 6] == 0


@pytest.mark.parametrize(('name', 'value'), [
    ('info.width', 9), ('info.height', 2**32 - 1), ('info.resolution', 0.3),
    ('info.resolution', float('nan')), ('info.origin.position.x', float('inf')),
    ('info.origin.orientation.z', 0.5), ('header.frame_id', 'map'), ('data', [0] * 48),
    ('data', [7] * 49), ('data', [])])
def test_messages_that_are_none_are_counted_and_the_others_learnt(tmp_path, name, value):
    folder = demonstration_bag(tmp_path)
    header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(tmp_path / 'other', 'task1'), 'demo', header) as bag:
        drive(bag, lambda _: cells_with((0, 0)))
        msg = grid_from_neighbourhood(Neighbourhood(11.5, ROW, COL, cells_with()), GRID)
        spoil(msg, name, value)
        bag.write('/neighbourhood', OCCUPANCY, cdr_from_message(msg), nanoseconds(16.0))
    content = content_of(bag.folder)
    assert len(content.record.local_grids) == N
    assert '1 message refused' in content.notes[0]
    assert folder != bag.folder
