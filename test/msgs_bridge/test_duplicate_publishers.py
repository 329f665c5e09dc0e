"""Two publishers of one topic: reported soon where both send, and not where one was killed."""

from types import SimpleNamespace

from nav_msgs.msg import Odometry
import pytest

from msgs_bridge.node import qos
from msgs_bridge.node.duplicate_publishers import (
    DuplicateChecker, DuplicateMonitor, SequenceNumbers)
import ros_helpers


def publisher(name, process=1, namespace='/'):
    return SimpleNamespace(node_name=name, node_namespace=namespace,
                           endpoint_gid=[process] * 12 + [0] * 4)


def heard(*numbers):
    sequence = SequenceNumbers()
    for number in numbers:
        sequence.add(number)
    return sequence


@pytest.mark.parametrize('numbers', [
    [7, 1, 8, 2, 9, 3, 10, 4], [5, 5, 6, 6, 7, 7, 8, 8], [5, 6, 5, 7, 6, 8, 7, 9],
    [100, 150, 101, 151, 102, 152, 103, 153], [1, 2, 3, 90, 4, 5, 91, 6, 7, 8, 92, 9, 93],
    [1, 70, 4, 71, 9, 72, 11, 75]])
def test_two_that_send_take_turns_with_their_numbers(numbers):
    assert heard(*numbers).are_several


@pytest.mark.parametrize('numbers', [
    range(1, 200), range(1, 2000, 37), [*range(700, 900), *range(1, 300)],
    [*range(200), *range(1, 50), *range(1, 20)], [None] * 50, [0] * 50,
    [*range(500, 600), *range(1, 590, 7), *range(590, 700)]])
def test_one_that_sends_or_loses_much_or_is_started_anew_is_one(numbers):
    assert not heard(*numbers).are_several


class TestDuplicateChecker:
    def test_two_names_are_said_once_they_have_stayed(self):
        checker, two = DuplicateChecker(), [publisher('a', 1), publisher('b', 2, '/x')]
        assert checker.check('/odom', two, 0.0) == ''
        said = checker.check('/odom', two, 2.0)
        assert '2 publish /odom: /a and /x/b. ' in said
        assert 'ROS_DOMAIN_ID' in said

    def test_one_is_never_said_and_begins_anew(self):
        checker, two = DuplicateChecker(), [publisher('a'), publisher('b')]
        checker.check('/odom', two, 0.0)
        assert checker.check('/odom', two[:1], 1.0) == ''
        assert checker.check('/odom', two, 3.0) == ''

    @pytest.mark.parametrize(('other', 'numbers'), [
        ('a', None), ('a', heard(1, 2, 3)), ('b', heard(1, 2, 3))])
    def test_one_that_is_not_heard_may_have_been_killed(self, other, numbers):
        checker, two = DuplicateChecker(), [publisher('a', 1), publisher(other, 2)]
        assert [checker.check('/odom', two, now, numbers) for now in (0.0, 5.0, 20.0)] == [''] * 3
        assert '2 publish /odom: /a' in checker.check('/odom', two, 25.0, numbers)

    def test_two_with_one_name_that_both_send_are_said_at_once(self):
        two = [publisher('a', 1), publisher('a', 2)]
        assert '/a more than once' in DuplicateChecker().check(
            '/odom', two, 0.0, heard(1, 91, 2, 92, 3, 93))

    def test_two_of_one_process_are_there(self):
        checker, two = DuplicateChecker(), [publisher('a'), publisher('a')]
        checker.check('/clock', two, 0.0)
        assert 'publish_clock:=false' in checker.check('/clock', two, 2.0)

    def test_a_node_whose_name_is_not_known_yet_does_not_count(self):
        checker, two = DuplicateChecker(), [publisher('a'), publisher('_NODE_NAME_UNKNOWN_')]
        assert [checker.check('/odom', two, now) for now in (0.0, 50.0)] == [''] * 2


def test_namesakes_of_two_processes_are_told_by_what_they_send(ros_domain, ros_node):
    watch = DuplicateMonitor(ros_node)
    topic = ros_node.resolve_topic_name('odom')
    with ros_helpers.own_node(ros_domain, 'robot') as one, ros_helpers.own_node(
            ros_domain, 'robot') as other:
        first, second = (node.create_publisher(Odometry, topic, qos.ODOMETRY_PUB)
                         for node in (one, other))
        ros_helpers.wait_until(lambda: ros_node.count_publishers(topic) == 2, node=ros_node)

        def looks(*publishers):
            for peer in publishers:
                peer.publish(Odometry())
                ros_helpers.spin_some(ros_node)
            return watch.look(0.0)

        for _ in range(20):
            assert looks(first) == []
        [said] = ros_helpers.wait_until(lambda: looks(first, second))
        assert '2 publish /odom: /robot more than once. ' in said
    ros_helpers.wait_until(lambda: ros_node.count_publishers(topic) == 0, node=ros_node)
    assert watch.look(1.0) == []
    assert not watch._readers
