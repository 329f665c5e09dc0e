"""Actions: whom they ask, in which order, and what they do when the answer is no."""

import asyncio

import pytest

from msgs_bridge.teaching.actions import Action, DOING
from msgs_bridge.teaching.answers import absence, Answer
from msgs_bridge.teaching.teaching import Teaching


class Here:
    """Learner, controller and robot, in a list of what they were asked."""

    learner, start, teach_here = 'l', (1.0, 2.0, 0.0), [(3.0, 4.0)]

    def __init__(self, simulated=True, trying=False, refused=(), recording=False, series=False):
        self.asked, self.recording, self.series = [], recording, series
        self.simulated, self.is_trying, self.refused = simulated, trying, refused
        self.answers = None

    async def ask(self, service, on=None, patience=60.0, **values):
        about = ''.join(f' {name}={value}' for name, value in values.items())
        self.asked.append(service + about if on is None else f'{service} {on}')
        if self.answers is not None:
            await self.answers.wait()
        return Answer(service not in self.refused, f'{service} says so')

    async def is_simulated(self, patience=0.0):
        return self.simulated

    async def set_back(self):
        self.asked.append('set back')
        return Answer('set back' not in self.refused, 'set back says so')

    async def set_to_start(self, start):
        self.asked.append('set to the start')
        return Answer(start == self.start, 'there')

    async def set_to_next(self, places):
        self.asked.append('set where to teach')
        return Answer(places == self.teach_here, 'there')

    async def set_to_place(self, x, y):
        self.asked.append(f'set to {x} {y}')
        return Answer(True, 'there')

    def has_series(self, now):
        return self.series

    def is_recording(self, now):
        return self.recording

    async def mark_start(self):
        self.asked.append('began')

    def halt(self):
        self.asked.append('halt')

    def let_go(self):
        self.asked.append('let go')

    def teaching(self):
        return Teaching(self, self, self, self)


def perform(here, *actions):
    async def one_after_the_other():
        teaching = here.teaching()
        answers = [await teaching.perform(action) for action in actions]
        assert teaching.has_quit == (Action.QUIT in actions)
        return answers
    return asyncio.run(one_after_the_other())


STOPS = ['stop_trial', 'stop_trials']
RECORD, DISCARD = 'record_demonstration', 'discard_demonstration'


@pytest.mark.parametrize(('action', 'asked'), [
    (Action.START, [f'{RECORD} True', 'began']),
    (Action.KEEP, [f'{RECORD} False']),
    (Action.REDO, [DISCARD, 'set back', f'{RECORD} True', 'began']),
    (Action.CANCEL, [DISCARD]),
    (Action.DROP_LAST, ['drop_last']),
    (Action.UNDO, ['undo']),
    (Action.SET_BACK, ['set to the start']),
    (Action.TEACH_HERE, ['set where to teach']),
    (Action.LABEL_SUCCESS, ['label_success']),
    (Action.LABEL_FAILURE, ['label_failure']),
    (Action.RUN_TRIALS, ['run_trials']),
    (Action.QUIT, STOPS)])
def test_every_action_lets_go_of_the_keys_and_asks(action, asked):
    here = Here()
    answer, = perform(here, action)
    assert here.asked == ['let go', *asked]
    assert answer.success


@pytest.mark.parametrize(('action', 'values', 'asked'), [
    (Action.DROP_LAST, {'episode': '0002_demo'}, 'drop_last episode=0002_demo'),
    (Action.LABEL_SUCCESS, {'episode': '0002_demo'}, 'label_success episode=0002_demo'),
    (Action.RUN_TRIALS, {'n': 3}, 'run_trials n=3'),
    (Action.TEACH_HERE, {'x': 1.0, 'y': 2.0}, 'set to 1.0 2.0')])
def test_what_an_action_is_about_is_passed_on(action, values, asked):
    here = Here()
    assert asyncio.run(here.teaching().perform(action, **values)).success
    assert here.asked == ['let go', asked]


@pytest.mark.parametrize(('state', 'code'), [
    ({'recording': True}, 'recording'), ({'trying': True}, 'trying'), ({'series': True}, 'trying'),
    ({'simulated': None}, 'no_learner'), ({'simulated': False}, 'real_robot')])
def test_why_the_robot_is_not_set_back_has_a_code(state, code):
    answer, = perform(Here(**state), Action.SET_BACK)
    assert (answer.success, answer.code) == (False, code)


def test_a_real_robot_is_not_set_back_and_tries_once():
    here = Here(simulated=False)
    redone, tried, back, there = perform(
        here, Action.REDO, Action.RUN_TRIALS, Action.SET_BACK, Action.TEACH_HERE)
    # Its drive back is no part of the way.
    assert here.asked == ['let go', DISCARD, 'let go', 'start_trial', 'let go', 'let go']
    assert redone == (
        True, f'{DISCARD} says so; drive the robot back to the start, then press s', 'drive_back')
    assert tried.success
    assert back == (
        False, 'a real robot is not set back: drive it back by the keys', 'real_robot')
    assert there.success
    assert there.message.startswith('one more drive to the goal helps most from one of these')
    assert there.code == 'drive_there'


@pytest.mark.parametrize('action', [Action.SET_BACK, Action.TEACH_HERE])
def test_without_a_learner_nobody_is_called_a_real_robot(action):
    assert perform(Here(simulated=None), action) == [(False, absence('l'), 'no_learner')]


