"""The status line: what it says, how wide it is, and where its facts come from."""

import math
from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.records import Outcome
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.status import Status
from msgs_bridge.teaching.status_tracker import problem_with_readers, SILENCE, StatusTracker
from teleop_node.status_line import line_from_status, line_over, message_over, share

FULL = Status(phase='demonstration', seconds=12.4, trial=4, trial_state='ended', outcome='goal',
             steps=17, prototypes=34, basin=0.9949, fidelity=1.0, speeds=(0.2, 1.0))


def test_everything_in_order_of_importance():
    assert line_from_status(FULL, 200) == (
        'RECORDING 12 s | trial 4 goal, 17 steps | goal reached from 99 % of the places seen | '
        '0.20 m/s 1.0 rad/s')
    assert line_from_status(FULL, 84) == (
        'RECORDING 12 s | trial 4 goal, 17 steps | goal reached from 99 % of the places seen')
    assert line_from_status(FULL, 79) == 'RECORDING 12 s | trial 4 goal, 17 steps'
    assert line_from_status(FULL, 9) == 'RECORDING'


def test_before_anything_is_there():
    assert line_from_status(Status(), 200) == (
        'no learner | no trial yet | nothing learnt yet | 0.00 m/s 0.0 rad/s')


words = st.text(st.characters(codec='ascii', exclude_categories=('Cc',)))
facts = st.builds(
    Status, st.sampled_from(['', 'idle', 'demonstration', 'trial', 'what is new']),
    st.floats(0, 1e5), st.integers(0, 9999), st.integers(0, 2**32), st.sampled_from(
        ['running', 'paused', 'ended']), st.sampled_from(['', *map(str, Outcome)]), words,
    st.integers(0, 2**32), st.integers(-1, 10**9), st.floats(0, 1) | st.just(math.nan),
    st.floats(0, 1) | st.just(math.nan), st.tuples(st.floats(0, 5), st.floats(0, 20)), words,
    words)


@given(facts, st.integers(-1, 250))
def test_it_is_never_wider_than_the_terminal(some, width):
    line = line_from_status(some, width)
    assert len(line) <= max(width, 0)
    assert '\n' not in line


@given(facts)
def test_a_problem_comes_first(some):
    assert line_from_status(some, 500).startswith(some.problem)


@pytest.mark.parametrize(('value', 'text'), [(1.0, '100 %'), (0.99999, '99 %'), (0.0, '0 %'),
                                             (0.29, '29 %')])
def test_all_is_said_of_all_only(value, text):
    assert share(value) == text


def test_lines_are_written_over_each_other():
    assert line_over('abc') == '\rabc\x1b[K'
    assert message_over('abc') == '\rabc\x1b[K\n'


def diagnostics(name='a/learner_node: learner', **values):
    return DiagnosticArray(status=[DiagnosticStatus(
        name=name, values=[KeyValue(key=k, value=str(v)) for k, v in values.items()])])


def tracker_in(namespace=''):
    return StatusTracker(f'{namespace}/learner_node', f'{namespace}/control_field_node')


