"""Who guards the robot knows when it was held up."""

from geometry_msgs.msg import Twist, TwistStamped
import pytest
from rclpy.serialization import serialize_message

from control_field.records import Outcome
from control_field.robot.limits import STANDSTILL
from control_field_node.commands.command_writer import CommandWriter
from control_field_node.commands.guard_timing import GuardTiming, MOST_HELD
from control_field_node.commands.lockstep import TickBook
from control_field_node.settings import Settings
from controller_bench import driving
from msgs_bridge.messages.poses import stamp_from_seconds

PERIOD = 0.02


def run_guard(timing, *runs):
    for now, worked, *stands in runs:
        timing.on_guard(now, worked, not stands)
    return timing


def test_the_longest_times_of_the_last_seconds_are_kept():
    it = run_guard(GuardTiming(), (1.0, 0.5), (1.02, 0.501), (1.3, 0.51), (1.32, 0.55))
    assert it.gaps.seconds == pytest.approx(0.28)
    assert it.works.seconds == pytest.approx(0.04)
    assert it.gap == pytest.approx(0.02)
    run_guard(it, *((1.34 + PERIOD * n, 0.55 + 0.001 * n) for n in range(300)))
    assert it.gaps.seconds == pytest.approx(PERIOD)
    assert it.works.seconds == pytest.approx(0.001)


def test_what_happens_while_the_robot_stands_is_not_among_them():
    it = run_guard(GuardTiming(), (1.0, 0.5), (1.02, 0.501), (2.0, 0.9, 'stands'))
    assert it.gaps.seconds == pytest.approx(0.02)
    assert it.works.seconds == pytest.approx(0.001)
    assert it.was_held_up


def test_who_was_held_up_sends_standstill_first_and_then_goes_on():
    """In the open, too, where the collision monitor would let the old command pass."""
    bench = driving()
    supervisor, timing = bench.supervisor, bench.supervisor.output.timing
    for gap, moves in ((PERIOD, True), (0.9 * MOST_HELD, True), (1.1 * MOST_HELD, False)):
        run_guard(timing, (bench.now, 0.0), (bench.now + gap, 0.0))
        bench.take(supervisor.guard(bench.now, bench.now))
        assert (bench.velocity != STANDSTILL) is moves
    assert 'for 0.22 s' in supervisor.output.held
    assert supervisor.refusals.counts['held up'] == 1
    run_guard(timing, (bench.now + 1.0, 0.0), (bench.now + 1.0 + PERIOD, 0.0))
    assert bench.run().outcome is Outcome.GOAL


@pytest.mark.parametrize('kind', [Twist, TwistStamped])
def test_an_echo_is_known_by_its_bytes_once(kind):
    sent = []
    writer = CommandWriter(Settings(enable_stamped_cmd_vel=kind is TwistStamped), TickBook(),
                           lambda: stamp_from_seconds(12.5))
    writer.publish = lambda msg: sent.append(serialize_message(msg))
    writer.send_now((0.1, -0.2), None)
    writer.send_now((0.2, 0.3), None)
    other = kind()
    assert writer.kind is kind
    assert not writer.acknowledge_raw(serialize_message(other))
    assert [writer.acknowledge_raw(message) for message in sent] == [True, True]
    assert not any(map(writer.acknowledge_raw, sent))
    assert not any(map(writer.acknowledge_raw, (b'', sent[0][:20], b'\x00\x00' + sent[0][2:])))