def test_a_learner_that_cannot_say_whether_the_robot_is_simulated_is_named():
    here = Here(simulated=None)
    answer, = perform(here, Action.REDO)
    assert here.asked == ['let go', DISCARD]
    assert answer == (False, f'{DISCARD} says so; {absence("l")}', 'no_learner')


@pytest.mark.parametrize(('state', 'words'), [
    ({'recording': True}, 'a drive is being recorded; press n to keep it, r to begin'),
    ({'trying': True}, 'the robot tries by itself; press space to stop it'),
    ({'series': True}, 'the robot tries')])
@pytest.mark.parametrize('action', [Action.SET_BACK, Action.TEACH_HERE])
def test_a_robot_that_is_recorded_or_tries_stays_where_it_is(state, words, action):
    here = Here(**state)
    answer, = perform(here, action)
    assert here.asked == ['let go']
    assert not answer.success
    assert words in answer.message


def test_a_real_robot_does_not_try_while_a_demonstration_is_recorded():
    here = Here(simulated=False, recording=True)
    answer, = perform(here, Action.RUN_TRIALS)
    assert here.asked == ['let go']
    assert not answer.success
    assert answer.message.startswith('cannot run a trial now: a drive is being recorded; press n')


@pytest.mark.parametrize(('trying', 'series'), [(True, False), (False, True), (True, True)])
@pytest.mark.parametrize(('action', 'before', 'after'), [
    (Action.STOP, ['halt'], []), (Action.QUIT, ['let go'], [])])
def test_who_stops_or_quits_ends_the_trial_and_the_series(trying, series, action, before, after):
    here = Here(trying=trying, series=series)
    answer, = perform(here, action)
    assert here.asked == [*before, 'halt', *STOPS, *after]
    assert answer == (True, 'stop_trial says so; stop_trials says so', '')


def test_who_leaves_a_recording_reads_that_it_goes_on():
    answer, = perform(Here(recording=True), Action.QUIT)
    assert 'Start teleop_node again soon to go on, and press n to keep it' in answer.message


def test_where_nothing_drives_by_itself_a_stop_asks_nobody():
    here = Here()
    answer, = perform(here, Action.STOP)
    assert here.asked == ['halt']
    assert answer.success


@pytest.mark.parametrize('refused', [('stop_trial',), ('stop_trial', 'stop_trials')])
def test_a_trial_that_cannot_be_ended_is_asked_again_and_named(refused):
    here = Here(trying=True, refused=refused)
    stopped, left = perform(here, Action.STOP, Action.QUIT)
    assert here.asked.count('stop_trial') == 4
    assert stopped == (False, 'the trial may go on: stop_trial says so', 'may_go_on')
    assert left.message == stopped.message


@pytest.mark.parametrize(('refused', 'asked'), [
    (DISCARD, [DISCARD]), ('set back', [DISCARD, 'set back']),
    (RECORD, [DISCARD, 'set back', f'{RECORD} True'])])
def test_redo_goes_no_farther_than_it_is_let(refused, asked):
    here = Here(refused=(refused,))
    answer, = perform(here, Action.REDO)
    assert here.asked == ['let go', *asked]
    assert not answer.success
    assert answer.message.endswith(f'{refused} says so')


def test_a_stop_while_trials_are_asked_for_ends_them_whoever_is_quicker():
    here = Here()

    async def both():
        teaching = here.teaching()
        here.answers = asyncio.Event()
        running = asyncio.create_task(teaching.perform(Action.RUN_TRIALS))
        await asyncio.sleep(0)
        stopping = asyncio.create_task(teaching.perform(Action.STOP))
        await asyncio.sleep(0)
        here.answers.set()
        await asyncio.gather(running, stopping)
    asyncio.run(both())
    assert here.asked[:2] == ['let go', 'run_trials']
    assert here.asked.count('stop_trials') == 2


def test_what_every_action_does_is_said_in_words():
    assert {*DOING} == {*Action} - {Action.STOP, Action.QUIT}
    assert not any('_' in words for words in DOING.values())


def test_one_at_a_time_but_stopping_never_waits():
    here = Here(trying=True)

    async def both():
        teaching = here.teaching()
        here.answers = asyncio.Event()
        keeping = asyncio.create_task(teaching.perform(Action.KEEP))
        await asyncio.sleep(0)
        refused = await teaching.perform(Action.START)
        stopping = asyncio.create_task(teaching.perform(Action.STOP))
        await asyncio.sleep(0)
        assert here.asked[-1] == 'stop_trial'
        here.answers.set()
        assert (await keeping).success
        assert (await stopping).success
        assert (await teaching.perform(Action.START)).success
        return refused
    assert asyncio.run(both()) == (
        False, 'still keeping the drive; press it again when that is done', 'busy')


@pytest.mark.parametrize(('success', 'message', 'sentence'), [
    (True, 'recording kitchen/0001: drive', 'Recording kitchen/0001: drive.'),
    (True, 'kitchen/0001 is back. From all', 'kitchen/0001 is back. From all.'),
    (True, 'is something there?', 'Is something there?'),
    (False, 'learner_node is not there', 'Not done: learner_node is not there.'),
    (False, 'cannot run a trial now', 'Not done: cannot run a trial now.')])
def test_an_answer_is_told_as_a_sentence(success, message, sentence):
    assert Answer(success, message).sentence == sentence