class TestStatusTracker:
    def test_the_controller_tells_why_the_robot_stands(self):
        tracker = tracker_in('/a')
        for name, why in (('a', 'a wall'), ('b', 'a door')):
            tracker.on_diagnostics(diagnostics(
                f'{name}/control_field_node: controller', held=why), 1.0)
        assert line_from_status(tracker.at(1.0, (0, 0)), 99).startswith('HELD: a wall | ')
        assert tracker.at(1.1 + SILENCE, (0, 0)).held == ''
        tracker.on_diagnostics(diagnostics('a/control_field_node: controller', held=''), 2.0)
        assert tracker.at(2.0, (0, 0)).held == ''

    def test_a_pause_is_explained(self):
        tracker = tracker_in()
        tracker.on_trial(TrialStatus(State.PAUSED, 2, reason='no odometry', steps=5))
        assert 'trial 2 paused (no odometry), 5 steps' in line_from_status(
            tracker.at(1.0, (0, 0)), 99)

    def test_the_learner_tells(self):
        tracker = tracker_in('/a')
        tracker.on_diagnostics(diagnostics(
            phase='demonstration', trials_left=3, prototypes=34, basin='0.9876',
            fidelity='1.0000'), 10.0)
        tracker.problem = 'p'
        some = tracker.at(12.5, (0.1, 1.0))
        assert (some.phase, some.seconds, some.trials_left) == ('demonstration', 2.5, 3)
        assert (some.prototypes, some.basin, some.fidelity) == (34, 0.9876, 1.0)
        assert (some.speeds, some.problem) == ((0.1, 1.0), 'p')

    def test_a_trial_is_named_with_its_bag(self):
        tracker = tracker_in('/a')
        tracker.on_diagnostics(diagnostics(phase='idle', trial=2, bag='kitchen/0005'), 1.0)
        for trial, bag in ((1, ''), (2, ' (kitchen/0005)')):
            tracker.on_trial(TrialStatus(State.ENDED, trial, Outcome.GOAL, steps=9))
            line = line_from_status(tracker.at(1.0, (0, 0)), 99)
            assert line.split(' | ')[1] == f'trial {trial} goal, 9 steps{bag}'

    @pytest.mark.parametrize(('start', 'places', 'known'), [
        ('1.5 2.0 0.1', '1 2; 3.5 -4', ((1.5, 2.0, 0.1), [(1.0, 2.0), (3.5, -4.0)])),
        ('', '', ((), [])), ('1 2', '1; nan 2; x y; 5 6', ((), [(5.0, 6.0)]))])
    def test_where_to_start_and_to_teach(self, start, places, known):
        tracker = tracker_in('/a')
        tracker.on_diagnostics(diagnostics(start=start, teach_here=places), 1.0)
        assert (tracker.start, tracker.teach_here) == known

    def test_another_robots_learner_does_not(self):
        tracker = tracker_in('/a')
        tracker.on_diagnostics(diagnostics('b/learner_node: learner', phase='idle'), 1.0)
        assert tracker.at(1.0, (0, 0)).phase == ''

    def test_a_learner_that_fell_silent_is_gone(self):
        tracker = tracker_in()
        tracker.on_diagnostics(diagnostics('learner_node: learner', phase='idle'), 1.0)
        assert tracker.at(1.0 + SILENCE, (0, 0)).phase == 'idle'
        assert tracker.at(1.1 + SILENCE, (0, 0)).phase == ''

    def test_whether_it_records_is_known_from_it_and_from_its_answers(self):
        tracker = tracker_in()
        assert not tracker.is_recording(0.0)
        for phase, records in (('demonstration', True), ('settling', True), ('idle', False),
                               ('trial', False)):
            tracker.on_diagnostics(diagnostics('learner_node: learner', phase=phase), 1.0)
            assert tracker.is_recording(1.0) == records
        for on, success, records in ((True, False, False), (True, True, True), (None, True, True),
                                     (False, False, False), (True, True, True)):
            service = 'undo' if on is None else 'record_demonstration'
            tracker.on_answer(service, on, success, 2.0)
            assert tracker.is_recording(2.0) == records
        assert not tracker.is_recording(2.1 + SILENCE)

    @pytest.mark.parametrize('value', ['', 'many', 'nan', 'inf', '1e300'])
    def test_what_is_no_number_stands_for_none(self, value):
        tracker = tracker_in('/a')
        tracker.on_diagnostics(diagnostics(
            phase='idle', trials_left=value, prototypes=value, basin=value), 1.0)
        some = tracker.at(1.0, (0, 0))
        assert (some.trials_left, some.prototypes) == (0, -1)
        assert line_from_status(some, 80)

    def test_trials(self):
        tracker = tracker_in()
        assert not tracker.is_trying
        tracker.on_trial(TrialStatus(State.RUNNING, 2, steps=5))
        assert tracker.is_trying
        assert 'trial 2 running, 5 steps' in line_from_status(tracker.at(1.0, (0, 0)), 99)
        tracker.on_trial(TrialStatus(State.ENDED, 2, Outcome.GOAL, steps=9))
        assert not tracker.is_trying
        tracker.on_trial(TrialStatus(State.IDLE, 2))
        assert not tracker.is_trying
        assert 'trial 2 goal, 9 steps' in line_from_status(tracker.at(1.0, (0, 0)), 99)


def reader(kind, name='robot'):
    return SimpleNamespace(node_name=name, topic_type=f'geometry_msgs/msg/{kind}')


@pytest.mark.parametrize(('mine', 'readers', 'problem', 'words'), [
    ('Twist', [], 'nobody listens on /cmd', ()),
    ('Twist', ['Twist'], '', ()),
    ('Twist', ['Twist', 'TwistStamped'], 'wrong type: set enable_stamped_cmd_vel:=true',
     ('robot reads /cmd as geometry_msgs/msg/TwistStamped', 'publishes geometry_msgs/msg/Twist')),
    ('TwistStamped', ['Twist'], 'wrong type: set enable_stamped_cmd_vel:=false', ('robot',))])
def test_who_reads_the_commands(mine, readers, problem, words):
    said, sentence = problem_with_readers(
        '/cmd', f'geometry_msgs/msg/{mine}', map(reader, readers))
    assert said == problem
    assert bool(sentence) == bool(words)
    assert all(word in sentence for word in words)
