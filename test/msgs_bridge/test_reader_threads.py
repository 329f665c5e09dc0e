"""Messages of any size are taken in threads that hold nobody up."""

from threading import Thread
import time

import pytest
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from msgs_bridge.node import qos
from msgs_bridge.node.rcl_take import RclTaker
from msgs_bridge.node.reader_threads import ReaderThreads
from ros_helpers import wait_until

MOST = 1000
#: The bytes of a message that takes a while to take.
LARGE = b'\x00\x01\x00\x00' + bytes(60_000_000)


@pytest.fixture
def threads(ros_node):
    threads = ReaderThreads(ros_node)
    threads.enable()
    yield threads
    threads.close()


def read(threads, callback, **options):
    threads.subscribe(String, 'talk', callback, (qos.RECORDING,), MOST, **options)
    threads.start()


def publisher(node):
    made = node.create_publisher(String, 'talk', qos.RECORDING)
    wait_until(made.get_subscription_count, what='who hears')
    return made


def test_small_ones_come_as_bytes_and_of_large_ones_the_size(ros_node, threads):
    heard = []
    read(threads, heard.append)
    talk = publisher(ros_node)
    for text in ('small', 'x' * MOST, 'small again'):
        talk.publish(String(data=text))
    wait_until(lambda: len(heard) == 3, what='all three')
    assert heard[0] == serialize_message(String(data='small'))
    assert isinstance(heard[1], int)
    assert heard[1] > MOST
    assert heard[2] == serialize_message(String(data='small again'))


def test_the_executor_leaves_them_to_the_threads(ros_node, threads):
    before = len(list(ros_node.subscriptions))
    read(threads, lambda _: None)
    assert len(list(ros_node.subscriptions)) == before + 1
    assert len(list(threads.for_executor(ros_node.subscriptions))) == before


def test_what_fails_in_a_thread_is_for_the_owner_to_raise(ros_node, threads):
    def fail(_):
        raise RuntimeError('a fault')
    read(threads, fail)
    threads.check()
    publisher(ros_node).publish(String(data='x'))
    wait_until(lambda: threads.error, what='the fault')
    with pytest.raises(RuntimeError, match='a fault'):
        threads.check()


def test_muted_threads_call_nothing(ros_node, threads):
    heard = []
    read(threads, heard.append)
    talk = publisher(ros_node)
    with threads.lock:
        threads.mute()
        talk.publish(String(data='x'))
    threads.close()
    assert heard == []


def longest_wait(thread):
    """Run a thread; return the longest time that this one did not get on meanwhile, [s]."""
    longest, last = 0.0, time.monotonic()
    thread.start()
    while thread.is_alive():
        time.sleep(0.001)
        now = time.monotonic()
        longest, last = max(longest, now - last), now
    return longest


def test_no_thread_waits_while_a_large_message_is_taken(ros_node):
    """It is compared with what rclpy does, at the same time on the same machine."""
    subscription = ros_node.create_subscription(
        String, 'talk', lambda _: None, qos.RECORDING, raw=True)
    ros_node.executor.remove_node(ros_node)
    talk, taker, waits = publisher(ros_node), RclTaker(), {'quiet': [], 'rclpy': []}
    takes = {'quiet': lambda: sizes.append(taker.take(subscription.handle.pointer, MOST)),
             'rclpy': lambda: sizes.append(len(subscription.handle.take_message(String, True)[0]))}
    sizes = []
    waiting = rcl.WaitSet(1, 0, 0, 0, 0, 0, ros_node.context.handle)
    for _ in range(3):
        for name, take in takes.items():
            talk.publish(LARGE)
            waiting.clear_entities()
            waiting.add_subscription(subscription.handle)
            waiting.wait(60_000_000_000)
            waits[name].append(longest_wait(Thread(target=take)))
    taker.close()
    assert sizes == 6 * [len(LARGE)]
    assert min(waits['quiet']) < 0.5 * min(waits['rclpy']), waits


def test_nothing_to_take_is_nothing(ros_node):
    subscription = ros_node.create_subscription(
        String, 'talk', lambda _: None, qos.RECORDING, raw=True)
    taker = RclTaker()
    assert taker.take(subscription.handle.pointer, MOST) is None
    taker.close()
