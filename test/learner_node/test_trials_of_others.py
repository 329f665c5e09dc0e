"""Trials that a person starts while the session does something else."""


from control_field.records import Outcome
from episode_store.task_folder import EpisodeKind
from learner_node.session.outputs import Close, Record, StopTrial
from learner_node.session.phases import Phase
from session_helpers import ended, idle, running, warnings_of


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
