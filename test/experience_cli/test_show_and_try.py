"""What the demo asks of nodes, and what it says meanwhile; the nodes are made up."""

import argparse
import io
from types import SimpleNamespace

import pytest

from control_field.grid import Grid
from control_field.records import Outcome
from experience_cli.demo import attach as attaching
from experience_cli.demo.attach import attach
from experience_cli.demo.show_and_try import teach, try_it, WAY
from experience_cli.errors import UserError
from experience_cli.terminal import Progress
from learner_node.reports import NEXT
from msgs_bridge.messages.trial_status import State, TrialStatus


class Robot:
    """A robot with its nodes: it does what is asked, and each look at it is a step further."""

    def __init__(self, revision=0, *_):
        self.asked = []
        self.learner = {'revision': str(revision), 'phase': 'idle', 'trials_left': '0',
                        'prototypes': '12', 'basin': '0.5'}
        self.status = None

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def wait_for_peers(self, tell, patience):
        tell('odometry on odom')

    def ask(self, name, data=None):
        self.asked.append((name, data))
        if name.endswith('run_trials'):
            self.learner['trials_left'] = '2'
        elif not data:
            self.learner['revision'] = '1'
        return f'Drive 0001 kept. {NEXT}'

    def drive(self, driver, tell):
        self.asked.append(('drive', driver.length))
        tell(0.5)

    def set_parameter(self, *words):
        self.asked.append(words)

    def wait_until(self, is_done, what, patience):
        assert not is_done()
        for trial in (1, 2):
            self.status = status(trial, None)
            assert not is_done()
            self.status = status(trial, Outcome.GOAL)
            self.learner |= {'trial': str(trial), 'bag': f'task1/000{trial + 1}',
                             'trials_left': str(2 - trial), 'revision': str(trial + 1)}
            assert is_done() == (trial == 2)


def status(trial, outcome):
    return TrialStatus(State.RUNNING if outcome is None else State.ENDED, trial, outcome, 30)


@pytest.fixture
def said():
    return io.StringIO()


def test_the_way_is_driven_and_kept_and_nobody_is_told_to_press_a_key(said):
    robot = Robot()
    teach(robot, Progress('task1', said))
    record = 'learner_node/record_demonstration'
    length = (13 + 13) * Grid(20, 20, 0.25).resolution
    assert robot.asked == [(record, True), ('drive', pytest.approx(length)), (record, False)]
    assert said.getvalue() == 'task1: Drive 0001 kept.\n'
    assert len(WAY) == 3


def test_every_trial_is_said_once_with_its_bag(said):
    robot = Robot(revision=1)
    try_it(robot, 'task1', 2, Progress('task1', said))
    assert robot.asked == [('sim_node', 'world', 'task1'), ('learner_node/run_trials', None)]
    first, second = said.getvalue().splitlines()
    assert 'trial 1 (task1/0002)' in first
    assert 'trial 2 (task1/0003)' in second


def test_who_moves_comes_with_the_world(said):
    robot = Robot(revision=1)
    try_it(robot, 'task1', 2, Progress('task1', said), '/crossing.yaml')
    assert robot.asked[:2] == [
        ('sim_node', 'world', 'task1'), ('sim_node', 'movers', '/crossing.yaml')]


@pytest.mark.parametrize(('revision', 'taught'), [(0, True), (3, False)])
def test_nodes_that_run_are_taught_unless_they_know_the_way(
    monkeypatch, capsys, revision, taught,
):
    robot = Robot(revision=revision)
    monkeypatch.setattr(attaching, 'DemoNode', lambda *_: robot)
    if revision:
        monkeypatch.setattr(attaching, 'try_it', lambda *_: None)
    assert attach('task1', 'task1', argparse.Namespace(
        trials=2, namespace='', movers='')) == 0
    assert ('learner_node', 'auto_trials', 2) in robot.asked
    assert any(words[0] == 'drive' for words in robot.asked) == taught
    out = capsys.readouterr().out
    assert ('the learner knows the way (3 bags)' in out) != taught
    assert out.splitlines()[-1] == 'task1: the trials are over: 12 prototypes, basin 50.0%'


def test_what_is_waited_for_is_said_once_it_takes_a_while(monkeypatch, said):
    now = [0.0]
    monkeypatch.setattr(attaching, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    waiting = attaching._Waiting(Progress('task1', said))
    for now[0], what in ((1.0, 'sim_node'), (2.0, 'sim_node'), (3.0, 'sim_node'), (4.0, 'odom')):
        waiting(what)
    assert said.getvalue() == 'task1: waiting for sim_node\ntask1: waiting for odom\n'


def test_a_domain_that_is_no_number_is_one_line(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', 'mine')
    with pytest.raises(UserError, match="ROS_DOMAIN_ID is 'mine', must be a number"):
        attach('task1', 'task1', argparse.Namespace(trials=1, namespace=''))
