"""What does not fit in the suite keeps the session from teaching, trying and changing."""

import pytest

from control_field.poses import StartPose
from learner_node.session.inputs import Peers
from learner_node.session.outputs import Place, Say
from learner_node.session.phases import Phase, SessionError
from learner_node.session.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.node.node_info import Operation


@pytest.fixture
def session():
    session = Session(Settings(simulation=True), lambda: StartPose(0.6, 0.9))
    session.on_peers(Peers(True, True), 0.0)
    session.on_status(TrialStatus(State.IDLE, revision=1), 0.0)
    session.on_odometry(1.0, 0.0)
    session.state.revision = 1
    return session


@pytest.mark.parametrize(('operation', 'ask'), [
    (Operation.TEACH, lambda session: session.demonstration.record(1.0)),
    (Operation.DRIVE, lambda session: session.series.run(3, 1.0)),
    (Operation.CHANGE, lambda session: session.relearn(1.0))])
def test_what_is_asked_for_is_refused_with_the_reason(session, operation, ask):
    session.state.why_not = lambda what: 'the workspaces differ' if what is operation else ''
    with pytest.raises(SessionError, match='the workspaces differ'):
        ask(session)
    assert session.state.phase is Phase.IDLE
    session.state.why_not = lambda what: '' if what is operation else 'something else'
    ask(session)


def test_a_series_waits_for_what_does_not_fit_and_says_so(session):
    session.on_peers(Peers(True, False), 0.5)
    session.series.run(2, 1.0)
    session.state.why_not = lambda what: '2 controllers in one namespace'
    outputs = [output for k in range(200) for output in session.tick(2.0 + 0.05 * k)]
    said = [output.text for output in outputs if isinstance(output, Say)]
    assert 'the next trial waits: 2 controllers in one namespace' in said
    session.state.why_not = lambda what: ''
    assert any(isinstance(output, Place) for output in session.on_peers(Peers(True, True), 20.0))
