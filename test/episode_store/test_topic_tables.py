"""Poses, local grids and decisions by column: the same as by message."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from bridge_helpers import (
    CLOUD, GRID, message_class, OCCUPANCY, ODOMETRY, random_decisions, raw_decisions,
    raw_local_grid, raw_odometry, raw_status, refusal, spoil, STATUS)
from control_field.local_grid import masks_from_neighbourhood
from control_field.records import Outcome
from episode_store.rosbag2.reader import RawMessages
from episode_store.rosbag2.topic_tables import (
    decision_table, local_grid_table, pose_table, statuses)
from msgs_bridge.messages.cdr import CdrError
from msgs_bridge.messages.neighbourhoods import neighbourhood_from_grid
from msgs_bridge.messages.poses import Pose, pose_from_odometry, pose_stamped_from_pose
from msgs_bridge.messages.tables import decisions_from_cloud
from msgs_bridge.messages.trial_status import State

odd = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 0.5, 1.004, 1.02, 1e300, -3.0])


def raw_of(type_name, messages):
    return RawMessages.of('/t', type_name, messages, [0] * len(messages))


def spoilt(raw, type_name, name, value):
    """Return a message with one value changed."""
    msg = deserialize_message(raw, message_class(type_name))
    spoil(msg, name, value)
    return serialize_message(msg)


@st.composite
def odometries(draw):
    raw = raw_odometry(draw(st.floats(0, 2e9)), draw(st.floats(-9, 9)), draw(st.floats(-9, 9)))
    for name in draw(st.lists(st.sampled_from([
            'pose.pose.position.x', 'pose.pose.position.y', 'pose.pose.orientation.z',
            'pose.pose.orientation.w', 'twist.twist.linear.x', 'twist.twist.angular.z']),
            max_size=1)):
        raw = spoilt(raw, ODOMETRY, name, draw(odd))
    if draw(st.integers(0, 9)) == 0:
        raw = spoilt(raw, ODOMETRY, 'header.stamp.nanosec', 2**31)
    return raw


@given(st.lists(odometries(), max_size=9))
def test_poses_are_those_of_the_messages(raw):
    by_message = []
    for message in raw:
        msg = deserialize_message(message, message_class(ODOMETRY))
        if not refusal(lambda msg=msg: pose_from_odometry(msg)):
            pose = pose_from_odometry(msg)
            by_message.append((pose.stamp, pose.x, pose.y))
    table = pose_table(raw_of(ODOMETRY, raw), 'odom')
    assert [(stamp, x, y) for stamp, (x, y) in zip(
        table.stamps.tolist(), table.xy.tolist(), strict=True)] == by_message
    assert table.n_refused == len(raw) - len(by_message)
    assert bool(table.refusal) == bool(table.n_refused)


@st.composite
def local_grids(draw):
    n, k = draw(st.sampled_from([(3, 1), (3, 1), (7, 1), (3, 3), (5, 5), (61, 1)]))
    fine = np.random.default_rng(draw(st.integers(0, 2**32))).choice([0, 0, 100, -1], (n * k,) * 2)
    raw = raw_local_grid(draw(st.floats(0, 1e6)), draw(st.integers(0, 19)),
                         draw(st.integers(0, 19)), fine, k=k)
    for name in draw(st.lists(st.sampled_from([
            'info.resolution', 'info.origin.position.x', 'info.origin.position.y',
            'info.origin.orientation.z', 'info.origin.orientation.y',
            'info.origin.orientation.w']), max_size=1)):
        raw = spoilt(raw, OCCUPANCY, name, min(draw(odd), 1e30))
    kind = draw(st.integers(0, 12))
    if kind == 0:
        raw = spoilt(raw, OCCUPANCY, 'info.width', draw(st.sampled_from([0, 1, 9, n, 2**32 - 1])))
    if kind == 1:
        raw = spoilt(raw, OCCUPANCY, 'data', draw(st.sampled_from(
            [[0] * 8, [], [7] * 9, [7] * n**2, [0] * 16, [0] * 3969])))
    if kind == 2:
        raw = spoilt(raw, OCCUPANCY, 'header.frame_id', 'map')
    return raw


@given(st.lists(local_grids(), max_size=9))
def test_local_grids_are_those_of_the_messages(raw):
    by_message, shown = [], []
    for message in raw:
        msg = deserialize_message(message, message_class(OCCUPANCY))
        if not refusal(lambda msg=msg: neighbourhood_from_grid(msg, GRID)):
            seen = neighbourhood_from_grid(msg, GRID)
            by_message.append((seen.stamp, seen.row, seen.col,
                               *masks_from_neighbourhood(seen.nine)))
            what = (seen.row, seen.col, seen.cells.tolist())
            if seen.is_wide and (not shown or shown[-1][1] != what):
                shown.append((seen, what))
    table = local_grid_table(raw_of(OCCUPANCY, raw), GRID)
    read = zip(table.stamps.tolist(), *table.cells.T.tolist(), table.blocked.tolist(),
               table.unknown.tolist(), strict=True)
    assert list(read) == by_message
    assert table.n_refused == len(raw) - len(by_message)
    assert [(read['stamp'], read['row'], read['col']) for read in table.local_grids] == [
        (seen.stamp, seen.row, seen.col) for seen, _ in shown]
    for read, (seen, _) in zip(table.local_grids, shown, strict=True):
        edge = (len(read['cells']) - len(seen.cells)) // 2
        assert (read['cells'] == np.pad(seen.cells, edge, constant_values=-1)).all()


def test_what_is_seen_again_and_again_is_kept_once():
    cells = np.zeros((5, 5))
    raw = [raw_local_grid(stamp, 3, 4, cells) for stamp in (0.0, 1.0, 2.0)]
    raw += [raw_local_grid(3.0, 3, 5, cells), raw_local_grid(4.0, 3, 5, cells + 100)]
    raw += [raw_local_grid(5.0, 3, 5, np.zeros((3, 3))), raw_local_grid(6.0, 3, 4, cells)]
    table = local_grid_table(raw_of(OCCUPANCY, raw), GRID)
    assert len(table.stamps) == 7
    assert table.local_grids['stamp'].tolist() == [0.0, 3.0, 4.0, 6.0]
    assert table.local_grids['cells'].shape == (4, 5, 5)


@st.composite
def experiences(draw):
    rows = random_decisions(GRID, draw(st.integers(0, 4)), draw(st.integers(0, 2**32)))
    raw = raw_decisions(rows)
    kind = draw(st.integers(0, 12))
    if kind == 0:
        name = draw(st.sampled_from(['width', 'height', 'point_step', 'row_step']))
        raw = spoilt(raw, CLOUD, name, draw(st.integers(0, 2**32 - 1) | st.integers(0, 200)))
    elif kind == 1:
        raw = spoilt(raw, CLOUD, 'header.frame_id', 'map')
    elif kind == 2 and len(rows):
        rows['action'] = 9
        raw = raw_decisions(rows)
    elif kind == 3:
        at = draw(st.integers(4, len(raw) - 1))
        raw = raw[:at] + bytes([draw(st.integers(0, 255))]) + raw[at + 1:]
    return raw


@given(st.lists(experiences(), max_size=9))
def test_decisions_are_those_of_the_messages(raw):
    parts, n_refused = [random_decisions(GRID, 0, 0)], 0
    for message in raw:
        try:
            msg = deserialize_message(message, message_class(CLOUD))
            parts.append(decisions_from_cloud(msg, GRID))
        except Exception:  # the middleware refuses what is no message at all
            n_refused += 1
    decisions, n, sentence = decision_table(raw_of(CLOUD, raw), GRID)
    np.testing.assert_array_equal(decisions, np.concatenate(parts))
    assert n == n_refused
    assert bool(sentence) == bool(n)


def test_poses_of_a_localisation_are_read_too():
    raw = [serialize_message(pose_stamped_from_pose(Pose(i, 2.0 * i, 0.0, 0.1))) for i in range(3)]
    table = pose_table(raw_of('geometry_msgs/msg/PoseStamped', raw), 'odom')
    assert table.xy[:, 0].tolist() == [0.0, 2.0, 4.0]


def test_other_frames_are_named():
    table = pose_table(raw_of(ODOMETRY, [raw_odometry(0, 0, 0), raw_odometry(1, 0, 0, 'map')]),
                       'odom')
    assert (len(table.stamps), table.n_refused) == (1, 1)
    assert table.refusal == "/t: frame is 'map', must be 'odom'"


def test_topics_of_another_type_are_an_error():
    for read in (lambda raw: pose_table(raw, 'odom'), lambda raw: local_grid_table(raw, GRID),
                 lambda raw: decision_table(raw, GRID), lambda raw: list(statuses(raw))):
        with pytest.raises(CdrError, match='/t is geometry_msgs/msg/Twist'):
            read(raw_of('geometry_msgs/msg/Twist', [b'']))
        read(raw_of('', []))


def test_statuses_are_read_from_both_ends_past_what_is_none():
    raw = [raw_status(State.RUNNING, 1), b'\0\1\0\0junk',
           raw_status(State.ENDED, 1, Outcome.GOAL)]
    found = [(i, status.state) for i, status in statuses(raw_of(STATUS, raw))]
    assert found == [(0, State.RUNNING), (2, State.ENDED)]
    assert [(i, status.state) for i, status in statuses(raw_of(STATUS, raw), True)] == found[::-1]
