"""CDR, against rclpy and rosbags, and bytes that are no message."""

import tracemalloc

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import GRID, message_class, poses, random_field, refusal
from msgs_bridge.messages.cdr import CdrError, DESCRIBED, layout_from_cdr, struct_from_cdr
from msgs_bridge.messages.poses import odometry_from_pose
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus

STORE = get_typestore(Stores.ROS2_JAZZY)
SAMPLES = {
    name: serialize_message(message_class(name)()) for name in DESCRIBED
} | {
    'sensor_msgs/msg/PointCloud2': serialize_message(cloud_from_field(random_field(GRID, 0))),
    'diagnostic_msgs/msg/DiagnosticStatus': serialize_message(
        status_from_trial(TrialStatus(State.RUNNING, 3, reason='wörld'))),
}


@given(poses, st.text(st.characters(codec='utf-8', exclude_characters='\0'), max_size=9))
def test_odometry_is_read_as_it_was_written(pose, child):
    msg = odometry_from_pose(pose, child)
    values = struct_from_cdr(DESCRIBED['nav_msgs/msg/Odometry'], serialize_message(msg))
    assert (values['frame_id'], values['child_frame_id']) == (pose.frame_id, child)
    assert (values['x'], values['y'], values['vx'], values['wz']) == (
        pose.x, pose.y, pose.v, pose.w)
    assert values['qw'] == msg.pose.pose.orientation.w
    assert (values['sec'], values['nanosec']) == (msg.header.stamp.sec, msg.header.stamp.nanosec)
    np.testing.assert_array_equal(values['twist_covariance'], msg.twist.covariance)


@pytest.mark.parametrize('name', DESCRIBED)
def test_all_of_a_message_is_described(name):
    layout = layout_from_cdr(DESCRIBED[name], SAMPLES[name])
    # A writer may fill up to a multiple of four at the end.
    assert 0 <= len(SAMPLES[name]) - layout.size < 4


@pytest.mark.parametrize('name', DESCRIBED)
@pytest.mark.parametrize('order', ['little', 'big'])
def test_another_writer_and_the_other_byte_order(name, order):
    msg = STORE.deserialize_cdr(SAMPLES[name], name)
    raw = bytes(STORE.serialize_cdr(msg, name, little_endian=order == 'little'))
    ours = struct_from_cdr(DESCRIBED[name], SAMPLES[name])
    assert repr(struct_from_cdr(DESCRIBED[name], raw)).replace(", dtype='>f8'", '') == repr(ours)


def test_structs_are_read_one_by_one():
    values = struct_from_cdr(DESCRIBED['diagnostic_msgs/msg/DiagnosticStatus'],
                             SAMPLES['diagnostic_msgs/msg/DiagnosticStatus'])
    assert {'key': 'reason', 'value': 'wörld'} in values['values']
    cloud = struct_from_cdr(DESCRIBED['sensor_msgs/msg/PointCloud2'],
                            SAMPLES['sensor_msgs/msg/PointCloud2'])
    assert cloud['fields'][1] == {'name': 'y', 'offset': 4, 'datatype': 7, 'count': 1}
    assert (cloud['height'], cloud['width'], len(cloud['data'])) == (20, 20, 400 * 96)


@pytest.mark.parametrize('name', DESCRIBED)
@given(data=st.data())
def test_a_message_that_is_cut_is_refused(name, data):
    size = layout_from_cdr(DESCRIBED[name], SAMPLES[name]).size
    cut = data.draw(st.integers(0, size - 1))
    with pytest.raises(CdrError, match=r'it ends or makes no sense|its encapsulation'):
        struct_from_cdr(DESCRIBED[name], SAMPLES[name][:cut])


@pytest.mark.parametrize('start', [b'\x00\x03', b'\x00\x07', b'\x01\x01', b'\x00', b''])
def test_other_encapsulations_are_refused(start):
    with pytest.raises(CdrError, match='its encapsulation is'):
        layout_from_cdr((('x', 'f8'),), start + b'\0' * (40 if len(start) > 1 else 0))


@pytest.mark.parametrize('name', DESCRIBED)
@given(data=st.data())
def test_spoilt_bytes_are_read_or_refused_without_memory(name, data):
    raw = bytearray(SAMPLES[name][:2000])
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, min(len(raw), 400) - 1))
        raw[at] = data.draw(st.sampled_from([0, 1, 127, 128, 255]) | st.integers(0, 255))
    tracemalloc.start()
    sentence = refusal(lambda: struct_from_cdr(DESCRIBED[name], bytes(raw)), CdrError)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert '\n' not in sentence
    assert peak < 500_000


@given(st.binary(max_size=200), st.sampled_from(sorted(DESCRIBED)))
def test_any_bytes(raw, name):
    refusal(lambda: struct_from_cdr(DESCRIBED[name], b'\0\1\0\0' + raw), CdrError)
