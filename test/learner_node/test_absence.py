"""Why a demonstration cannot be recorded: the truth about odometry."""

import pytest

from learner_node.phases import SessionError
from learner_node.session import Session
from learner_node.settings import Settings, StartPose


def refusal(session, now):
    with pytest.raises(SessionError) as error:
        session.record(now)
    return str(error.value).removeprefix('cannot record a demonstration: ')


def make(**settings):
    return Session(Settings(**settings), lambda: StartPose(0.0, 0.0))


def test_none_and_a_mere_command_are_no_odometry():
    session = make()
    session.heard_command(1.0)
    assert refusal(session, 1.0) == 'no odometry has arrived yet'


@pytest.mark.parametrize('stamp', [0.0, 12.3])
def test_stamps_that_do_not_advance_are_named(stamp):
    session = make()
    for k in range(60):
        session.heard_odometry(stamp, 0.05 * k)
    assert refusal(session, 3.0) == (
        f'odometry arrives but does not count: its stamps do not advance (last {stamp:.2f} s)')
    session.heard_odometry(stamp + 0.1, 3.1)
    session.record(3.1)


def test_odometry_that_has_stopped_is_named_with_how_long_ago():
    session = make()
    session.heard_odometry(1.0, 1.0)
    assert refusal(session, 11.0) == 'no odometry has arrived for 10.0 s'


def test_in_lockstep_time_stands_until_somebody_drives():
    session = make(lockstep=True)
    session.heard_odometry(1.0, 1.0)
    session.record(100.0)
