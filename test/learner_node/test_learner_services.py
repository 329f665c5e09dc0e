"""Requests at the same time: what is refused takes no other request's answer away."""

import time
from types import SimpleNamespace

import pytest
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from control_field.poses import StartPose
from learner_node.services import LearnerServices
from learner_node.session.session import Session
from learner_node.settings import Settings


class Services:
    """The services without a network: `ask` returns what goes on once it is done."""

    def __init__(self):
        self.callbacks, self.changes, self.said = {}, [], ''
        self.session = Session(Settings(), lambda: StartPose(0.0, 0.0))
        self.session.on_odometry(0.0, time.monotonic())
        self.done = []
        self.services = LearnerServices(
            self, self.session, self, lambda outputs: self.done.append('request'),
            lambda: self.done.append('what arrived before'), Future, None, None)

    def create_service(self, kind, name, callback, callback_group=None):
        self.callbacks[name] = callback

    def change_bags(self, *change):
        self.changes.append(change)

    def ask(self, name, data=None):
        kind = Trigger if data is None else SetBool
        request = kind.Request() if data is None else kind.Request(data=data)
        response = kind.Response()
        return SimpleNamespace(
            response=response, work=self.callbacks[f'~/{name}'](request, response))


def goes_on(asked):
    """Let a request go on; tell whether it still waits for its answer."""
    try:
        asked.work.send(None)
    except StopIteration:
        return False
    return True


@pytest.mark.parametrize('name', ['drop_last', 'label_success', 'label_failure'])
def test_a_refused_change_leaves_the_demonstration_its_answer(name):
    services = Services()
    assert not goes_on(services.ask('record_demonstration', True))
    keep = services.ask('record_demonstration', False)
    assert goes_on(keep)
    change = services.ask(name)
    assert not goes_on(change)
    assert not change.response.success
    assert 'being kept' in change.response.message
    services.services.answer(True, 'learnt')
    assert not goes_on(keep)
    assert (keep.response.success, keep.response.message) == (True, 'learnt')
    assert services.changes == []


def test_a_change_is_answered_when_it_is_learnt():
    services = Services()
    change = services.ask('drop_last')
    assert goes_on(change)
    assert services.changes == [('drop',)]
    services.services.answer(True, 'dropped')
    assert not goes_on(change)
    assert change.response.message == 'dropped'


def test_an_answer_that_nobody_waits_for_is_no_error():
    services = Services()
    services.services.answer(True, 'nobody asked')
    assert goes_on(services.ask('drop_last'))


def test_what_arrived_before_a_request_is_taken_in_before_it():
    services = Services()
    assert not goes_on(services.ask('record_demonstration', True))
    assert goes_on(services.ask('record_demonstration', False))
    assert services.done == ['what arrived before', 'request'] * 2
