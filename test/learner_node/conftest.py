"""Sessions that tests of the learner begin with."""

import pytest

from learner_node.session.inputs import Peers
from learner_node.session.phases import Phase
from session_helpers import HERE, idle, Play, running


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
