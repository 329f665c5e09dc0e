"""A person at the keys while the robot tries by itself; the same four processes for all tests."""


import pytest

from msgs_bridge.messages.trial_status import State
from person_helpers import Person, REAL_TIME, START
import ros_helpers


@pytest.fixture(scope='module')
def people(ros_domain, tmp_path_factory):
    """Return a person who has shown the way, in real time: a trial lasts long enough to act."""
    with ros_helpers.own_node(ros_domain) as node:
        someone = Person(node, tmp_path_factory.mktemp('taught'), REAL_TIME)
        with someone.stack:
            someone.wait(lambda: 'ready' in someone.terminal.read(), 'the learner')
            someone.wait(lambda: someone.pose is not None and someone.statuses, 'the others')
            someone.types('s', 'start demonstration')
            someone.holds('i', lambda pose: pose.x > 3.6, 'the goal')
            someone.types('n', 'keep')
            yield someone


@pytest.fixture
def taught(people):
    """Return that person, with nothing under way; no more trials are run after the test."""
    people.forget()
    yield people
    people.types(' ', 'stop')
    people.wait(lambda: 'ready' in people.terminal.lines()[-1], 'the learner')
    people.slows_time(REAL_TIME['speed_factor'])


@pytest.mark.slow
def test_space_ends_a_trial_and_no_more_are_run(taught):
    taught.slows_time(1.0)
    trial = taught.lets_it_try(0.8)
    taught.wait(lambda: f'trial {trial} running' in taught.terminal.lines()[-1], 'the line')
    taught.types(' ', 'stop')
    taught.wait(lambda: trial in taught.ended(), 'the end of the trial')
    assert str(taught.ended()[trial].outcome) == 'stopped'
    taught.wait(lambda: 'ready' in taught.terminal.lines()[-1], 'the learner')
    assert len(taught.ended()) == 1
    assert not taught.is_at(3.6, START[1], 0.2)


def test_who_does_not_drive_does_not_disturb_a_trial(taught):
    trial = taught.lets_it_try(0.8)
    # More at once would be taken for pasted.
    for keys, refused in (('snradbyf', 'cannot change a bag now'), ('tghqzwxe', 'set the robot')):
        taught.terminal.type(keys)
        taught.wait(lambda said=refused: said in taught.terminal.read(), refused)
    taught.wait(lambda: trial in taught.ended(), 'the end of the trial')
    assert [status.state for status in taught.statuses if status.trial == trial
            and status.state is State.PAUSED] == []
    assert str(taught.ended()[trial].outcome) == 'goal'


@pytest.mark.slow
def test_a_person_takes_over_and_lets_go(taught):
    taught.slows_time(1.5)
    trial = taught.lets_it_try(0.9)
    taught.holds('j', lambda pose: pose.yaw > 0.5, 'the turn that the person wants',
                 stop=False)
    assert any(status.state is State.PAUSED and 'person' in status.reason
               for status in taught.statuses)
    taught.wait(lambda: trial in taught.ended(), 'the end of the trial')
    assert str(taught.ended()[trial].outcome) == 'goal'
