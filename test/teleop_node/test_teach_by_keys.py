"""A person at the keys: drive, redo, keep, watch it try; four real processes and a terminal."""

import re

import pytest
from std_srvs.srv import Trigger

from episode_store.label import read_label
from msgs_bridge.messages.trial_status import Label
from person_helpers import LOCKSTEP, N_TRIALS, Person, REAL_TIME, START
import ros_helpers


@pytest.fixture(params=[LOCKSTEP, REAL_TIME], ids=['lockstep', 'real_time'])
def person(request, ros_node, tmp_path):
    someone = Person(ros_node, tmp_path, request.param)
    with someone.stack:
        someone.wait(lambda: 'ready' in someone.terminal.read(), 'the learner')
        someone.wait(lambda: someone.pose is not None and someone.statuses, 'the others')
        yield someone


#: In lock-step a trial is over before a person can do anything about it.
only_real_time = pytest.mark.parametrize('person', [REAL_TIME], ids=['real_time'], indirect=True)


@pytest.mark.slow
def test_teach_redo_keep_try_label_drop(person):
    person.types('s', 'start demonstration')
    person.wait(lambda: 'RECORDING' in person.terminal.read(), 'the status line')
    person.holds('i', lambda pose: pose.x > 1.2, 'the wrong way')
    person.types('r', 'redo')
    person.wait(lambda: person.is_at(*START), 'the robot set back')
    assert person.episodes() == ['0002_demo']

    person.holds('i', lambda pose: pose.x > 2.55, 'the turn')
    person.holds('j', lambda pose: pose.yaw > 1.45, 'the other direction')
    person.holds('i', lambda pose: pose.y > 2.3, 'the goal')
    person.types('n', 'keep')
    goal = person.pose.x, person.pose.y
    person.wait(lambda: re.search(
        r'goal reached from \d+ % of the places seen', person.terminal.read()), 'the certificate')

    person.types('t', 'run trials')
    person.wait(lambda: len(person.ended()) == N_TRIALS, 'the trials')
    assert {str(status.outcome) for status in person.ended().values()} == {'goal'}
    assert person.is_at(*goal, 0.25)
    person.wait(lambda: f'trial {N_TRIALS} goal' in person.terminal.read(), 'the status line')
    person.wait(lambda: len(person.episodes()) == 1 + N_TRIALS, 'the bags')
    assert person.episodes()[1:] == ['0003_trial', '0004_trial']
    person.wait(lambda: f'trial {N_TRIALS} goal, ' in person.terminal.read() and (
        '(drive/0004)' in person.terminal.lines()[-1]), 'the bag of the trial')

    person.types('f', 'label failure')
    assert read_label(person.folder / 'bags/drive/0004_trial') is Label.FAILURE
    person.types('y', 'label success')
    assert read_label(person.folder / 'bags/drive/0004_trial') is Label.SUCCESS
    person.types('d', 'drop last')
    assert person.episodes() == ['0002_demo', '0003_trial']
    person.types('b', 'undo')
    assert person.episodes() == ['0002_demo', '0003_trial', '0004_trial']
    # The recorder asks for more than is published, and then for less: nobody has to know.
    assert not any('incompatible QoS' in process.stderr for process in person.others)

    person.types('g', 'set back')
    person.wait(lambda: person.is_at(*START), 'the robot at the start')
    person.types('h', 'teach here')
    person.wait(lambda: not person.is_at(*START), 'the robot elsewhere')

    person.terminal.type('\x1b')
    assert person.terminal.wait() == 0
    assert person.terminal.mode() == person.terminal.before


@only_real_time
@pytest.mark.slow
def test_every_action_is_a_service_that_answers_and_keeps_no_key_waiting(person):
    # That the learner hears the robot, too, may take longer.
    person.wait(lambda: person.asks('start_demonstration').success, 'the recording')
    person.holds('i', lambda pose: pose.x > 1.2, 'the wrong way')
    assert person.asks('redo').success
    person.wait(lambda: person.is_at(*START), 'the robot set back')
    person.holds('i', lambda pose: pose.x > 2.6, 'the goal')
    assert 'gets to the goal' in person.asks('keep').message
    assert person.asks('run_trials').success
    person.wait(lambda: len(person.ended()) == N_TRIALS, 'the trials')
    person.wait(lambda: len(person.episodes()) == 1 + N_TRIALS, 'the bags')
    person.wait(lambda: 'ready' in person.terminal.lines()[-1], 'the learner')
    for action, label in (('label_failure', Label.FAILURE), ('label_success', Label.SUCCESS)):
        assert person.asks(action).success
        assert read_label(person.folder / 'bags/drive/0004_trial') is label
    assert person.asks('drop_last').success
    assert person.episodes() == ['0002_demo', '0003_trial']
    assert person.asks('stop').success
    assert not person.asks('keep').success
    person.holds('l', lambda pose: pose.yaw < -0.5, 'a turn')
    assert person.leaves() == 0


@only_real_time
def test_who_drives_against_a_wall_reads_why_nothing_moves(person):
    person.holds('l', lambda pose: pose.yaw < -0.8, 'the wall ahead')
    # Five times as fast, a machine that halts for 20 ms lets the robot go on for 2 cm.
    person.slows_time(0.5)
    person.holds('i', lambda pose: 'HELD: blocked' in person.terminal.read(), 'the wall')
    person.wait(lambda: 'HELD' not in person.terminal.lines()[-1], 'the end of it')
    assert 'collision' not in person.others[0].stderr


@pytest.mark.slow
@pytest.mark.parametrize('pace', [LOCKSTEP, REAL_TIME], ids=['lockstep', 'real_time'])
def test_what_a_trial_drives_is_not_learnt_as_a_persons_way(ros_node, tmp_path, pace):
    person = Person(ros_node, tmp_path, pace, simulation=False)
    with person.stack:
        person.wait(lambda: person.pose is not None and person.statuses, 'the others')
        person.types('s', 'start demonstration')
        person.holds('i', lambda pose: pose.x > 3.0, 'the goal')
        person.types('n', 'keep')
        assert ros_helpers.call(ros_node, Trigger, 'sim_node/reset').success
        person.wait(lambda: person.is_at(*START), 'the robot set back')

        person.types('s', 'start demonstration')
        person.wait(lambda: 'RECORDING' in person.terminal.lines()[-1], 'the status line')
        person.terminal.type('t')
        person.wait(lambda: 'Not done: cannot run a trial now: a drive is being '
                    'recorded; press n to keep it' in person.terminal.read(), 'the refusal')
        answer = ros_helpers.call(ros_node, Trigger, 'control_field_node/start_trial')
        assert not answer.success
        assert 'learner_node records a demonstration' in answer.message
        person.types('a', 'cancel')
        assert person.episodes() == ['0001_demo']
        person.types('s', 'start demonstration')
