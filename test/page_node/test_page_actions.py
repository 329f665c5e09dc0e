"""The page's actions on real nodes: what they answer, and what the view shows then."""

import re

import pytest

from page_client import PageClient
from ros_helpers import wait_until


@pytest.fixture(scope='module')
def node_changes():
    """Let the simulator go fast; three metres are driven in a few seconds."""
    return {'sim_node': {'speed_factor': 5.0, 'rate': 20.0, 'cmd_vel_timeout': 1.0}}


@pytest.fixture
def client(page_stack):
    with PageClient(page_stack.url).looking() as client:
        client.wait(lambda: all(client.state['nodes'].values()) and 'robot' in client.frames,
                    'robot, learner and controller', 60.0)
        yield client


def is_idle(client):
    return client.state['phase'] == 'idle'


def test_before_anything_was_shown_every_refusal_has_its_code(client):
    client.wait(lambda: client.state['advice']['code'] == 'show_first', 'that it is ready')
    assert client.state['simulation']
    assert {action: client.ask(action)['code'] for action in (
        'keep', 'redo', 'cancel', 'undo', 'drop_last', 'label_success', 'run_trials',
        'teach_here')} == {
            'keep': 'not_recording', 'redo': 'not_recording', 'cancel': 'not_recording',
            'undo': 'nothing_there', 'drop_last': 'nothing_there',
            'label_success': 'nothing_there', 'run_trials': 'nothing_learnt',
            'teach_here': 'nowhere'}
    assert client.ask('stop')['success']


def test_teach_redo_keep_try_stop_remove_and_undo(client):
    x, y = client.place
    assert client.ask('start')['success']
    client.wait(lambda: client.state['advice']['code'] == 'record_begin', 'the recording')
    assert {client.ask(action)['code'] for action in ('start', 'set_back', 'teach_here')} == {
        'recording'}
    client.drive(1.0, 0.0, lambda: client.place[0] > x + 0.5, 'half of the way')
    assert client.ask('redo')['success']
    client.wait(lambda: client.place[0] < x + 0.1, 'the start')
    kept = show_the_way_on(client, x)
    assert kept['success'], kept
    client.wait(lambda: client.state['prototypes'] > 0 and is_idle(client)
                and client.state['teach_here'], 'what was learnt')
    state = client.state
    assert state['goal'][1] == pytest.approx(y, abs=0.2)
    assert state['start'] is not None
    assert (state['episodes'], state['can_undo'], state['basin']) == (1, True, 1.0)
    assert state['advice']['code'] == 'try_simulated'
    assert 'record' in client.codes
    client.wait(lambda: client.frames['field']['revision'] == 1, 'the field')
    assert client.frames['trail']['kind'] == 'demo'

    place = state['teach_here'][-1]
    there = client.ask('teach_here', x=place[0], y=place[1])
    assert there['success'], there
    client.wait(lambda: client.place == pytest.approx(place, abs=0.06), 'the place')

    assert client.ask('run_trials', n=2)['success']
    client.wait(lambda: client.state['trial']['number'] == 2
                and client.state['trial']['state'] == 'ended' and is_idle(client), 'two trials')
    assert client.state['trial']['outcome'] == 'goal'
    assert client.state['advice']['code'] == 'ended_goal_simulated'
    assert client.state['episodes'] == 3
    assert {'trial_series', 'trial'} & {*client.codes}
    assert 'decision' in client.frames

    # The number of the drive that was begun again is not used once more.
    assert client.ask('forget', episode='0003_trial')['success']
    client.wait(lambda: client.state['episodes'] == 2, 'one less')
    assert client.ask('forget', episode='0003_trial')['code'] == 'nothing_there'
    assert client.ask('undo')['success']
    client.wait(lambda: client.state['episodes'] == 3, 'it back')
    assert client.ask('label_failure', episode='0004_trial')['success']
    assert client.ask('label_success')['success']


def show_the_way_on(client, x):
    """Drive on in a recording that was begun already, and keep it."""
    client.wait(lambda: client.state['phase'] == 'demonstration', 'the recording')
    client.drive(1.0, 0.0, lambda: client.place[0] > x + 0.8, 'the way')
    return client.ask('keep')


def teach(client):
    """Show a way, unless that was done: a test that is run again has nodes that know nothing."""
    if client.state['prototypes'] > 0:
        return
    client.wait(lambda: client.state['advice']['code'] == 'show_first', 'that it is ready')
    x = client.place[0]
    assert client.ask('start')['success']
    assert show_the_way_on(client, x)['success']
    client.wait(lambda: client.state['prototypes'] > 0 and is_idle(client), 'what was learnt')


def test_a_trial_is_corrected_by_driving_and_ended_by_stop(client):
    teach(client)
    assert client.ask('run_trials', n=5)['success']
    client.wait(lambda: client.state['trial']['state'] == 'running', 'a trial')
    client.drive(0.0, 1.0, lambda: client.state['advice']['code'] == 'trial_corrected',
                 'that it is corrected')
    client.wait(lambda: client.state['trial']['state'] == 'running', 'that it goes on')
    client.presses_stop()
    client.wait(lambda: client.state['trials_left'] == 0 and is_idle(client)
                and client.state['trial']['state'] != 'running', 'the end')
    assert client.ask('start')['success']
    assert client.ask('cancel')['success']


def test_a_drive_of_nothing_says_why(client):
    assert client.ask('start')['success']
    assert client.ask('keep')['code'] == 'too_short'
    client.wait(lambda: is_idle(client), 'the end of it')


def test_speeds_are_set_within_what_is_allowed(client):
    assert client.ask('set_speeds', v=0.1, w=0.5)['success']
    client.wait(lambda: client.state['speeds'] == [0.1, 0.5], 'the speeds')
    assert client.ask('set_speeds', v=3.0, w=0.5)['code'] == 'too_fast'


def test_a_page_that_ends_leaves_nothing_driving(page_stack, client):
    teach(client)
    assert client.ask('run_trials', n=5)['success']
    client.wait(lambda: client.state['trial']['state'] == 'running', 'a trial')
    number = client.state['trial']['number']
    page_stack.processes.pop('page_node').stop()
    controller = page_stack.processes['control_field_node']
    wait_until(lambda: re.search(f'trial {number} was stopped .* by request', controller.stderr),
               processes=[*page_stack.processes.values()], what='its end')
