"""What a page asks for is checked before anything is done; what does it is told exactly."""

import asyncio

import pytest

from control_field.records import Outcome
from control_field.robot.stop_reasons import StopReason
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.actions import Action
from msgs_bridge.teaching.answers import Answer
from page_node.actions import page_teaching as page_teaching_module
from page_node.actions.api import endpoints
from page_node.actions.page_teaching import PageTeaching
from page_node.actions.wanted import ACTIONS, read_wanted, Wanted
from page_node.exchange import Request
from page_node.refusal import RefusedError


@pytest.mark.parametrize(('name', 'body'), [
    *((name, {}) for name in ACTIONS if name != 'forget'),
    ('run_trials', {'n': 1}), ('run_trials', {'n': 1000}), ('teach_here', {'x': -1.5, 'y': 2}),
    ('label_success', {'episode': '0001_demo'}), ('forget', {'episode': '0012_trial'}),
    ('set_speeds', {'v': 0.1, 'w': 1.0})])
def test_what_there_is_can_be_asked_for(name, body):
    assert read_wanted(name, body) == (name, body)


@pytest.mark.parametrize(('name', 'body'), [
    ('quit', {}), ('', {}), ('../keep', {}), ('keep', {'n': 1}), ('stop', {'stop': True}),
    ('run_trials', {'n': 0}), ('run_trials', {'n': 1001}), ('run_trials', {'n': 1.5}),
    ('run_trials', {'n': True}), ('run_trials', {'n': '3'}), ('run_trials', {'n': None}),
    ('run_trials', {'n': 1, 'm': 1}), ('teach_here', {'x': 1.0}),
    ('teach_here', {'x': 1.0, 'y': float('inf')}), ('teach_here', {'x': 1e300, 'y': 0}),
    ('forget', {}), ('forget', {'episode': '../../etc'}), ('forget', {'episode': '1_demo'}),
    ('forget', {'episode': 7}), ('forget', {'episode': '0001_demo\n'}),
    ('label_failure', {'episode': ['0001_demo']}),
    ('set_speeds', {}), ('set_speeds', {'v': 1}), ('set_speeds', {'v': 'fast', 'w': 1})])
def test_what_there_is_not_is_refused(name, body):
    with pytest.raises(RefusedError) as error:
        read_wanted(name, body)
    assert error.value.code in ('unknown_action', 'malformed')
    assert error.value.status in (400, 404)


def test_the_door_checks_and_answers_with_a_code():
    done = []

    async def perform(wanted):
        done.append(wanted)
        return Answer(False, 'press n first', 'recording')

    door, = endpoints(perform)
    reply = asyncio.run(door.handler(Request({'action': 'run_trials'}, body=b'{"n": 3}')))
    assert reply.status == 200
    assert reply.content == b'{"success":false,"message":"press n first","code":"recording"}'
    assert done == [('run_trials', {'n': 3})]
    for body in (b'{"n": "3"}', b'[]', b'{', b'NaN', b'{"n": NaN}', b'\xff'):
        with pytest.raises(RefusedError):
            asyncio.run(door.handler(Request({'action': 'run_trials'}, body=body)))
    assert len(done) == 1


class Doing:
    """What is done, in place of `Teaching`."""

    def __init__(self, success=True):
        self.done, self.success, self.has_left = [], success, False
        self.drives_by_itself = True

    async def perform(self, action, **values):
        self.done.append((action, values))
        return Answer(self.success, 'it says so')

    async def leave(self):
        self.has_left = True
        return Answer(True, 'the trial is stopped')


def page_teaching(simulated=True, success=True):
    doing = Doing(success)
    speeds = []

    def set_speeds(wanted):
        speeds.append(wanted)
        return Answer(True, '')

    teaching = PageTeaching(doing, lambda: simulated, set_speeds)

    def ask(name, **values):
        return asyncio.run(teaching.perform(Wanted(name, values)))
    return doing, teaching, ask, speeds


def ended(reason=None):
    outcome = Outcome.STOPPED if reason else Outcome.GOAL
    return TrialStatus(State.ENDED, 1, outcome, stop_reason=reason)


class TestPageTeaching:
    def test_actions_are_those_of_the_keys_with_what_they_are_about(self):
        doing, _, ask, speeds = page_teaching()
        ask('forget', episode='0001_demo')
        ask('run_trials', n=3)
        ask('teach_here', x=1.0, y=2.0)
        ask('set_speeds', v=0.1, w=1.0)
        assert doing.done == [
            (Action.DROP_LAST, {'episode': '0001_demo'}), (Action.RUN_TRIALS, {'n': 3}),
            (Action.TEACH_HERE, {'x': 1.0, 'y': 2.0})]
        assert speeds == [(0.1, 1.0)]

    def test_a_real_robot_tries_once_and_the_rest_waits_for_it_to_be_driven_back(self):
        doing, teaching, ask, _ = page_teaching(simulated=False)
        ask('run_trials', n=3)
        assert doing.done == [(Action.RUN_TRIALS, {})]
        teaching.on_trial(ended())
        assert teaching.tries_left == 2
        ask('run_trials')
        assert teaching.tries_left == 1
        ask('run_trials', n=1)
        teaching.on_trial(ended())
        assert teaching.tries_left == 0

    @pytest.mark.parametrize('end', ['stop', 'start', StopReason.ASKED, StopReason.NO_HEARTBEAT])
    def test_who_stops_or_shows_the_way_wants_no_more(self, end):
        _, teaching, ask, _ = page_teaching(simulated=False)
        ask('run_trials', n=3)
        if isinstance(end, StopReason):
            teaching.on_trial(ended(end))
        else:
            ask(end)
        assert teaching.tries_left == 0

    def test_where_the_first_was_refused_none_waits(self):
        _, teaching, ask, _ = page_teaching(simulated=False, success=False)
        ask('run_trials', n=3)
        assert teaching.tries_left == 0

    def test_in_simulation_the_learner_counts(self):
        _, teaching, ask, _ = page_teaching()
        ask('run_trials', n=3)
        assert teaching.tries_left == 0

    @pytest.mark.parametrize(('is_begun', 'is_over', 'later', 'ends'), [
        (False, False, 0.0, False), (True, False, 9.0, True), (True, True, 0.0, True),
        (True, True, 9.0, False)])
    def test_it_ends_what_it_has_begun_and_nothing_else(
            self, monkeypatch, is_begun, is_over, later, ends):
        doing, teaching, ask, _ = page_teaching()
        if is_begun:
            ask('run_trials', n=3)
        teaching.on_trial(ended())
        doing.drives_by_itself = not is_over
        now = page_teaching_module.time.monotonic() + later
        monkeypatch.setattr(page_teaching_module.time, 'monotonic', lambda: now)
        teaching.look()
        asyncio.run(teaching.leave())
        assert doing.has_left == ends
