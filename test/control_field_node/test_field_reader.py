"""Fields of any size arrive while a robot drives: who guards it is not held up."""

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import Outcome
from control_field.robot.policy import trial_on
from control_field.robot.ready_states import ReadyStates
from control_field_node.driving.trial_run import FEW_CELLS
from control_field_node.inputs.field_reader import FieldReader, outcome_from_cdr
from controller_bench import Bench
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.tables import cloud_from_field, OtherVersionError
from msgs_bridge.node.raw_messages import MOST_BYTES, small_only

LARGE = Grid(80, 80, 0.25)


def bytes_of(field):
    return serialize_message(cloud_from_field(field))


def test_a_field_is_read_as_from_its_message():
    field = straight_field((5, 9))
    outcome = outcome_from_cdr(bytes_of(field))
    assert outcome.grid == GRID
    assert np.array_equal(outcome.q, field.q)
    assert np.array_equal(outcome.vx, field.vx)


def test_a_field_comes_with_all_that_a_trial_begins_with():
    states, parameters = ReadyStates(), Parameters()
    reader = FieldReader(states, lambda: parameters)
    reader.take(memoryview(bytes(bytes_of(straight_field((5, 9), 3, LARGE)))))
    field = reader.take_finished(None)
    assert field.revision == 3
    assert reader.take_finished(field) is None
    ready, made = states.take(field, parameters), trial_on(field, field.known.copy(), parameters)
    assert same(ready, made)
    assert states.take(field, parameters) is None  # it is that trial's own
    reader.keep_ready()
    assert same(states.take(field, parameters), made)
    assert not states.holds(field, Parameters(seed=1))


def same(first, second):
    """Return whether two states are the same, whatever is nested in them."""
    if isinstance(first, tuple):
        return all(map(same, first, second))
    return np.array_equal(first, second)


def test_what_is_lent_may_change_once_it_was_read():
    message = bytearray(bytes_of(straight_field((5, 9), 3)))
    outcome = outcome_from_cdr(memoryview(message))
    vx = outcome.vx.copy()
    message[:] = bytes(len(message))
    assert np.array_equal(outcome.vx, vx)


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


def test_a_large_field_that_is_ready_stops_nobody():
    bench = Bench(field=False)
    bench.supervisor.accept_field(straight_field((5, 9), 1, LARGE))
    bench.start()
    for _ in range(20):
        bench.tick()
    trial, new = bench.supervisor.trial, straight_field((5, 9), 2, LARGE)
    trial.states.make(new, trial.parameters_in_force)
    bench.supervisor.accept_field(new)
    while bench.supervisor.status.revision == 1:
        bench.tick()
        assert bench.velocity[0] > 0.1
    assert bench.run().outcome is Outcome.GOAL


def test_a_large_field_that_is_not_ready_is_taken_over_standing(monkeypatch):
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
    monkeypatch.setattr(policy, 'replace_field', lambda *new: (
        speeds.append(bench.velocity), replace(*new)))
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
