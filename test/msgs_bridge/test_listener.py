"""Topics heard in a thread of their own."""

from collections import Counter
from functools import partial
from threading import Event
import time

import pytest
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from msgs_bridge.node import qos
from msgs_bridge.node.listener import Listener
from ros_helpers import DEADLINE, wait_until


@pytest.fixture
def heard(ros_node):
    """Listen to `talk`; return the texts that came and when, [ns]."""
    found = []
    listener = Listener(ros_node, Counter())
    listener.subscribe(String, '/talk', lambda cdr, arrived: found.append(
        (deserialize_message(cdr, String).data, arrived)),
        (qos.RECORDING,), qos.RECORDING_BEST_EFFORT)
    listener.start()
    yield found
    listener.close()


def say_until_heard(publisher, text, heard):
    def is_heard():
        publisher.publish(String(data=text))
        return any(text in (said, said[0]) for said in heard)
    wait_until(is_heard, what=text)


def test_who_publishes_best_effort_is_heard_too_and_nobody_twice(ros_node, heard):
    reliable = ros_node.create_publisher(String, '/talk', qos.RECORDING)
    say_until_heard(reliable, 'reliable', heard)
    lossy = ros_node.create_publisher(String, '/talk', qos.RECORDING_BEST_EFFORT)
    say_until_heard(lossy, 'lossy', heard)
    wait_until(lambda: reliable.get_subscription_count() == 2, what='both subscriptions')
    numbers = [str(number) for number in range(100)]
    for number in numbers:
        reliable.publish(String(data=number))
    say_until_heard(reliable, 'end', heard)
    assert [said for said, _ in heard if said.isdecimal()] == numbers


@pytest.fixture
def keeper(ros_node):
    """Return a publisher that keeps what it publishes."""
    return ros_node.create_publisher(String, '/talk', qos.RECORDING_KEPT)


def kept_listener(ros_node, found):
    listener = Listener(ros_node, Counter())
    listener.subscribe(String, '/talk', lambda cdr, _: found.append(
        deserialize_message(cdr, String).data),
        (qos.RECORDING,), qos.RECORDING_BEST_EFFORT, qos.RECORDING_KEPT)
    return listener


def say(publisher, texts):
    for text in texts:
        publisher.publish(String(data=text))


def test_what_was_published_while_it_slept_is_fetched_in_order_and_nothing_twice(
    ros_node, keeper, monkeypatch,
):
    say(keeper, ['before'])
    found, clock = [], [0.0]
    monkeypatch.setattr('msgs_bridge.node.listener._awake', lambda: clock[0])
    listener = kept_listener(ros_node, found)
    merged, in_its_thread = listener._subscriptions[0], []
    listener._again = lambda: in_its_thread and in_its_thread.pop()()
    listener.start()
    try:
        say_until_heard(keeper, 'awake', found)
        missed = []
        monkeypatch.setattr(merged, '_drain', lambda _: None)  # nothing waits where nobody hears
        for sleep in ('first', 'second'):
            # As if the middleware had taken the listener for gone.
            in_its_thread.append(partial(merged._node.destroy_subscription, merged._main))
            wait_until(lambda: keeper.get_subscription_count() == 0, what='nobody who hears')
            new = [f'{sleep} {number}' for number in range(50)]
            missed += new
            say(keeper, new)
            clock[0] += 30.0
            wait_until(partial(found.__contains__, new[-1]), what='what was missed')
        assert [text for text in found if text != 'awake'] == missed
    finally:
        listener.close()


def test_what_waits_is_taken_before_it_is_fetched_and_who_keeps_nothing_is_heard_on(ros_node):
    found = []
    listener = kept_listener(ros_node, found)
    merged, publisher = listener._subscriptions[0], ros_node.create_publisher(
        String, '/talk', qos.RECORDING)
    wait_until(lambda: publisher.get_subscription_count() == 1, what='who hears')
    say(publisher, ['waits'])
    wait_until(publisher.wait_for_all_acked, what='its arrival')
    merged.fetch()
    assert found == ['waits']
    listener.start()
    try:
        say_until_heard(publisher, 'goes on', found)
        merged.has_lost_publisher = True
        wait_until(lambda: not merged.has_lost_publisher, what='another look')
        say_until_heard(publisher, 'and on', found)
    finally:
        listener.close()


def test_it_is_told_when_the_middleware_got_it(ros_node, heard):
    publisher = ros_node.create_publisher(String, '/talk', qos.RECORDING)
    before = time.time_ns()
    say_until_heard(publisher, 'now', heard)
    assert all(before <= arrived <= time.time_ns() for _, arrived in heard)


def test_it_has_caught_up_once_nothing_waits_with_the_middleware(ros_node):
    leave, found = Event(), []

    def hear(cdr, _):
        leave.wait(DEADLINE)
        found.append(cdr)

    listener = Listener(ros_node, Counter())
    listener.subscribe(String, '/talk', hear, (qos.RECORDING,))
    publisher = ros_node.create_publisher(String, '/talk', qos.RECORDING)
    wait_until(lambda: publisher.get_subscription_count() == 1, what='who hears')
    listener.start()
    try:
        say(publisher, map(str, range(50)))
        wait_until(publisher.wait_for_all_acked, what='their arrival')
        asked = time.monotonic()
        assert listener.caught_up(asked) is None
        leave.set()
        wait_until(lambda: listener.caught_up(asked) is not None, what='the end of the queue')
        assert len(found) == 50
        assert asked <= listener.caught_up(asked) <= time.monotonic()
        wait_until(lambda: listener.caught_up(time.monotonic()) is None, what='a later question')
    finally:
        leave.set()
        listener.close()


def test_it_has_a_name_of_its_own_and_ends_at_once(ros_node, heard):
    names = ros_node.get_node_names()
    assert f'{ros_node.get_name()}_recorder' in names
    assert len(names) == len(set(names))
