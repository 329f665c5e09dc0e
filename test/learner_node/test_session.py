"""The session: demonstrations, suspensions, lost peers, its end; events in, outputs out."""

import pytest

from control_field.records import Outcome
from episode_store.task_folder import EpisodeKind
from learner_node.session.inputs import Peers
from learner_node.session.outputs import Abandon, Close, Discard, Place, Record, Say, StopTrial
from learner_node.session.phases import Phase, SessionError, TRANSITIONS
from msgs_bridge.messages.trial_status import State, TrialStatus
from session_helpers import ended, idle, Play, running, START, warnings_of


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
    assert trying('on_recording_failed', 'no space') == [StopTrial(), Abandon('')]
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


def test_the_map_leads_from_idle_everywhere_and_back():
    def reached(start):
        known, left = set(), [start]
        while left:
            known.add(phase := left.pop())
            left += set(TRANSITIONS[phase]) - known
        return known
    assert all(reached(phase) == set(Phase) for phase in Phase)


def test_no_phase_is_entered_that_does_not_follow(play):
    with pytest.raises(AssertionError):
        play.session.state.go(Phase.FINISHING, 0.0)
