"""A window that was closed, a killed terminal: its demonstration ends, and is not lost."""

import pytest

from episode_store.task_folder import EpisodeKind
from learner_node.session.demonstration import LEFT
from learner_node.session.outputs import Abandon, Discard, Record, Say
from learner_node.session.phases import Phase, SessionError
from session_helpers import Play


@pytest.fixture
def play():
    """Return a session with odometry, and somebody at the keys."""
    play = Play()
    play('begin')
    play('on_learnt', -1)
    play.now = 100.0
    play('on_odometry', 0.0)
    play('demonstration.teacher.on_heartbeat')
    return play


def rest(play, seconds, *each, place=(0.0, 0.0, 0.0)):
    """Let time pass with the robot at a place; return the outputs."""
    outputs = []
    for _ in range(round(seconds * 10)):
        for name in each:
            play(name)
        play('on_odometry', play.now)
        if play.session.wants_pose(play.now):
            play('on_pose', *place)
        outputs += play.wait(0.1)
    return outputs


def test_the_recording_ends_and_nothing_is_thrown_away(play):
    play('demonstration.record')
    assert rest(play, 5.0, 'demonstration.teacher.on_heartbeat') == []
    abandoned, said = rest(play, 13.0)
    assert abandoned == Abandon(LEFT)
    assert isinstance(said, Say)
    assert said.warns
    assert said.text.startswith('The recording of the drive has ended, because nobody was at')
    assert play.phase is Phase.IDLE
    assert not any(isinstance(output, Discard) for output in play.log)
    with pytest.raises(
            SessionError, match='press y in teleop_node to keep it all the same') as error:
        play('demonstration.keep')
    assert error.value.code == play.session.demonstration.ended_code == 'left'
    assert play('demonstration.record') == [Record(EpisodeKind.DEMO)]


def test_who_comes_back_in_time_goes_on(play):
    play('demonstration.record')
    assert rest(play, 8.0) == []
    assert rest(play, 1.0, 'demonstration.teacher.on_heartbeat') == []
    assert rest(play, 8.0) == []
    assert play('demonstration.keep') == []
    assert play.phase is Phase.SETTLING


def test_a_robot_that_somebody_drives_is_not_left(play):
    play('demonstration.record')
    for metre in range(60):
        assert rest(play, 1.0, place=(0.1 * metre, 0.0, 0.0)) == []
    assert rest(play, 13.0, place=(5.9, 0.0, 0.0)) != []


def test_a_gamepad_that_commands_standstill_is_somebody(play):
    play('demonstration.record')
    assert rest(play, 60.0, 'on_command') == []
    assert rest(play, 9.0) == []
    assert rest(play, 3.0) != []


def test_odometry_that_trembles_does_not_drive(play):
    play('demonstration.record')
    outputs = []
    for step in range(130):
        outputs += rest(play, 0.1, place=(0.02 * (step % 2), 0.0, 0.05 * (step % 3)))
    assert Abandon(LEFT) in outputs


def test_who_teaches_without_a_heartbeat_is_not_missed(play):
    play.now += 60.0
    play('on_odometry', 60.0)
    play('demonstration.record')
    assert rest(play, 60.0) == []
    play('demonstration.teacher.on_heartbeat')
    assert rest(play, 13.0) != []


def test_what_the_learner_itself_slept_through_was_nobodys_absence(play):
    play('demonstration.record')
    rest(play, 2.0, 'demonstration.teacher.on_heartbeat')
    play.now += 60.0
    assert play('tick') == []
    play('demonstration.teacher.on_heartbeat')
    assert rest(play, 9.0) == []


def test_the_time_is_a_parameter():
    play = Play(teacher_timeout=60.0)
    play('begin')
    play('on_learnt', -1)
    play('on_odometry', 0.0)
    play('demonstration.teacher.on_heartbeat')
    play('demonstration.record')
    assert rest(play, 58.0) == []
    assert rest(play, 5.0) != []
