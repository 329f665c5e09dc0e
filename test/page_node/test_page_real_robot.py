"""The page of a robot that nobody sets back; what it says of a second learner, and of none."""

import pytest

from page_client import PageClient
from ros_helpers import start_node


@pytest.fixture(scope='module')
def node_changes():
    """Let learner and page take the simulated robot for a real one."""
    return {'sim_node': {'speed_factor': 5.0, 'rate': 20.0, 'cmd_vel_timeout': 1.0},
            'learner_node': {'simulation': False}, 'page_node': {'simulation': False}}


@pytest.fixture
def client(page_stack):
    with PageClient(page_stack.url).looking() as client:
        client.wait(lambda: all(client.state['nodes'].values()) and 'robot' in client.frames,
                    'robot, learner and controller', 60.0)
        yield client


def ends(client, number):
    return client.state['trial']['number'] == number and client.state['phase'] == 'idle' and (
        client.state['trial']['state'] == 'ended')


def test_it_is_driven_back_by_whoever_teaches(client):
    x, _ = client.place
    assert not client.state['simulation']
    assert 'truth' not in client.frames
    assert client.ask('set_back')['code'] == 'real_robot'
    assert client.ask('start')['success']
    assert client.ask('redo')['code'] == 'drive_back'
    assert client.ask('start')['success']
    client.drive(1.0, 0.0, lambda: client.place[0] > x + 0.8, 'the way')
    assert client.ask('keep')['success']
    client.wait(lambda: client.state['advice']['code'] == 'try_real', 'what was learnt')
    assert client.ask('teach_here')['code'] == 'drive_there'

    # From the goal it has nothing to do; the second of the tries waits for the way back.
    client.drive(-1.0, 0.0, lambda: client.place[0] < x + 0.1, 'the way back')
    assert client.ask('run_trials', n=2)['success']
    client.wait(lambda: ends(client, 1), 'the first try')
    client.wait(lambda: client.state['advice']['code'] == 'drive_back', 'that it is to go back')
    assert (client.state['tries_left'], client.state['trials_left']) == (1, 0)
    client.drive(-1.0, 0.0, lambda: client.place[0] < x + 0.1, 'the way back')
    assert client.ask('run_trials')['success']
    client.wait(lambda: ends(client, 2), 'the second try')
    client.wait(lambda: client.state['advice']['code'] == 'ended_goal_real', 'its end')
    assert client.state['tries_left'] == 0


def test_a_second_learner_is_told_of_and_nothing_is_taught(page_stack, client, ros_domain):
    with start_node('learner_node.node', page_stack.folder, {
            'bags': str(page_stack.folder / 'other'), 'task': 'other'},
            env={'ROS_DOMAIN_ID': str(ros_domain)}):
        client.wait(lambda: client.state['advice']['code'] == 'conflict', 'the conflict')
        assert '2 learners' in client.state['advice']['details']
        assert client.ask('start')['code'] == 'conflict'


def test_without_a_learner_the_page_says_so_and_does_not_wait(page_stack, client):
    page_stack.kill('learner_node')
    client.wait(lambda: client.state['advice']['code'] == 'no_learner', 'that it is missed')
    assert client.ask('start')['code'] == 'no_learner'
