"""Why a demonstration cannot be recorded: the truth about odometry."""

from types import SimpleNamespace

import pytest

from control_field.poses import StartPose
from learner_node.recording.message_dispatcher import MessageDispatcher
from learner_node.recording.odometry_check import OdometryCheck
from learner_node.session.outputs import Say
from learner_node.session.phases import SessionError
from learner_node.session.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.serialized import cdr_from_message


def refusal(session, now):
    with pytest.raises(SessionError) as error:
        session.demonstration.record(now)
    return str(error.value).removeprefix('cannot record a demonstration: ')


def make(**settings):
    return Session(Settings(**settings), lambda: StartPose(0.0, 0.0))


def test_none_and_a_mere_command_are_no_odometry():
    session = make()
    session.on_command(1.0)
    assert refusal(session, 1.0) == 'no odometry has arrived yet'


@pytest.mark.parametrize('stamp', [0.0, 12.3])
def test_stamps_that_do_not_advance_are_named(stamp):
    session = make()
    for k in range(60):
        session.on_odometry(stamp, 0.05 * k)
    assert refusal(session, 3.0) == (
        f'odometry arrives but does not count: its stamps do not advance (last {stamp:.2f} s)')
    session.on_odometry(stamp + 0.1, 3.1)
    session.demonstration.record(3.1)


def test_odometry_that_has_stopped_is_named_with_how_long_ago():
    session = make()
    session.on_odometry(1.0, 1.0)
    assert refusal(session, 11.0) == 'no odometry has arrived for 10.0 s'


def test_what_the_learner_slept_through_is_not_called_absent():
    session = make()
    session.tick(0.9)
    session.on_odometry(1.0, 1.0)
    session.tick(31.0)
    session.tick(31.1)
    assert refusal(session, 31.1) == (
        'no odometry has been read for 30.1 s, of which this program itself stood still for '
        '30.0 s')


def test_in_lockstep_time_stands_until_somebody_drives():
    session = make(lockstep=True)
    session.on_odometry(1.0, 1.0)
    session.demonstration.record(100.0)


class Drive:
    """A session, and odometry that it hears 20 times a second."""

    def __init__(self):
        self.session, self.now, self.said = make(), 0.0, []
        self.dispatcher = MessageDispatcher(
            self.session, None, lambda outputs: None,
            OdometryCheck('odom', Settings(rows=20, cols=20).grid),
            SimpleNamespace(refused=lambda *_: None))

    def go(self, seconds, *, monkeypatch, frame_id='odom', **pose):
        for _ in range(round(20 * seconds)):
            self.now += 0.05
            monkeypatch.setattr('time.monotonic', lambda: self.now)
            if pose.get('x', 0.0) is not None:
                msg = odometry_from_pose(Pose(self.now, 0.1 * self.now, 0.0, 0.0))
                msg.header.frame_id = frame_id
                msg.pose.pose.position.x = pose.get('x', msg.pose.pose.position.x)
                self.dispatcher.dispatch('odom', cdr_from_message(msg))
            self.said += [output.text for output in self.session.tick(self.now)
                          if isinstance(output, Say)]


@pytest.mark.parametrize(('odometry', 'words'), [
    ({'frame_id': 'map'}, "odom: frame is 'map', must be 'odom'; if that is the right one, start"),
    ({'x': float('nan')}, 'position is (nan, 0.0), must be finite'),
    ({'x': -0.1}, '(-0.10, 0.00) m, outside the workspace of 20 x 20 cells of 0.25 m from ')])
def test_what_cannot_be_learnt_is_not_begun_and_said_within_a_second(
        monkeypatch, odometry, words):
    drive = Drive()
    drive.go(0.5, monkeypatch=monkeypatch, **odometry)
    why = refusal(drive.session, drive.now)
    assert words in why
    drive.go(0.1, monkeypatch=monkeypatch)
    drive.session.demonstration.record(drive.now)
    drive.go(4.0, monkeypatch=monkeypatch)
    drive.go(0.05, monkeypatch=monkeypatch, **odometry)  # one is passed over
    drive.go(2.0, monkeypatch=monkeypatch)
    assert drive.said == []
    drive.go(0.9, monkeypatch=monkeypatch, **odometry)
    [line] = drive.said
    assert line.startswith('nothing can be learnt from what is driven now: ')
    assert words in line
    drive.go(3.0, monkeypatch=monkeypatch)
    drive.go(1.0, monkeypatch=monkeypatch, **odometry)
    assert len(drive.said) == 1


def test_a_robot_that_falls_silent_under_way_is_named_once(monkeypatch):
    drive = Drive()
    drive.go(1.0, monkeypatch=monkeypatch)
    drive.session.demonstration.record(drive.now)
    drive.go(1.0, monkeypatch=monkeypatch)
    drive.go(8.0, monkeypatch=monkeypatch, x=None)
    [line] = drive.said
    assert 'driven now: no odometry has arrived for ' in line
