"""The session: phases, retries, lost peers; events in, outputs out."""

import pytest

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from episode_store.task_folder import EpisodeKind
from learner_node.inputs import Peers
from learner_node.outputs import Abandon, Close, Discard, Place, Record, Say, StartTrial, StopTrial
from learner_node.phases import Phase, SessionError
from learner_node.series import LOCAL_GRID_PATIENCE, LOST, MAX_REQUESTS
from learner_node.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import State, TrialStatus
from session_helpers import HERE, Play, START


def idle(revision=1, trial=0):
    return TrialStatus(State.IDLE, trial, revision=revision)


def running(trial=1, revision=1, decisions=0, stamp=0.0):
    return TrialStatus(
        State.RUNNING, trial, revision=revision, decisions=decisions, stamp=stamp)


def ended(trial=1, outcome=Outcome.GOAL, decisions=3, reason='', stamp=0.0, stop_reason=None):
    return TrialStatus(State.ENDED, trial, outcome, reason, decisions=decisions, revision=1,
                       stamp=stamp, stop_reason=stop_reason)


@pytest.fixture
def play():
    """Return a session that has a field and all its peers."""
    play = Play()
    play('begin')
    play('on_odometry', 0.0)
    play('on_peers', Peers(controller=True, robot=True))
    play('on_status', idle())
    play('on_learnt', 1)
    return play


@pytest.fixture
def trying(play):
    """Return a session in the middle of trial 1 of 2."""
    play('series.run', 2)
    play('on_pose', *HERE)
    play('on_start_response', True, '')
    play('on_status', running())
    assert play.phase is Phase.TRIAL
    return play


class TestSleep:
    """The process stood still: SIGSTOP, a closed lid, a machine that swaps."""

    @pytest.mark.parametrize('seconds', [2.0, 30.0])
    def test_what_it_slept_through_is_nobodys_silence(self, trying, seconds):
        trying('on_odometry', 1.0)
        trying('on_command')
        trying.wait(0.5)
        trying.now += seconds
        assert trying.wait(0.1) == []
        assert trying.phase is Phase.TRIAL
        trying('trials.on_decisions', 1, 3)
        trying('on_odometry', 9.0)
        assert trying('on_status', ended(decisions=3, stamp=9.0)) == [Close()]

    def test_silence_after_it_counts(self, trying):
        trying.now += 30.0
        said, *_ = trying.wait(5.2)
        assert said.text.startswith('trial 1 is broken off: no odometry for 5.')

    def test_peers_that_have_to_be_found_anew_have_time(self, trying):
        trying.now += 30.0
        assert trying('on_peers', Peers()) == []
        trying.wait(1.0)
        trying('on_peers', Peers(controller=True, robot=True))
        trying('on_command')
        assert trying.phase is Phase.TRIAL

    def test_peers_that_are_gone_are_missed_a_little_later(self, trying):
        trying.now += 30.0
        assert trying('on_peers', Peers()) == []
        for _ in range(60):
            trying('on_command')
            trying.wait(0.1)
        assert any('went away' in output.text for output in trying('on_peers', Peers())
                   if isinstance(output, Say))

    @pytest.mark.parametrize('status', [running(2), ended(2)])
    def test_a_trial_whose_end_was_slept_through_is_broken_off_and_the_next_left_alone(
        self, trying, status,
    ):
        trying.now += 30.0
        told, bag = trying('on_status', status)
        assert 'trial 1 is broken off' in told.text
        assert 'trial 2 is not recorded either' in told.text
        assert bag == Abandon(bag.reason, 1)
        assert trying.phase is Phase.WAITING

    def test_a_trial_of_which_decisions_are_lost_says_why(self, trying):
        trying.now += 30.0
        trying('trials.on_decisions', 1, 2)
        trying('on_status', ended(decisions=3))
        outputs = trying.wait(5.2)
        assert any('2 of 3 decisions arrived; the learner itself had stood still for 30'
                   in output.text for output in outputs if isinstance(output, Say))


