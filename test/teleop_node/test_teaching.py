"""Actions: whom they ask, in which order, and what they do when the answer is no."""

import asyncio

import pytest

from teleop_node.keys import Action
from teleop_node.teaching import Answer, Teaching


class Here:
    """Learner, controller and robot, in a list of what they were asked."""

    def __init__(self, simulated=True, trying=False, refused=(), recording=False):
        self.asked, self.recording = [], recording
        self.simulated, self.trying, self.refused = simulated, trying, refused
        self.gate = None

    async def ask(self, service, on=None):
        self.asked.append(service if on is None else f'{service} {on}')
        if self.gate is not None:
            await self.gate.wait()
        return Answer(service not in self.refused, f'{service} says so')

    async def is_simulated(self):
        return self.simulated

    async def set_back(self):
        self.asked.append('set back')
        return Answer('set back' not in self.refused, 'set back says so')

    def is_trying(self):
        return self.trying

    def is_recording(self):
        return self.recording

    def demonstration_began(self):
        self.asked.append('began')

    def halt(self):
        self.asked.append('halt')

    def let_go(self):
        self.asked.append('let go')

    def quit(self):
        self.asked.append('quit')


def perform(here, *actions):
    async def one_after_the_other():
        teaching = Teaching(here, 'l', 'c')
        return [await teaching.perform(action) for action in actions]
    return asyncio.run(one_after_the_other())


RECORD, DISCARD = 'l/record_demonstration', 'l/discard_demonstration'


@pytest.mark.parametrize(('action', 'asked'), [
    (Action.START, [f'{RECORD} True', 'began']),
    (Action.KEEP, [f'{RECORD} False']),
    (Action.REDO, [DISCARD, 'set back', f'{RECORD} True', 'began']),
    (Action.DROP_LAST, ['l/drop_last']),
    (Action.LABEL_SUCCESS, ['l/label_success']),
    (Action.LABEL_FAILURE, ['l/label_failure']),
    (Action.RUN_TRIALS, ['l/run_trials']),
    (Action.QUIT, ['quit'])])
def test_every_action_lets_go_of_the_keys_and_asks(action, asked):
    here = Here()
    answer, = perform(here, action)
    assert here.asked == ['let go', *asked]
    assert answer.success


def test_a_real_robot_is_not_set_back_and_tries_once():
    here = Here(simulated=False)
    perform(here, Action.REDO, Action.RUN_TRIALS)
    assert here.asked == ['let go', DISCARD, f'{RECORD} True', 'began', 'let go', 'c/start_trial']


def test_a_real_robot_does_not_try_while_a_demonstration_is_recorded():
    here = Here(simulated=False, recording=True)
    answer, = perform(here, Action.RUN_TRIALS)
    assert here.asked == ['let go']
    assert not answer.success
    assert answer.message.startswith('cannot run a trial now: a demonstration is recorded; n keep')


@pytest.mark.parametrize(('trying', 'asked'), [(True, ['c/stop_trial']), (False, [])])
def test_stop_stops_the_robot_whoever_drives_it_and_ends_a_trial(trying, asked):
    here = Here(trying=trying)
    answer, = perform(here, Action.STOP)
    assert here.asked == ['halt', *asked]
    assert answer.success


@pytest.mark.parametrize(('refused', 'asked'), [
    (DISCARD, [DISCARD]), ('set back', [DISCARD, 'set back']),
    (RECORD, [DISCARD, 'set back', f'{RECORD} True'])])
def test_redo_goes_no_farther_than_it_is_let(refused, asked):
    here = Here(refused=(refused,))
    answer, = perform(here, Action.REDO)
    assert here.asked == ['let go', *asked]
    assert answer == (False, f'{refused} says so')


def test_one_at_a_time_but_stopping_never_waits():
    here = Here(trying=True)

    async def both():
        teaching = Teaching(here, 'l', 'c')
        here.gate = asyncio.Event()
        keeping = asyncio.create_task(teaching.perform(Action.KEEP))
        await asyncio.sleep(0)
        refused = await teaching.perform(Action.START)
        stopping = asyncio.create_task(teaching.perform(Action.STOP))
        await asyncio.sleep(0)
        assert here.asked[-1] == 'c/stop_trial'
        here.gate.set()
        assert (await keeping).success
        assert (await stopping).success
        assert (await teaching.perform(Action.START)).success
        return refused
    assert asyncio.run(both()) == (False, 'still busy with keep')
