"""The learner's requests, to a controller of the test's own over real DDS."""

from contextlib import contextmanager

from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from learner_node.requests import Requests
from learner_node.session.inputs import Peers
from ros_helpers import own_node, wait_until

KINDS = ('start', 'stop')


@contextmanager
def controller(domain):
    """Answer requests whenever the node is spun; yield it and what it was asked for."""
    asked = []

    def answer(kind, response):
        asked.append(kind)
        response.success, response.message = True, f'{kind} done'
        return response

    with own_node(domain, 'controller') as node:
        for kind in KINDS:
            node.create_service(
                Trigger, f'~/{kind}_trial', lambda _, response, kind=kind: answer(kind, response))
        yield node, asked


@pytest.fixture
def requests(ros_node):
    return Requests(ros_node, 'controller')


def exchange(ros_node, peer, requests, until, what):
    """Let both sides work, the learner's as often as its tick, until something is so."""
    def is_done():
        requests.send()
        ros_node.executor.spin_once(timeout_sec=0.01)
        peer.executor.spin_once(timeout_sec=0.01)
        return until()
    wait_until(is_done, what=what)


def test_nobody_is_there(requests):
    assert not requests.is_there()


def test_a_start_waits_for_the_controller(ros_domain, ros_node, requests):
    answers = []
    requests.start(lambda *answer: answers.append(answer))
    with controller(ros_domain) as (peer, asked):
        exchange(ros_node, peer, requests, lambda: answers, 'the answer')
        assert requests.is_there()
        assert asked == ['start']
    assert answers == [(True, 'start done')]


def test_a_stop_takes_back_a_start_that_waits(ros_domain, ros_node, requests):
    answers = []
    requests.start(lambda *answer: answers.append(answer))
    requests.stop(lambda *_: None)
    with controller(ros_domain) as (peer, asked):
        wait_until(requests.is_there, node=ros_node, what='the controller')
        again = []
        requests.start(lambda *answer: again.append(answer))
        exchange(ros_node, peer, requests, lambda: again, 'the answer')
    assert asked == ['start']  # neither the first one, nor the stop that nobody heard
    assert not answers


def test_a_stop_that_nobody_answered_goes_before_the_next_start(ros_domain, ros_node, requests):
    with controller(ros_domain) as (peer, _):
        for kind in KINDS:
            wait_until(lambda kind=kind: peer.count_clients(f'/controller/{kind}_trial') == 1,
                       node=ros_node, what='the clients')
        stops = [client for client in ros_node.clients if 'stop' in client.srv_name]
        requests.stop(lambda *_: None)
        requests.start(lambda *_: None)
        assert stops[0] not in ros_node.clients
        wait_until(lambda: peer.count_clients('/controller/stop_trial') == 1, node=ros_node,
                   what='one client, the new one')
        assert len([client for client in ros_node.clients if 'stop' in client.srv_name]) == 1


def test_a_stop_that_was_answered_keeps_its_client(ros_domain, ros_node, requests):
    with controller(ros_domain) as (peer, asked):
        answers = []
        requests.start(lambda *answer: answers.append(answer))
        exchange(ros_node, peer, requests, lambda: answers, 'the answer to start')
        clients = list(ros_node.clients)
        wait_until(lambda: all(client.service_is_ready() for client in clients), node=ros_node,
                   what='the services')
        requests.stop(lambda *_: None)
        exchange(ros_node, peer, requests, lambda: 'stop' in asked, 'the request to stop')
        [(_, stop)] = requests._open
        exchange(ros_node, peer, requests, stop.done, 'the answer to stop')
        requests.start(lambda *answer: answers.append(answer))
        exchange(ros_node, peer, requests, lambda: len(answers) == 2, 'the second answer')
        assert asked == ['start', 'stop', 'start']
        assert list(ros_node.clients) == clients


def test_what_is_asked_for_again_and_again_is_not_piled_up(ros_node, requests):
    stop = next(client for client in ros_node.clients if 'stop' in client.srv_name)
    for _ in range(100):  # nobody is there to answer
        requests.stop(lambda *_: None)
    assert len(requests._open) < 20
    assert len(stop._pending_requests) < 20
    for _, future in requests._open:
        future.set_result(None)
    requests.start(lambda *_: None)
    assert stop not in ros_node.clients  # what was dropped may arrive yet
    assert not requests._open


def test_what_was_answered_is_dropped(ros_domain, ros_node, requests):
    with controller(ros_domain) as (peer, asked):
        clients = list(ros_node.clients)
        wait_until(lambda: all(client.service_is_ready() for client in clients), node=ros_node,
                   what='the services')
        for number in range(1, 4):
            requests.stop(lambda *_: None)
            [(_, stop)] = requests._open
            exchange(ros_node, peer, requests, stop.done, 'the answer to stop')
            assert asked == ['stop'] * number


def test_a_robot_whose_topics_are_remapped_is_there(ros_domain, ros_node):
    remapped = ['--ros-args', '-r', 'odom:=wheel/odometry', '-r', 'experience:=e']
    with own_node(ros_domain, 'a_learner', cli_args=remapped) as node:
        requests = Requests(node, 'control_field_node')
        assert requests.peers() == Peers(False, False)
        ros_node.create_publisher(Odometry, 'wheel/odometry', 10)
        ros_node.create_publisher(PointCloud2, 'e', 10)
        ros_node.create_service(
            Trigger, 'control_field_node/start_trial', lambda _, answer: answer)
        wait_until(lambda: requests.peers() == Peers(True, True), node=node, what='the robot')