class TestDemonstration:

    def test_is_closed_when_no_more_comes(self, play):
        assert play('demonstration.record') == [Record(EpisodeKind.DEMO)]
        assert play('demonstration.keep') == []
        assert play.phase is Phase.SETTLING
        assert play.wait(0.2) == [Close()]
        assert play.phase is Phase.LEARNING
        assert play('on_learnt', 2) == []
        assert play.phase is Phase.IDLE

    def test_takes_what_still_comes_in(self, play):
        play('demonstration.record')
        play('demonstration.keep')
        for _ in range(5):
            play('on_odometry', 1.0)
            assert play.wait(0.05) == []
        assert Close() in play.wait(0.15)

    def test_of_a_real_robot_does_not_wait_for_quiet(self, play):
        play('demonstration.record')
        play('demonstration.keep')
        outputs = []
        for _ in range(8):
            play('on_odometry', 1.0)
            outputs += play.wait(0.05)
        assert outputs == [Close()]

    def test_waits_for_the_local_grid_of_its_end_but_not_for_long(self, play):
        play('on_local_grid', 0.5)
        play('on_odometry', 1.0)
        play('demonstration.record')
        play('demonstration.keep')
        assert play.wait(0.2) == []
        play('on_local_grid', 1.0)
        assert play.wait(0.05) == [Close()]
        play('on_learnt', 2)
        play('on_odometry', 2.0)
        play('demonstration.record')
        play('demonstration.keep')
        assert play.wait(0.4) == [Close()]

    def test_can_be_thrown_away(self, play):
        play('demonstration.record')
        assert play('demonstration.discard') == [Discard()]
        assert play.phase is Phase.IDLE

    @pytest.mark.parametrize('request_', ['demonstration.keep', 'demonstration.discard'])
    def test_that_is_not_there_cannot_be_kept_or_thrown_away(self, play, request_):
        with pytest.raises(SessionError, match='no demonstration'):
            play(request_)

    def test_needs_odometry(self):
        with pytest.raises(SessionError, match='no odometry'):
            Play()('demonstration.record')

    def test_waits_for_the_bags_to_be_learnt(self):
        play = Play()
        play('begin')
        with pytest.raises(SessionError, match='learning'):
            play('demonstration.record')

    def test_does_not_begin_during_a_trial(self, trying):
        with pytest.raises(SessionError, match='trial 1 is under way'):
            trying('demonstration.record')


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


def warnings_of(outputs):
    return [output.text for output in outputs if isinstance(output, Say) and output.warns]


class TestTrialsOfOthers:
    """Those that a person starts while the session does something else."""

    def start_while_learning(self, play, seen, decisions=4):
        play('relearn')
        play('on_status', running(7))
        if seen:
            play('trials.on_decisions', 7, seen)
        play('on_status', running(7, decisions=decisions))

    def test_one_that_starts_while_the_learner_learns_is_recorded_afterwards(self, play):
        self.start_while_learning(play, 4)
        assert play('on_learnt', 2) == [Record(EpisodeKind.TRIAL)]
        assert (play.phase, play.session.state.trial) == (Phase.TRIAL, 7)
        play('on_status', ended(7, decisions=4))
        assert play.log[-1] == Close()
        assert warnings_of(play.log) == []

    def test_one_that_starts_while_a_trial_is_learnt_is_recorded_afterwards(self, trying):
        trying('series.stop')
        trying('trials.on_decisions', 1, 3)
        trying('on_status', ended())
        trying('trials.on_decisions', 2, 1)
        trying('on_status', running(2, decisions=1))
        assert trying('on_learnt', 2) == [Record(EpisodeKind.TRIAL)]

    def test_one_that_starts_while_a_demonstration_is_kept_is_recorded_afterwards(self, play):
        play('demonstration.record')
        play('demonstration.keep')
        assert play('on_status', running(7, stamp=1.0)) == []
        assert play('on_odometry', 0.95) == []
        assert play('on_odometry', 1.0) == [Close()]  # the rest is the robot's own drive
        play('trials.on_decisions', 7, 2)
        play('on_status', running(7, decisions=2))
        play('on_learnt', 2)
        play('on_status', running(7, decisions=2))
        assert play.log[-1] == Record(EpisodeKind.TRIAL)

    def test_decisions_that_come_after_their_status_are_waited_for(self, play):
        play('on_status', running(7, decisions=1))
        assert play.wait(0.5) == []
        assert play('trials.on_decisions', 7, 1) == [Record(EpisodeKind.TRIAL)]

    def test_one_that_lost_its_beginning_is_told_of_once(self, play):
        self.start_while_learning(play, 1)
        assert play('on_learnt', 2) == []
        [told] = warnings_of(play.wait(10.0))
        assert told.startswith('trial 7 is not recorded: 1 of its 4 decisions arrived')
        play('on_status', running(7, decisions=5))
        play('on_status', ended(7, decisions=5))
        assert len(warnings_of(play.log)) == 1
        assert Record(EpisodeKind.TRIAL) not in play.log

    def test_one_that_is_over_before_it_can_be_recorded_is_told_of(self, play):
        self.start_while_learning(play, 4)
        play('on_status', ended(7, decisions=4))
        assert warnings_of(play.log) == [
            'trial 7 is not recorded: the learner was still learning']
        assert play('on_learnt', 2) == []

    def test_one_that_ended_before_the_learner_came_is_not_told_of(self, play):
        play('on_status', ended(7))
        assert play.wait(5.0) == []

    def test_one_that_was_broken_off_is_not_told_of_again(self, play):
        play('on_status', running(7))
        [*_, stop] = play.wait(6.0)  # no odometry
        assert stop == StopTrial()
        n_told = len(warnings_of(play.log))
        play('on_status', running(7, decisions=2))
        play.wait(5.0)
        play('on_status', ended(7, Outcome.STOPPED))
        assert len(warnings_of(play.log)) == n_told

    def test_a_controller_that_started_anew_may_use_the_number_again(self, play):
        play('on_status', running(1))
        play.wait(6.0)
        play('on_status', idle())
        assert play('on_status', running(1)) == [Record(EpisodeKind.TRIAL)]


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


