"""The age of a command: what is old, what is of another clock, and what has none."""

from geometry_msgs.msg import Twist, TwistStamped
import pytest

from msgs_bridge.messages.poses import stamp_from_seconds
from msgs_bridge.node.command_age import problem_with_age

NOW = 1.7e9


def command(stamp):
    msg = TwistStamped()
    msg.header.stamp = stamp_from_seconds(stamp)
    return msg


def problem(msg, *clocks):
    return problem_with_age(msg, clocks or (NOW,), 0.5, '/joy on cmd_vel', 'takeover_timeout')


@pytest.mark.parametrize('stamp', [NOW, NOW - 0.4, NOW + 0.4, 0.0])
def test_a_new_one_and_one_without_a_stamp_may_be_obeyed(stamp):
    assert not problem(command(stamp))


def test_a_twist_has_no_age():
    assert not problem(Twist())


def test_the_nearest_clock_counts():
    assert not problem(command(12.0), NOW, 12.3)
    assert problem(command(12.0), NOW, 14.0)


def test_an_old_one_is_named_with_its_age_and_the_limit():
    said = problem(command(NOW - 3.0))
    assert said == ('/joy on cmd_vel: a command is 3.0 s old, must be at most takeover_timeout '
                    '(0.5 s)')


@pytest.mark.parametrize(('off', 'words'), [
    (-3600.0, 'a command is 3600.0 s old'), (5.0, 'is 5.0 s ahead'), (-NOW + 9.0, 's old')])
def test_clocks_that_differ_are_named_as_such(off, words):
    said = problem(command(NOW + off))
    assert words in said
    assert f'this machine differ by {abs(off):.1f} s' in said
    assert 'use_sim_time' in said
