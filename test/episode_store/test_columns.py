"""Columns: always what parsing message by message gives, whatever is mixed."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import ODOMETRY, raw_odometry, refusal
from episode_store.rosbag2.columns import MAX_LAYOUTS, read_columns
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr import CdrError, DESCRIBED, struct_from_cdr

STORE = get_typestore(Stores.ROS2_JAZZY)
NAMES = {'sec': 1, 'nanosec': 1, 'x': 1, 'qw': 1, 'wz': 1, 'pose_covariance': 36}


def messages_of(raw):
    return RawMessages.of('/odom', ODOMETRY, raw, [0] * len(raw))


def other_writer(raw, little_endian):
    return bytes(STORE.serialize_cdr(
        STORE.deserialize_cdr(raw, ODOMETRY), ODOMETRY, little_endian=little_endian))


@st.composite
def odometries(draw):
    """Return serialised odometry: mostly alike, some of other frames, orders, lengths, or bad."""
    raw = raw_odometry(draw(st.floats(0, 1e6)), draw(st.floats(-9, 9)), 0.0,
                       draw(st.sampled_from(['odom', 'odom', 'odom', 'map', 'x', ''])))
    kind = draw(st.integers(0, 7))
    if kind == 0:
        return raw[:draw(st.integers(0, len(raw)))]
    if kind in (1, 2):
        return other_writer(raw, little_endian=kind == 1)
    if kind == 3:
        return raw + b'\0' * 4
    return raw


def check_equal(raw):
    columns = read_columns(messages_of(raw), NAMES)
    for i, message in enumerate(raw):
        parsed = None
        if not refusal(lambda message=message: struct_from_cdr(DESCRIBED[ODOMETRY], message),
                       CdrError):
            parsed = struct_from_cdr(DESCRIBED[ODOMETRY], message)
        assert columns.accepted[i] == (parsed is not None)
        if parsed is None:
            assert columns.refusal.startswith('/odom: ')
            continue
        for name in NAMES:
            np.testing.assert_array_equal(columns.values[name][i], parsed[name])
        assert columns.texts('frame_id')[columns.layout[i]] == parsed['frame_id']


@settings(max_examples=200)
@given(st.lists(odometries(), max_size=12))
def test_columns_are_what_each_message_says(raw):
    check_equal(raw)


def test_more_layouts_than_are_looked_for():
    raw = [raw_odometry(i, i, 0.0, f'frame{i % (2 * MAX_LAYOUTS)}') for i in range(100)]
    check_equal(raw)
    columns = read_columns(messages_of(raw), NAMES)
    assert len(columns.layouts) > MAX_LAYOUTS


def test_bytes_in_gaps_do_not_matter():
    raw = [bytearray(raw_odometry(i, i, 0.0)) for i in range(5)]
    for i, message in enumerate(raw):
        # 'odom' ends at byte 21, the next length stands at byte 24.
        message[21:24] = bytes([i] * 3)
    columns = read_columns(messages_of([bytes(message) for message in raw]), NAMES)
    assert len(columns.layouts) == 1
    assert columns.values['x'].tolist() == list(range(5))


def test_the_number_of_numbers_is_checked():
    columns = read_columns(messages_of([raw_odometry(0, 0, 0)] * 3), {'pose_covariance': 35})
    assert not columns.accepted.any()
    assert columns.refusal == '/odom: pose_covariance has 36 numbers, must have 35'


def test_no_messages_and_other_types():
    assert read_columns(messages_of([]), NAMES).values['pose_covariance'].shape == (0, 36)
    other = RawMessages.of('/scan', 'sensor_msgs/msg/LaserScan', [b''], [0])
    with pytest.raises(CdrError, match='/scan is sensor_msgs/msg/LaserScan, must be one of'):
        read_columns(other, NAMES)
