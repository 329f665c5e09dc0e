"""Who holds the robot: own commands, people, and who only sends standstill."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.robot.takeover import moves, OwnCommands, TakeoverDetector

commands = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


def test_a_person_is_gone_after_the_timeout():
    detector = TakeoverDetector(0.5)
    assert not detector.is_taken_over(0.0)
    detector.on_external_command(3.0)
    assert detector.is_taken_over(3.4)
    assert not detector.is_taken_over(3.5)


def test_handing_over_forgets_the_person():
    detector = TakeoverDetector(0.5)
    detector.on_external_command(3.0)
    detector.let_go()
    assert not detector.is_taken_over(3.0)


@given(st.lists(commands, max_size=20), st.data())
def test_own_commands_come_back_in_order_and_some_are_lost(sent, data):
    own = OwnCommands()
    for command in sent:
        own.sent(*command)
    kept = data.draw(st.lists(st.booleans(), min_size=len(sent), max_size=len(sent)))
    for command, has_come in zip(sent, kept, strict=True):
        if has_come:
            assert own.is_own(*command)
            own.forget(*command)


@given(st.lists(commands, max_size=20), commands)
def test_a_command_that_was_not_sent_is_external(sent, other):
    own = OwnCommands()
    for command in sent:
        own.sent(*command)
    assert own.is_own(*other) == (other in sent)


def test_a_command_is_own_only_once():
    own = OwnCommands()
    own.sent(0.1, 0.0)
    assert own.is_own(0.1, 0.0)
    own.forget(0.1, 0.0)
    assert not own.is_own(0.1, 0.0)


def test_what_is_remembered_of_own_commands_is_limited():
    own = OwnCommands(limit=3)
    for k in range(10):
        own.sent(float(k), 0.0)
    assert not own.is_own(6.0, 0.0)
    assert own.is_own(7.0, 0.0)


@pytest.mark.parametrize(('velocity', 'drives'), [
    ((0.0, 0.0), False), ((-0.0, 0.0), False), ((0.0, 5e-4), False), ((0.0, -0.1), True),
    ((-0.05, 0.0), True)])
def test_a_standstill_moves_nobody(velocity, drives):
    assert moves(velocity) == drives


@given(st.lists(st.floats(0.01, 3.0), max_size=50))
def test_standstill_alone_takes_nothing_over_however_often_it_comes(waits):
    detector, now = TakeoverDetector(0.5), 0.0
    for wait in waits:
        now += wait
        detector.on_external_command(now, is_driving=False)
        assert not detector.holds('', now)
        assert not detector.is_taken_over(now)


def test_who_moved_the_robot_holds_it_with_standstill_until_that_breaks_off():
    detector = TakeoverDetector(0.5)
    detector.on_external_command(1.0, topic='cmd_vel')
    assert detector.holds('cmd_vel', 1.0)
    for k in range(40):
        detector.on_external_command(1.1 + 0.1 * k, is_driving=False, topic='cmd_vel')
        assert detector.holds('cmd_vel', 1.1 + 0.1 * k)
    assert detector.is_taken_over(5.4)
    assert not detector.is_taken_over(5.6)
    detector.on_external_command(5.6, is_driving=False, topic='cmd_vel')
    assert not detector.holds('cmd_vel', 5.6)


def test_standstill_on_another_topic_does_not_hold_what_a_person_let_go():
    detector = TakeoverDetector(0.5)
    detector.on_external_command(1.0, topic='cmd_vel_teleop')
    for k in range(20):
        detector.on_external_command(1.1 + 0.1 * k, is_driving=False, topic='cmd_vel')
        assert not detector.holds('cmd_vel', 1.1 + 0.1 * k)
    assert detector.topic == 'cmd_vel_teleop'
    assert not detector.is_taken_over(1.6)


def test_standstill_after_the_robot_was_handed_over_holds_nothing():
    detector = TakeoverDetector(0.5)
    detector.on_external_command(1.0)
    detector.let_go()
    detector.on_external_command(1.1, is_driving=False)
    assert not detector.holds('', 1.1)
