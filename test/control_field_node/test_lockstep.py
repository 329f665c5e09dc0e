from geometry_msgs.msg import TwistStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import OccupancyGrid, Odometry

from control_field_node.commands.command_writer import CommandWriter
from control_field_node.commands.lockstep import TickBook
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import stamp_from_seconds
from msgs_bridge.messages.velocities import twist_from_velocity


def message(kind, tick):
    msg = kind()
    msg.header.stamp = stamp_from_seconds(0.05 * tick)
    return msg


def writer(**settings):
    book, sent = TickBook(), []
    made = CommandWriter(Settings(**settings), book, lambda: stamp_from_seconds(99.0))
    made.publish = lambda msg: sent.append(
        (msg.header.stamp if hasattr(msg, 'header') else None,
         getattr(msg, 'twist', msg).linear.x))
    return made, book, sent


@given(st.lists(st.tuples(st.integers(1, 6), st.booleans()), max_size=40))
def test_whatever_arrives_in_whatever_order_a_tick_is_answered_at_most_once(arrivals):
    book, answered = TickBook(), []
    for tick, is_odometry in arrivals:
        if is_odometry:
            book.odometry = message(Odometry, tick)
        else:
            book.local_grid = message(OccupancyGrid, tick)
        if book.is_open() and (not answered or tick > answered[-1]):
            book.mark_answered(book.odometry)
            answered.append(tick)
            assert not book.is_open()
    assert len(answered) == len(set(answered))


@given(st.permutations([True, False]))
def test_a_tick_is_open_when_both_have_come_in_either_order(order):
    book = TickBook()
    for is_odometry in order:
        assert not book.is_open()
        if is_odometry:
            book.odometry = message(Odometry, 3)
        else:
            book.local_grid = message(OccupancyGrid, 3)
    assert book.is_open()


def test_messages_of_two_ticks_make_no_open_one():
    book = TickBook()
    book.odometry, book.local_grid = message(Odometry, 3), message(OccupancyGrid, 4)
    assert not book.is_open()


def test_a_standstill_that_came_too_late_is_owed():
    made, book, sent = writer(lockstep=True)
    tick = message(Odometry, 1)
    made.send((0.1, 0.0), tick)
    made.send((0.0, 0.0), tick)
    assert len(sent) == 1
    assert book.owes_stop
    made.send((0.0, 0.0), message(Odometry, 2))
    assert sent[1] == (stamp_from_seconds(0.1), 0.0)
    assert not book.owes_stop


def test_a_stamped_command_carries_the_stamp_it_answers_and_the_frame():
    made, _, sent = writer(enable_stamped_cmd_vel=True, base_frame_id='base_link')
    made.send((0.1, 0.0), message(Odometry, 7))
    made.send((0.1, 0.0), None)
    assert [stamp for stamp, _ in sent] == [stamp_from_seconds(0.05 * 7), stamp_from_seconds(99.0)]
    assert made.kind is TwistStamped


def test_own_commands_are_told_from_those_of_others():
    made, _, _ = writer()
    made.send((0.1, 0.2), None)
    assert not made.acknowledge(twist_from_velocity(0.1, 0.3), (0.1, 0.3))
    assert made.acknowledge(twist_from_velocity(0.1, 0.2), (0.1, 0.2))
