"""A trial during a demonstration: the robot's own drive is not learnt as a person's."""

import pytest

from control_field.poses import StartPose
from control_field.records import Outcome
from learner_node.session.inputs import Peers
from learner_node.session.outputs import Abandon, Say, StopTrial
from learner_node.session.phases import Phase, SessionError
from learner_node.session.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import State, TrialStatus

BEGAN = 10.0
WHY = 'trial 7 ran meanwhile and drove the robot; show the way again'


def status(state=State.RUNNING, stamp=BEGAN, trial=7):
    return TrialStatus(state, trial, Outcome.STOPPED if state is State.ENDED else None,
                       revision=1, stamp=stamp)


def taught(settings=None):
    """Return a session that has a field, all its peers and odometry of `BEGAN`."""
    session = Session(settings or Settings(), lambda: StartPose(0.0, 0.0))
    session.begin(0.0)
    session.on_odometry(BEGAN, 0.0)
    session.on_peers(Peers(controller=True, robot=True), 0.0)
    session.on_status(TrialStatus(State.IDLE, revision=1), 0.0)
    session.on_learnt(1, 0.0)
    return session


@pytest.fixture
def session():
    """Return a session that records a demonstration."""
    session = taught()
    session.demonstration.record(0.0)
    return session


def is_broken_off(session, outputs, stops=True):
    """Tell whether the demonstration was, with one warning."""
    assert outputs == [*([StopTrial()] if stops else []), Abandon(WHY), Say(
        f'the demonstration is broken off and not kept: {WHY}', warns=True)]
    return session.state.phase is Phase.IDLE


class TestATrialThatRuns:

    @pytest.mark.parametrize('state', [State.RUNNING, State.PAUSED])
    def test_is_stopped_and_the_demonstration_is_not_kept(self, session, state):
        assert is_broken_off(session, session.on_status(status(state, BEGAN + 0.1), 1.0))
        with pytest.raises(SessionError, match=f'no demonstration is being recorded: {WHY}'):
            session.demonstration.keep(2.0)

    def test_is_said_once_and_not_recorded(self, session):
        session.on_status(status(stamp=BEGAN + 0.1), 1.0)
        outputs = session.on_status(status(stamp=BEGAN + 0.3), 1.1)
        outputs += session.trials.on_decisions(7, 1, 1.1)
        for tick in range(100):
            outputs += session.tick(1.1 + 0.05 * tick)
        outputs += session.on_status(status(State.ENDED, BEGAN + 0.4), 7.0)
        assert outputs == []
        session.on_odometry(BEGAN + 8.0, 8.0)
        session.demonstration.record(8.0)
        assert session.state.phase is Phase.DEMONSTRATION

    def test_is_stopped_where_no_stamp_shows_that_it_is_new(self, session):
        outputs = session.on_status(status(), 1.0)
        for tick in range(5):
            outputs += session.tick(1.0 + 0.05 * tick)
        assert is_broken_off(session, outputs)

    def test_that_ended_before_it_was_known_to_be_new_breaks_off_too(self, session):
        assert session.on_status(status(), 1.0) == []
        outputs = session.on_status(status(State.ENDED, BEGAN + 3.0), 1.01)
        assert is_broken_off(session, outputs, stops=False)


class TestATrialThatHasEnded:

    def test_and_is_heard_of_late_breaks_nothing_off(self, session):
        session.on_status(status(stamp=BEGAN - 1.0), 1.0)
        session.tick(1.05)
        outputs = session.on_status(status(State.ENDED, BEGAN), 1.1)
        for tick in range(100):
            session.on_odometry(BEGAN + 0.05 * (tick + 1), 1.1 + 0.05 * tick)
            outputs += session.tick(1.1 + 0.05 * tick)
        assert [type(output) for output in outputs] == [Say]
        assert session.state.phase is Phase.DEMONSTRATION

    def test_and_is_latched_breaks_nothing_off(self, session):
        assert session.on_status(status(State.ENDED, BEGAN + 100.0), 1.0) == []
        assert session.state.phase is Phase.DEMONSTRATION


@pytest.mark.parametrize('state', [State.RUNNING, State.PAUSED])
def test_no_demonstration_begins_while_a_trial_of_others_runs(state):
    session = taught()
    # Its beginning was lost, so that it is not recorded.
    session.on_status(TrialStatus(state, 7, decisions=4, revision=1, stamp=9.0), 0.0)
    assert session.state.phase is Phase.IDLE
    with pytest.raises(SessionError, match=f'trial 7 is still {state}, stop it'):
        session.demonstration.record(1.0)
