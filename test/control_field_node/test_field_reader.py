"""Fields of any size arrive while a robot drives: who guards it is not held up."""

from itertools import pairwise
from threading import Thread
import time

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from control_field_node.inputs.field_reader import FEW_CELLS, FieldReader, outcome_from_cdr
from controller_bench import Bench, driving, DT
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.tables import cloud_from_field, OtherVersionError
from msgs_bridge.node.raw_messages import MOST_BYTES, small_only
from ros_helpers import DEADLINE

LARGE = Grid(80, 80, 0.25)


def bytes_of(field):
    return serialize_message(cloud_from_field(field))


def wait_for(found):
    end = time.monotonic() + DEADLINE
    while not (outcome := found()):
        assert time.monotonic() < end
        time.sleep(0.0)
    return outcome


@pytest.fixture
def reader():
    reader = FieldReader()
    yield reader
    reader.close()


def takes(reader, message):
    """Take a message in a thread, as the listener does."""
    def work():
        reader.ask()
        reader.take(message)
    thread = Thread(target=work, daemon=True)
    thread.start()
    return thread


def test_a_field_is_read_as_from_its_message():
    field = straight_field((5, 9))
    outcome = outcome_from_cdr(bytes_of(field))
    assert outcome.grid == GRID
    assert np.array_equal(outcome.q, field.q)
    assert np.array_equal(outcome.vx, field.vx)


def test_nothing_is_taken_before_there_is_leave(reader):
    thread = takes(reader, bytes_of(straight_field((5, 9), 3, LARGE)))
    wait_for(lambda: reader.is_asking)
    assert reader.is_busy
    assert reader.take_finished() is None
    reader.give_leave()
    thread.join(DEADLINE)
    assert reader.is_reading
    assert reader.take_finished().revision == 3
    assert not any((reader.is_busy, reader.is_asking, reader.is_reading))


def test_the_next_one_needs_leave_of_its_own(reader):
    for revision in (1, 2):
        thread = takes(reader, bytes_of(straight_field((5, 9), revision)))
        wait_for(lambda: reader.is_asking)
        reader.give_leave()
        thread.join(DEADLINE)
        assert not reader.is_reading
        assert reader.take_finished().revision == revision


def test_who_waits_for_leave_is_let_go_at_the_end(reader):
    thread = takes(reader, b'')
    wait_for(lambda: reader.is_asking)
    reader.close()
    thread.join(DEADLINE)
    assert not thread.is_alive()


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
    assert bench.take(bench.supervisor.on_field_reading(True)).velocity == (0.0, 0.0)
    for _ in range(10):
        bench.tick()
    assert bench.supervisor.trial.pause_reason is StopReason.READING_FIELD
    assert bench.velocity == (0.0, 0.0)
    bench.supervisor.on_field_reading(False)
    assert bench.run().outcome is Outcome.GOAL


def test_a_robot_that_is_to_stand_does_so_gently_and_goes_on():
    bench = driving()
    bench.supervisor.output.is_to_stand = True
    speeds = [bench.velocity[0]]
    while bench.supervisor.is_driving:
        bench.tick()
        speeds.append(bench.velocity[0])
        assert len(speeds) < 20
    limit = bench.supervisor.settings.limits.a_max * DT
    assert all(-limit - 1e-9 <= after - before <= 0.0 for before, after in pairwise(speeds))
    assert bench.supervisor.trial.pause_reason is None
    bench.supervisor.output.is_to_stand = False
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
    policy = bench.supervisor.trial.run.policy
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


def test_of_what_the_ears_left_out_the_size_is_said():
    refused = []
    small_only(PointCloud2, 'odom', lambda _: None, refused.append)(60_000_000)
    assert refused == [
        f'odom: a message has 60000000 bytes, must have at most {MOST_BYTES}']
