"""Leaps of a few decimetres at any rate, told by headings and speeds; honest drives are not."""

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
rates = st.sampled_from([1.0, 2.0, 5.0, 10.0, 50.0])
seeds = st.integers(0, 10_000)
turns = st.floats(-np.pi, np.pi)


def in_world(motion):
    c, s = np.cos(motion.yaw), np.sin(motion.yaw)
    return Motion(motion.yaw, motion.velocity[:, :1] * np.stack([c, s], axis=1))


@given(seeds, rates, turns, st.floats(0.2, 0.8), st.booleans())
@few
def test_a_leap_of_some_cells_is_said_at_any_rate(seed, rate, turn, share, is_in_world):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    xy[at:] += (0.8 if rate < 2.0 else 0.5) * ahead(turn)
    motion = in_world(motion) if is_in_world else motion
    with pytest.raises(ImplausibleDriveError) as caught:
        whole_drive(stamps, xy, LIMITS, motion)
    assert caught.value.breaks[0].at == pytest.approx(stamps[at] - 100.0)


@given(seeds, st.sampled_from([5.0, 10.0, 50.0]), turns, st.floats(0.2, 0.8))
@few
def test_a_leap_of_one_cell_is_said_where_poses_are_not_sparse(seed, rate, turn, share):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    xy[at:] += 0.25 * ahead(turn)
    with pytest.raises(ImplausibleDriveError, match='show the way again'):
        whole_drive(stamps, xy, LIMITS, motion)


@given(seeds, rates, st.floats(0.2, 0.8))
@few
def test_to_the_side_headings_alone_tell(seed, rate, share):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    xy[at:] += 0.4 * ahead(motion.yaw[at] + np.pi / 2)
    with pytest.raises(ImplausibleDriveError):
        whole_drive(stamps, xy, LIMITS, Motion(motion.yaw))


@given(seeds, st.sampled_from([10.0, 20.0, 50.0]), turns, st.floats(0.2, 0.8),
       st.floats(0.9, 2.5))
@few
def test_a_leap_that_a_filter_smears_over_a_second(seed, rate, turn, share, size):
    stamps, xy, motion = driven(seed, rate)
    start = stamps[int(share * len(xy))]
    xy += size * np.clip(stamps - start, 0.0, 1.0)[:, np.newaxis] * ahead(turn)
    with pytest.raises(ImplausibleDriveError) as caught:
        whole_drive(stamps, xy, LIMITS, motion)
    found = caught.value.breaks[0]
    assert found.kind is BreakKind.UNSAID
    assert -2.0 <= found.at - (start - 100.0) <= 2.0
    assert 'the speeds that come with the poses say 0.' in str(found)


@given(seeds, st.sampled_from([10.0, 50.0]), st.floats(0.2, 0.8), st.floats(0.9, 2.5))
@few
def test_headings_alone_tell_of_a_glide_to_the_side(seed, rate, share, size):
    stamps, xy, motion = driven(seed, rate)
    at = int(share * len(xy))
    glide = size * np.clip(stamps - stamps[at], 0.0, 1.0)[:, np.newaxis]
    xy += glide * ahead(motion.yaw[at] + np.pi / 2)
    with pytest.raises(ImplausibleDriveError):
        whole_drive(stamps, xy, LIMITS, Motion(motion.yaw))


@given(seeds, st.sampled_from([5.0, 20.0]), st.floats(0.15, 0.4), turns)
@few
def test_a_small_spike_is_left_out(seed, rate, off, turn):
    stamps, xy, motion = driven(seed, rate)
    spiked = xy.copy()
    spiked[len(xy) // 2] += max(off, 0.15 + 0.3 / rate) * ahead(turn)
    drive = whole_drive(stamps, spiked, LIMITS, motion)
    assert drive.n_spikes == 1
    np.testing.assert_array_equal(spiked[drive.kept], xy[drive.kept])


class TestHonest:
    """Robots whose speeds and places do not agree to the letter."""

    @given(seeds, rates, st.floats(0.0, 0.02), st.floats(0.9, 1.15))
    @few
    def test_noise_and_wheels_that_are_not_measured_well(self, seed, rate, noise, scale):
        rng = np.random.default_rng(seed)
        stamps, xy, motion = driven(seed, rate)
        noisy = Motion(motion.yaw + rng.normal(0.0, noise, len(xy)),
                       scale * motion.velocity + rng.normal(0.0, noise, xy.shape))
        xy += rng.normal(0.0, noise, xy.shape)
        assert len(whole_drive(stamps, xy, LIMITS, noisy).kept) == len(xy)

    @given(seeds, rates, st.booleans())
    @few
    def test_wheels_that_spin_and_a_place_that_drifts(self, seed, rate, is_drift):
        stamps, xy, motion = driven(seed, rate)
        if is_drift:
            xy += np.outer(stamps - 100.0, [0.02, -0.01])
        else:
            at, end = len(xy) // 3, len(xy) // 3 + int(3 * rate)
            xy[end:] -= xy[end] - xy[at]
            xy[at:end] = xy[at]
        assert len(whole_drive(stamps, xy, LIMITS, motion).kept) == len(xy)

    @given(seeds, rates, st.sampled_from(['none', 'another robot', 'nowhere ahead']))
    @few
    def test_what_does_not_fit_is_not_asked(self, seed, rate, which):
        stamps, xy, motion = driven(seed, rate)
        other = driven(seed + 1, rate)[2]
        wrong = {'none': Motion(0.0 * motion.yaw, 0.0 * motion.velocity),
                 'another robot': Motion(other.yaw, other.velocity),
                 'nowhere ahead': Motion(motion.yaw + 1.0, motion.velocity[:, ::-1])}[which]
        assert len(whole_drive(stamps, xy, LIMITS, wrong).kept) == len(xy)

    @given(seeds, st.sampled_from([20.0, 50.0]), st.floats(0.05, 0.4))
    @few
    def test_messages_are_lost(self, seed, rate, share):
        stamps, xy, motion = driven(seed, rate)
        kept = np.random.default_rng(seed).uniform(size=len(xy)) > share
        assert len(whole_drive(stamps[kept], xy[kept], LIMITS, motion.at(kept)).kept) == kept.sum()

    @given(seeds, st.sampled_from([10.0, 50.0]), turns, st.floats(0.1, 0.4))
    @few
    def test_a_localisation_that_glides_by_some_decimetres(self, seed, rate, turn, size):
        stamps, xy, motion = driven(seed, rate)
        xy += size * np.clip(stamps - 110.0, 0.0, 1.0)[:, np.newaxis] * ahead(turn)
        assert len(whole_drive(stamps, xy, LIMITS, motion).kept) == len(xy)
