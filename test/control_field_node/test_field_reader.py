"""Fields of any size arrive while a robot drives: who guards it is not held up."""

import time

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from control_field.records import Outcome
from control_field.watch import StopReason
from control_field_node.field_reader import FEW_CELLS, FieldReader, outcome_from_cdr
from controller_bench import Bench, driving
from controller_helpers import GRID, straight_field
from msgs_bridge.raw_messages import MOST_BYTES, small_only
from msgs_bridge.tables import cloud_from_field, OtherVersionError
from ros_helpers import DEADLINE

LARGE = Grid(80, 80, 0.25)


def bytes_of(field):
    return serialize_message(cloud_from_field(field))


def wait_for(reader):
    end = time.monotonic() + DEADLINE
    while (outcome := reader.finished()) is None:
        assert time.monotonic() < end
    return outcome


def test_a_small_field_is_read_at_once_as_from_its_message():
    field = straight_field((5, 9))
    outcome = FieldReader().read(bytes_of(field))
    assert outcome.grid == GRID
    assert np.array_equal(outcome.q, field.q)
    assert np.array_equal(outcome.vx, field.vx)


def test_a_large_one_is_read_aside_and_the_newest_wins():
    reader = FieldReader()
    for revision in (1, 2, 3):
        assert reader.read(bytes_of(straight_field((5, 9), revision, LARGE))) is None
        assert reader.is_reading
    assert wait_for(reader).revision == 1
    assert wait_for(reader).revision == 3
    assert not reader.is_reading


def test_in_lock_step_everything_is_read_at_once():
    message = bytes_of(straight_field((5, 9), 7, LARGE))
    assert FieldReader().read(message, aside=False).revision == 7


def test_what_is_outdated_before_it_is_read_is_passed_over():
    reader = FieldReader()
    assert reader.read(bytes_of(straight_field((5, 9), 1, LARGE))) is None
    assert reader.read(bytes_of(straight_field((5, 9), 2))).revision == 2
    end = time.monotonic() + DEADLINE
    while reader.is_reading:
        assert reader.finished() is None
        assert time.monotonic() < end


@pytest.mark.parametrize('spoil', [
    lambda m: m[:len(m) // 2], lambda m: m[:50], lambda m: b'', lambda m: b'\xff' * len(m),
    lambda m: m[:12] + b'\xff' * 4 + m[16:]], ids=['half', 'head', 'none', 'noise', 'huge'])
def test_bytes_that_lie_are_refused_in_a_line(spoil):
    outcome = outcome_from_cdr(spoil(bytes(bytes_of(straight_field((5, 9))))))
    assert isinstance(outcome, ValueError)
    assert '\n' not in str(outcome)


def test_another_version_is_told_from_other_faults():
    msg = cloud_from_field(straight_field((5, 9)))
    msg.data[12::msg.point_step] = msg.data[12::msg.point_step].__class__(
        'B', [9] * (GRID.n_rows * GRID.n_cols))
    assert isinstance(outcome_from_cdr(serialize_message(msg)), OtherVersionError)


def test_while_a_large_field_is_read_the_robot_stands():
    bench = driving()
    assert bench.take(bench.supervisor.reads_field()).velocity == (0.0, 0.0)
    for _ in range(10):
        bench.tick()
    assert bench.supervisor.problem is StopReason.READING_FIELD
    assert bench.velocity == (0.0, 0.0)
    bench.supervisor.is_reading = False
    assert bench.run().outcome is Outcome.GOAL


def test_a_large_field_is_taken_over_standing(monkeypatch):
    assert LARGE.n_rows * LARGE.n_cols > FEW_CELLS
    bench = Bench(field=False)
    bench.supervisor.accept_field(straight_field((5, 9), 1, LARGE))
    bench.start()
    for _ in range(20):
        bench.tick()
    assert bench.velocity[0] > 0.1
    bench.supervisor.accept_field(straight_field((5, 9), 2, LARGE))
    policy = bench.supervisor.run.policy
    replace, speeds = policy.replace_field, []
    monkeypatch.setattr(policy, 'replace_field', lambda field: (
        speeds.append(bench.velocity), replace(field)))
    assert bench.run().outcome is Outcome.GOAL
    assert speeds == [(0.0, 0.0)]
    assert bench.supervisor.status.revision == 2


def test_a_message_that_is_too_long_is_refused_unread():
    refused, heard = [], []
    take = small_only(PointCloud2, 'odom', heard.append, refused.append)
    take(b'\x00' * (MOST_BYTES + 1))
    take(b'\x00\x01\x00\x00')
    assert str(MOST_BYTES + 1) in refused[0]
    assert heard == [] or refused[1:]
