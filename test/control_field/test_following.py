"""Whether a robot does what is sent: seen in its poses alone, while it drives."""

from itertools import pairwise

import numpy as np
import pytest

from control_field.robot.following import Following
from control_field.robot.limits import STANDSTILL
from control_field.robot.sent_commands import moved, SentCommands

AHEAD, SLOWLY, AROUND = (0.2, 0.0), (0.05, 0.0), (0.1, 0.8)
MOST = 0.05


class Drive:
    """A robot that hears commands late, and whoever watches it."""

    def __init__(self, delay=lambda at: 0.0, timeout=0.5, noise=0.0):
        self.following, self.sent = Following(), SentCommands(10.0)
        self.now, self.place, self.doing, self.heard = 10.0, (0.0, 0.0, 0.0), STANDSTILL, -1.0
        self._delay, self._timeout, self._noise = delay, timeout, noise
        self._under_way, self._rng = [], np.random.default_rng(1)

    def go(self, velocity, seconds):
        """Send a velocity for a time, with a pose every 0.05 s."""
        for _ in range(round(seconds / 0.05)):
            self.sent.note(self.now, velocity)
            self._under_way.append((self.now + self._delay(self.now), velocity))
            self._drive()
            self.following.on_pose(self.now, self.place, self.sent, 0.0, MOST)
        return self.following

    def _drive(self):
        for _ in range(5):
            while self._under_way and self._under_way[0][0] <= self.now + 1e-9:
                self.doing, self.heard = self._under_way.pop(0)[1], self.now
            v, w = self.doing if self.now - self.heard < self._timeout else STANDSTILL
            odd = 1.0 + self._noise * self._rng.standard_normal()
            self.place = moved(self.place, (v * odd, w * odd, 0.01))
            self.now += 0.01


def test_a_robot_that_does_what_it_is_told_is_neither_late_nor_lost():
    drive = Drive(noise=0.1)
    for velocity in (AHEAD, AROUND, SLOWLY, STANDSTILL, (0.0, 1.5), AHEAD) * 3:
        following = drive.go(velocity, 0.7)
        assert (following.worst, following.is_lost, following.is_unanswered) == (0, False, False)


def test_one_that_goes_on_as_before_after_a_change_is_late_by_as_long_as_that():
    drive = Drive(delay=lambda at: 0.0 if at < 11.99 else 0.3)
    assert drive.go(AHEAD, 2.0).worst == 0.0
    assert drive.go(AHEAD, 1.0).worst == 0.0  # nothing tells
    drive.go(SLOWLY, 1.0)
    assert drive.following.worst == pytest.approx(0.3, abs=0.08)
    assert not drive.following.is_lost


@pytest.mark.parametrize('delay', [0.7, 1.0, 2.0])
def test_one_that_is_much_later_is_to_stand_until_nothing_comes_any_more(delay):
    drive = Drive(delay=lambda at: 0.0 if at < 11.99 else delay)
    drive.go(AHEAD, 2.0)
    began = drive.now
    while not drive.go(AROUND, 0.05).is_lost:
        assert drive.now - began < 0.6
    moved_last = began
    while drive.following.is_lost:
        before = drive.place
        drive.go(STANDSTILL, 0.05)
        moved_last = drive.now if drive.place != before else moved_last
        assert drive.now - began < 10.0
    assert drive.now - moved_last == pytest.approx(3.0, abs=0.3)


def test_a_robot_that_rests_on_what_was_sent_before_has_not_heard_what_came_since():
    """It stopped by itself; as it is told to stand as well, that could be taken for an answer."""
    drive = Drive(delay=lambda at: 0.0 if at < 11.99 else 1.5)
    drive.go(AHEAD, 2.0)
    drive.go(AROUND, 0.2)
    drive.go(STANDSTILL, 0.4)
    drive.go(SLOWLY, 0.3)
    assert drive.following.now > 0.5


def test_one_that_does_not_answer_is_known_while_it_stands():
    drive = Drive(delay=lambda at: 100.0)
    drive.go(STANDSTILL, 1.0)
    assert drive.go(SLOWLY, 0.35).is_unanswered
    assert drive.following.worst == 0.0  # it was not seen to do anything late


def test_what_no_pose_shows_yet_may_still_be_under_way():
    drive = Drive()
    drive.go(STANDSTILL, 1.0)
    began = drive.now
    assert drive.go(AHEAD, 1.0).confirmed - began < 0.5  # all looks the same
    turned = drive.now
    assert 0.0 <= drive.go((0.0, 0.8), 0.5).confirmed - turned < 0.5


def test_commands_that_are_late_are_under_way_until_they_are_seen():
    drive = Drive(delay=lambda at: 0.0 if at < 11.99 else 0.4, timeout=1.0)
    drive.go(AHEAD, 2.0)
    drive.go((0.0, 0.8), 0.35)
    assert drive.following.confirmed < 12.0
    drive.go((0.0, 0.8), 0.4)
    assert 11.9 < drive.following.confirmed < drive.now - 0.4


def test_nothing_is_under_way_for_ever():
    drive = Drive(delay=lambda at: 100.0)
    drive.go(SLOWLY, 6.0)
    assert drive.following.confirmed == pytest.approx(drive.now - 3.0, abs=0.1)


def test_what_somebody_else_made_it_do_is_forgotten():
    drive = Drive()
    drive.go(AHEAD, 0.5)
    drive.place = (5.0, 0.0, 1.0)
    assert drive.go(AHEAD, 0.5).is_lost
    drive.following.forget()
    assert not drive.go(AHEAD, 0.5).is_lost


def test_poses_far_apart_tell_nothing():
    drive = Drive()
    for before, after in pairwise(np.arange(0.0, 20.0, 2.0)):
        drive.following.on_pose(after, (before, 0.0, 0.0), drive.sent, 0.0, MOST)
    assert not drive.following.is_lost
