"""Requests at the same time: what is refused takes no other request's answer away."""

import time
from types import SimpleNamespace

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from control_field.poses import StartPose
from learner_node.services import LearnerServices
from learner_node.session.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.learner_requests import answer_from_response, request_from_action


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

    def change_trials(self, change, now):
        return change(now)

    def ask(self, name, data=None):
        kind = Trigger if data is None else SetBool
        request = kind.Request() if data is None else kind.Request(data=data)
        response = kind.Response()
        return SimpleNamespace(
            response=response, work=self.callbacks[f'~/{name}'](request, response))

    def request(self, action, **values):
        response = SetParameters.Response()
        return SimpleNamespace(response=response, work=self.callbacks['~/request'](
            request_from_action(action, values), response))


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


@pytest.mark.parametrize(('action', 'values', 'code'), [
    ('keep', {}, 'not_recording'), ('discard', {}, 'not_recording'),
    ('run_trials', {}, 'real_robot'), ('run_trials', {'n': 3}, 'real_robot'),
    ('stop_trials', {}, 'no_trials'), ('run_trials', {'n': 1001}, 'malformed'),
    ('run_trials', {'n': -1}, 'malformed'), ('run_trials', {'episode': '0001_demo'}, 'malformed'),
    ('keep', {'n': 1}, 'malformed'), ('quit', {}, 'malformed')])
def test_a_page_is_told_by_a_code_why_not(action, values, code):
    asked = Services().request(action, **values)
    assert not goes_on(asked)
    assert answer_from_response(asked.response)[::2] == (False, code)


def test_a_page_asks_for_the_same_with_values():
    services = Services()
    assert not goes_on(services.request('record'))
    asked = services.request('record')
    assert not goes_on(asked)
    assert answer_from_response(asked.response)[::2] == (False, 'recording')
    services.session.demonstration.discard(time.monotonic())
    asked = services.request('drop', episode='0002_demo')
    assert goes_on(asked)
    assert services.changes == [('drop', '0002_demo')]
    services.services.answer(False, 'there is none', 'nothing_there')
    assert not goes_on(asked)
    assert answer_from_response(asked.response) == (False, 'there is none', 'nothing_there')
