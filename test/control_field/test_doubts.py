"""A frame that turns is no drive; what poses cannot tell is said; honest haste is kept."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.drives.breaks import BreakKind, ImplausibleDriveError
from control_field.drives.dead_reckoning import Motion
from control_field.drives.plausibility import DriveLimits, whole_drive
from strategies import few
from wheeled_drives import ahead, driven

LIMITS = DriveLimits(0.25)
seeds = st.integers(0, 10_000)
shares = st.floats(0.2, 0.8)
dense = st.sampled_from([20.0, 50.0])


def turned(xy, motion, at, turn):
    """Turn the frame of all that follows a pose, around that pose."""
    c, s = np.cos(turn), np.sin(turn)
    places, yaw = xy.copy(), motion.yaw.copy()
    places[at:] = xy[at] + (xy[at:] - xy[at]) @ np.array([[c, s], [-s, c]])
    yaw[at:] += turn
    return places, yaw


@given(seeds, dense, shares, st.floats(0.8, 1.55), st.sampled_from([-1.0, 1.0]), st.booleans())
@few
def test_a_frame_that_turns_on_the_spot_is_another_drive(seed, rate, share, turn, side, speeds):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    places, yaw = turned(xy, motion, at, side * turn)
    with pytest.raises(ImplausibleDriveError, match=r'heading leaps by \d+ degrees in 0.0') as got:
        whole_drive(stamps, places, LIMITS, Motion(yaw, motion.velocity if speeds else None))
    assert got.value.breaks[0].kind is BreakKind.TURNED
    assert got.value.breaks[0].at == pytest.approx(stamps[at] - 100.0)


@given(seeds, dense, shares, st.floats(1.65, 3.1))
@few
def test_one_that_turns_about_may_be_a_robot_that_turns_back_where_that_is_slow(
        seed, rate, share, turn):
    stamps, xy, motion = driven(seed, rate)
    places, yaw = turned(xy, motion, int(share * len(xy)), turn)
    try:
        doubts = whole_drive(stamps, places, LIMITS, Motion(yaw, motion.velocity)).doubts
    except ImplausibleDriveError as error:
        doubts = (str(error),)
    assert any('the heading leaps' in doubt for doubt in doubts)


def test_a_heading_made_from_the_way_it_goes_leaps_where_it_turns_back():
    stamps = np.arange(300) / 20.0
    x = np.cumsum(0.015 * np.tanh(8.02 - stamps))
    xy = np.stack([x, 0.3 * x ** 2], axis=1)
    way = np.gradient(xy, axis=0)
    drive = whole_drive(stamps, xy, LIMITS, Motion(np.arctan2(*way.T[::-1])))
    assert len(drive.kept) == len(xy)
    [doubt] = drive.doubts
    assert 'if the robot did not turn back there' in doubt


@given(seeds, dense, shares, st.integers(1, 3), st.floats(0.5, 3.1))
@few
def test_a_heading_that_is_wrong_for_a_moment_does_no_harm(seed, rate, share, n, off):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    yaw = motion.yaw.copy()
    yaw[at:at + min(n, 2)] += off
    assert len(whole_drive(stamps, xy, LIMITS, Motion(yaw, motion.velocity)).kept) == len(xy)


def test_poses_that_are_rare_may_hide_a_leap_and_a_turn():
    for rate, said in ((1.0, 'turn from one to the next'), (2.0, 'turn by up to 149 degrees')):
        drive = whole_drive(*driven(3, rate)[:2], LIMITS, driven(3, rate)[2])
        assert any(said in doubt and 'nobody can tell' in doubt for doubt in drive.sentences())
        assert not drive.missing_evidence
    assert not whole_drive(*driven(3, 20.0)[:2], LIMITS, driven(3, 20.0)[2]).sentences()


def test_what_did_not_help_to_tell_is_said_in_the_numbers():
    stamps, xy, motion = driven(5, 20.0)
    still = np.zeros_like(motion.velocity)
    by_heading = whole_drive(stamps, xy, LIMITS, Motion(motion.yaw, still))
    assert 'no speeds' in by_heading.missing_evidence
    assert 'no headings' in whole_drive(
        stamps, xy, LIMITS, Motion(0.0 * motion.yaw, still)).missing_evidence


@given(seeds, dense, st.floats(0.35, 0.45))
@few
def test_a_small_glide_is_said(seed, rate, size):
    stamps, xy, motion = driven(seed, rate)
    at = len(xy) // 2
    glide = size * np.clip(stamps - stamps[at], 0.0, 1.0)[:, np.newaxis]
    side = ahead(motion.yaw[at] + np.pi / 2)
    [doubt] = whole_drive(stamps, xy + glide * side, LIMITS, motion).doubts
    assert 'its localisation corrected itself' in doubt
    assert 'the speeds that came with the poses say' in doubt


@given(seeds, dense, st.floats(1.0, 2.5))
@few
def test_far_faster_than_elsewhere_is_said_where_nothing_tells_whether_it_was_so(seed, rate, size):
    stamps, xy, motion = driven(seed, rate)
    glide = size * np.clip(stamps - stamps[len(xy) // 2], 0.0, 1.0)[:, np.newaxis]
    doubts = whole_drive(stamps, xy + glide * ahead(0.3), LIMITS, Motion(0.0 * motion.yaw)).doubts
    assert any('at most elsewhere' in doubt for doubt in doubts)


class TestHonest:
    """Good robots that used to be refused."""

    @given(seeds, st.floats(0.3, 0.6), st.booleans())
    @few
    def test_one_that_creeps_and_hastes_for_some_seconds(self, seed, fast, speeds):
        stamps, xy, motion = driven(seed, 50.0, 60.0, 0.06)
        v = motion.velocity[:, 0].copy()
        v[1400:1650] = fast  # 28 to 33 s
        v = np.convolve(v, np.ones(25) / 25.0)[:len(v)]
        xy = np.cumsum(0.02 * v[:, np.newaxis] * np.stack(
            [np.cos(motion.yaw), np.sin(motion.yaw)], axis=1), axis=0)
        motion = Motion(motion.yaw, np.stack([v, 0.0 * v], axis=1) if speeds else None)
        once = np.arange(0, len(xy), 50)
        drive = whole_drive(stamps[once], xy[once], LIMITS, motion.at(once))
        assert len(drive.kept) == len(once)

    @given(seeds, dense, st.floats(-0.3, 0.3), st.booleans())
    @few
    def test_one_whose_base_is_not_between_its_wheels(self, seed, rate, lever, speeds):
        stamps, xy, motion = driven(seed, rate)
        xy = xy + lever * np.stack([np.cos(motion.yaw), np.sin(motion.yaw)], axis=1)
        motion = motion if speeds else Motion(motion.yaw)
        drive = whole_drive(stamps, xy, LIMITS, motion)
        assert len(drive.kept) == len(xy)

    @given(seeds, st.sampled_from([2.0, 5.0]), st.floats(1.0, 2.5))
    @few
    def test_one_that_says_no_heading_and_turns_off_the_axis(self, seed, rate, speed):
        stamps, xy, motion = driven(seed, rate, 60.0, speed)
        drive = whole_drive(stamps, xy, LIMITS, Motion(0.0 * motion.yaw))
        assert len(drive.kept) == len(xy)

    @given(seeds, st.sampled_from([2.0, 5.0, 10.0]), st.booleans())
    @few
    def test_one_whose_heading_is_measured_more_rarely_than_it_is_sent(self, seed, rate, speeds):
        stamps, xy, motion = driven(seed, 50.0, turning=0.8 if rate < 5.0 else 2.84)
        held = np.arange(len(xy)) // int(50.0 / rate) * int(50.0 / rate)
        motion = Motion(motion.yaw[held], motion.velocity if speeds else None)
        assert len(whole_drive(stamps, xy, LIMITS, motion).kept) == len(xy)