class TestLostPeers:

    @pytest.mark.parametrize('left', [Peers(controller=True), Peers(robot=True)])
    def test_a_trial_is_broken_off_and_run_again(self, trying, left):
        outputs = trying('on_peers', left)
        assert any(isinstance(output, Abandon) and 'went away' in output.reason
                   and output.trial == 1 for output in outputs)
        assert (StopTrial() in outputs) == left.controller
        assert trying.phase is Phase.WAITING
        trying('on_peers', Peers(controller=True, robot=True))
        trying('on_status', idle(1))
        assert trying.phase is Phase.PLACING
        assert trying.session.series.n_left == 2

    @pytest.mark.parametrize(('moves', 'what'), [(True, 'command'), (False, 'odometry')])
    def test_what_is_silent_is_called_by_its_name(self, trying, moves, what):
        while not warnings_of(trying.log):
            trying.wait(0.5)
            if moves:
                trying('on_odometry', trying.now)
        assert f'broken off: no {what}' in warnings_of(trying.log)[0]

    def test_silence_breaks_a_trial_off(self, trying):
        assert trying.wait(4.9) == []
        outputs = trying.wait(0.2)
        assert any(isinstance(output, Abandon) for output in outputs)

    def test_commands_show_that_a_trial_lives(self, trying):
        for _ in range(10):
            trying('on_command')
            assert trying.wait(1.0) == []

    def test_a_paused_trial_may_be_silent(self, trying):
        trying('on_status', TrialStatus(State.PAUSED, 1, reason='a person drives', revision=1))
        assert trying.wait(20.0) == []

    def test_a_controller_that_started_anew_has_no_trial(self, trying):
        outputs = trying('on_status', idle(-1))
        assert any(isinstance(output, Abandon) for output in outputs)
        assert StopTrial() not in outputs  # it would come late, and stop the trial after this one

    def test_missing_decisions_break_a_trial_off(self, trying):
        trying('on_status', ended(decisions=3))
        outputs = trying.wait(6.0)
        assert any(isinstance(output, Abandon) and '0 of 3' in output.reason
                   for output in outputs)

    def test_a_trial_that_the_controller_aborted_is_run_again(self, trying):
        trying('trials.on_decisions', 1, 3)
        outputs = trying('on_status', ended(outcome=Outcome.ABORTED, reason='jumped'))
        assert Abandon('', trial=1) in outputs
        assert trying('on_status', idle(1, 1)) == [Place(START)]

    def test_a_trial_of_before_is_stopped_first(self, play):
        play('on_status', running(9, decisions=5))
        play('series.run', 1)
        assert play.wait(0.5) == [StopTrial()]
        told, *rest = play('on_status', ended(9, Outcome.STOPPED))
        assert told == Say('trial 9 is not recorded: the learner runs trials itself', warns=True)
        assert rest == [Place(START)]


def test_nothing_goes_on_when_nothing_can_be_recorded(trying):
    assert trying('on_recording_failed', 'no space') == [Abandon(''), StopTrial()]
    assert trying.phase is Phase.IDLE
    assert trying.session.series.n_left == 0


def test_the_end_of_the_learner_stops_the_trial_and_marks_the_bag(trying):
    outputs = trying('shut_down')
    assert outputs[0] == StopTrial()
    assert outputs[1].reason
    assert outputs[2] == Say('trial 1 is under way: broken off, the learner was stopped', True)


def test_the_end_of_the_learner_keeps_an_unfinished_demonstration_apart(play):
    play('demonstration.record')
    assert [type(output) for output in play('shut_down')] == [Abandon, Say]


def test_it_says_what_is_missing(play):
    play('on_peers', Peers(controller=True))
    play('series.run', 1)
    assert any('no robot' in output.text for output in play.wait(6.0))
    assert 'no robot' in play.session.state.describe()
