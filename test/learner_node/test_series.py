"""Series of trials: one after the other, retries, what is given up."""

import pytest

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from episode_store.task_folder import EpisodeKind
from learner_node.session.inputs import Peers
from learner_node.session.outputs import (
    Abandon, Close, Discard, Place, Record, Say, StartTrial, StopTrial)
from learner_node.session.phases import Phase, SessionError
from learner_node.session.series import LOCAL_GRID_PATIENCE, LOST, MAX_REQUESTS
from learner_node.session.session import Session
from learner_node.settings import Settings
from session_helpers import ended, HERE, idle, Play, running, START, warnings_of


class TestTrials:

    def test_run_one_after_the_other(self, play):
        assert play('series.run', 2) == [Place(START)]
        for trial in (1, 2):
            assert play('on_pose', *HERE) == [Record(EpisodeKind.TRIAL), StartTrial()]
            play('on_start_response', True, '')
            play('on_status', running(trial, revision=trial))
            play('trials.on_decisions', trial, 3)
            assert play('on_status', ended(trial)) == [Close()]
            play('on_learnt', trial + 1)
            outputs = play('on_status', idle(trial + 1, trial))
            assert outputs == ([Place(START)] if trial == 1 else [])
        assert play.phase is Phase.IDLE
        assert play.session.series.n_left == 0

    def test_need_a_field(self):
        with pytest.raises(SessionError, match='show the way first'):
            Play()('series.run', 1)

    def test_that_begin_by_themselves_wait_for_what_stands_against_them(self, play):
        play.session.state.why_not = lambda operation: '2 learners in one namespace'
        with pytest.raises(SessionError, match='2 learners'):
            play('series.run', 2)
        assert play('series.begin', 2) == []
        assert play.phase is Phase.WAITING
        play.session.state.why_not = lambda operation: ''
        assert Place(START) in play.wait(1.0)

    def test_of_a_real_robot_are_started_by_a_person(self, play):
        real = Session(Settings(), lambda: START)
        with pytest.raises(SessionError, match='control_field_node/start_trial'):
            real.series.run(1, 0.0)

    def test_start_on_the_newest_field_only(self, play):
        play('on_status', idle(revision=0))
        assert play('series.run', 1) == []
        assert play.phase is Phase.WAITING
        assert play('on_status', idle(revision=1)) == [Place(START)]

    def test_start_only_where_the_robot_was_placed(self, play):
        play('series.run', 1)
        assert play('on_pose', START.x + 0.1, START.y, START.yaw) == []
        assert play('on_pose', START.x, START.y, START.yaw + 0.1) == []
        assert play('on_pose', *HERE)

    def test_start_when_the_local_grid_is_of_where_the_robot_was_placed(self, play):
        play('on_local_grid', 0.9)
        play('series.run', 1)
        play('on_odometry', 1.0)
        assert play('on_pose', *HERE) == []
        assert play('on_local_grid', 0.95) == []
        play('on_odometry', 1.1)
        assert play('on_pose', *HERE) == []
        assert play.wait(0.5) == []  # it is not set back again meanwhile
        assert play('on_local_grid', 1.0) == [Record(EpisodeKind.TRIAL), StartTrial()]

    def test_start_also_where_no_more_is_seen(self, play):
        play('on_local_grid', 0.9)
        play('series.run', 1)
        play('on_odometry', 1.0)
        assert play('on_pose', *HERE) == []
        assert play.wait(LOCAL_GRID_PATIENCE - 0.05) == []
        assert play.wait(0.1) == [Record(EpisodeKind.TRIAL), StartTrial()]

    def test_start_each_on_a_local_grid_of_its_own(self, trying):
        trying('on_local_grid', 1.0)
        trying('trials.on_decisions', 1, 3)
        trying('on_status', ended())
        assert trying('on_learnt', 1) == [Place(START)]
        trying('on_odometry', 2.0)
        assert trying('on_pose', *HERE) == []
        assert trying('on_local_grid', 2.0) == [Record(EpisodeKind.TRIAL), StartTrial()]

    def test_are_closed_when_the_last_decision_is_there(self, trying):
        assert trying('on_status', ended(decisions=3)) == []
        assert trying('trials.on_decisions', 1, 2) == []
        assert trying('trials.on_decisions', 1, 1) == [Close()]

    def test_are_closed_when_the_drive_is_there_up_to_its_end(self, trying):
        trying('trials.on_decisions', 1, 3)
        assert trying('on_status', ended(stamp=2.0)) == []
        assert trying('on_odometry', 1.95) == []
        assert trying('on_odometry', 2.0) == [Close()]

    def test_are_closed_without_the_last_odometry(self, trying):
        trying('trials.on_decisions', 1, 3)
        trying('on_status', ended(stamp=2.0))
        assert trying.wait(0.4) == [Close()]

    def test_do_not_count_decisions_of_others(self, trying):
        trying('trials.on_decisions', 7, 3)
        assert trying('on_status', ended(decisions=3)) == []

    def test_that_end_at_once_need_not_be_seen_running(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        play('trials.on_decisions', 1, 3)
        assert play('on_status', ended()) == [Close()]

    def test_that_a_person_starts_are_recorded(self, play):
        play('trials.on_decisions', 4, 1)
        assert play('on_status', running(4, decisions=1)) == [Record(EpisodeKind.TRIAL)]
        play('trials.on_decisions', 4, 2)
        assert play('on_status', ended(4)) == [Close()]
        play('on_learnt', 2)
        assert play.phase is Phase.IDLE

    def test_whose_beginning_was_missed_are_not_recorded(self, play):
        assert play('on_status', running(4, decisions=2)) == []
        assert play.phase is Phase.IDLE

    def test_stop_when_asked(self, trying):
        assert trying('series.stop') == [StopTrial()]
        trying('trials.on_decisions', 1, 3)
        assert trying('on_status', ended(outcome=Outcome.STOPPED)) == [Close()]
        trying('on_learnt', 2)
        assert trying.phase is Phase.IDLE

    @pytest.mark.parametrize('reason', [StopReason.ASKED, StopReason.NO_HEARTBEAT])
    def test_stop_when_the_controller_was_asked_or_nobody_watches(self, trying, reason):
        trying('trials.on_decisions', 1, 3)
        trying('on_status', ended(outcome=Outcome.STOPPED, stop_reason=reason))
        trying('on_learnt', 2)
        assert trying.phase is Phase.IDLE

    def test_that_a_person_stopped_do_not_begin_by_themselves(self, trying):
        assert not trying.session.series.is_stopped
        trying('series.stop')
        assert trying.session.series.is_stopped
        trying('on_status', ended(decisions=0, outcome=Outcome.STOPPED))
        trying('on_odometry', 1.0)
        trying('on_learnt', 2)
        assert trying.session.series.is_stopped
        trying('series.run', 1)
        assert not trying.session.series.is_stopped

    def test_that_do_not_run_cannot_be_stopped(self, play):
        with pytest.raises(SessionError, match='no trials'):
            play('series.stop')

    def test_stop_while_waiting(self, play):
        play('on_peers', Peers())
        play('series.run', 3)
        assert play('series.stop') == []
        assert play.phase is Phase.IDLE


class TestRetries:

    def test_the_robot_is_placed_again(self, play):
        play('series.run', 1)
        assert set(play.wait(1.0)) == {Place(START)}

    def test_a_refused_start_is_asked_for_again(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        play('on_start_response', False, 'a person is driving')
        assert play.wait(0.4) == [StartTrial()]

    def test_a_start_that_is_refused_in_vain_is_not_called_unanswered(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        while not warnings_of(play.log):
            play('on_start_response', False, 'nobody watches over the robot')
            play.wait(3.0)
        said = warnings_of(play.log)[0]
        assert said.endswith('the controller does not start it: nobody watches over the robot')

    def test_starts_refused_for_long_leave_no_bag(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        for _ in range(MAX_REQUESTS):
            play('on_start_response', False, 'a person is driving')
            play.wait(0.4)
        assert Discard() in play.log
        assert any(isinstance(output, Say) and 'broken off' in output.text for output in play.log)
        assert play.session.series.n_left == 1

    def test_a_trial_that_is_being_started_is_called_so(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        with pytest.raises(SessionError, match='cannot change a bag now: a trial is being start'):
            play('relearn')

    def test_a_start_that_may_yet_be_answered_is_not_asked_for_twice(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        play('on_start_response', True, '')
        assert play.wait(0.05 * LOST - 0.1) == []
        assert play.wait(0.3) == [StartTrial()]  # it was lost

    def test_a_learner_that_was_held_up_looks_at_what_has_come_first(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        play.now += 8.0
        assert play('tick') == []
        assert play('on_status', running()) == []
        assert play.phase is Phase.TRIAL

    def test_a_controller_that_begins_is_asked_anew(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        assert play('on_status', idle()) == []
        assert play.wait(0.4) == [StartTrial()]

    def test_a_start_that_nobody_answers_is_given_up(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        outputs = play.wait(12.1)
        assert outputs.count(StartTrial()) == 3
        assert any(isinstance(output, Say) and 'does not answer' in output.text
                   for output in outputs)
        assert Discard() in outputs

    def test_a_trial_on_an_old_field_is_broken_off(self, play):
        play('series.run', 1)
        play('on_pose', *HERE)
        outputs = play('on_status', running(1, revision=0))
        assert [type(output) for output in outputs] == [Say, Abandon, StopTrial]
        assert play.phase is Phase.WAITING


class TestAStopThatIsNotHeard:

    @pytest.fixture
    def waiting(self, trying):
        """Return a session that waits for the end of trial 1, as far as it has heard."""
        while trying.phase is Phase.TRIAL:
            trying.wait(0.5)
        assert StopTrial() in trying.wait(0.5)
        return trying

    def test_is_said_once_with_who_does_not_answer_and_what_to_do(self, waiting):
        [said] = warnings_of(waiting.wait(20.0))
        assert said.startswith('the next trial waits: control_field_node has not answered '
                               'stop_trial for 5 s, and trial 1 may be over: start learner_node')
        assert said.removeprefix('the next trial waits: ') in waiting.session.state.describe()
        assert 'is still running' not in waiting.session.state.describe()

    def test_is_said_with_the_answer_where_one_comes(self, waiting):
        waiting.session.state.unheard_stop.on_answer('no trial is running')
        [said] = warnings_of(waiting.wait(20.0))
        assert 'answers to stop_trial "no trial is running"' in said

    def test_ends_the_series(self, waiting):
        said = warnings_of(waiting.wait(40.0))
        assert said[-1].startswith('no more trials are run: control_field_node has not answered')
        assert waiting.phase is Phase.IDLE
        assert waiting.session.series.n_left == 0
        assert not waiting.session.series.is_stopped

    def test_is_forgotten_when_the_controller_is_heard(self, waiting):
        waiting.wait(20.0)
        assert waiting('on_status', ended(1)) == [Place(START)]
        waiting('series.stop')
        waiting('on_status', running(2, decisions=1))
        waiting('series.run', 1)
        assert waiting.session.state.describe() == 'waiting: trial 2 is still running'

    def test_does_not_count_the_time_in_which_the_learner_itself_was_suspended(self, waiting):
        waiting.now += 60.0
        assert not warnings_of(waiting.wait(1.0))

    def test_of_a_controller_that_is_gone_after_a_sleep_says_so(self, trying):
        trying.now += 7.0
        trying('tick')
        trying.wait(6.0)
        trying('on_peers', Peers(robot=True))
        said = trying.session.state.describe()
        assert 'control_field_node is not there, or has not been found again since' in said
        assert 'suspended for 7 s: if it runs, start learner_node anew' in said
        trying('on_peers', Peers(controller=True, robot=True))
        trying('on_status', idle(2))
        trying('on_peers', Peers(robot=True))
        assert trying.session.state.describe() == 'waiting: control_field_node is not there'
