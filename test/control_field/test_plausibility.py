"""Drives that no robot can have driven, broken at random places, and honest ones that are not."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.drives.breaks import BreakKind, ImplausibleDriveError
from control_field.drives.demonstration import demonstration_from_poses
from control_field.drives.plausibility import DriveLimits, whole_drive
from control_field.drives.workspace import OutsideWorkspaceError
from control_field.grid import Grid
from strategies import steady

GRID = Grid(60, 60, 0.25, -7.5, -7.5)
LIMITS = DriveLimits(GRID.resolution)
NOTHING = np.zeros(0), np.zeros(0, np.uint8), np.zeros(0, np.uint8)


def smooth_drive(seed, n=600, rate=20.0, speed=0.2):
    """Return stamps (n,) and positions (n, 2) of a robot that drives on in wide turns."""
    rng = np.random.default_rng(seed)
    turning = np.repeat(rng.uniform(-0.3, 0.3, 1 + n // 100), 100)[:n]
    yaw = rng.uniform(-np.pi, np.pi) + np.cumsum(turning) / rate
    steps = speed / rate * np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    return 100.0 + np.arange(n) / rate, np.cumsum(steps, axis=0)


rates = st.sampled_from([2.0, 5.0, 10.0, 20.0, 50.0])
seeds = st.integers(0, 10_000)
shares = st.floats(0.15, 0.85)


def n_at(rate):
    return int(30 * rate)


def refused(stamps, xy, limits=LIMITS):
    """Return the breaks for which a drive is refused."""
    with pytest.raises(ImplausibleDriveError) as caught:
        whole_drive(stamps, xy, limits)
    return caught.value.breaks


def learn(stamps, xy, grid=GRID):
    return demonstration_from_poses(grid, stamps, xy, *NOTHING)


@given(seeds, rates, shares)
@steady
def test_an_odometry_that_was_reset_is_said_with_time_and_place(seed, rate, share):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    at = int(share * len(xy))
    xy[at:] -= xy[at]
    if np.hypot(*xy[at - 1]) < 1.0:
        return
    [found] = refused(stamps, xy)
    assert found.kind is BreakKind.LEAP
    assert found.at == pytest.approx(stamps[at] - 100.0)
    assert found.before == pytest.approx(tuple(xy[at - 1]))
    assert found.after == (0.0, 0.0)
    with pytest.raises(ValueError, match=rf'at {found.at:.2f} s the pose leaps by .* to \(0.00'):
        learn(stamps, xy)


@given(seeds, rates, shares, st.floats(2.6, 9.0))
@steady
def test_missing_seconds_are_not_filled(seed, rate, share, seconds):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    first = int(share * len(xy))
    left = (stamps <= stamps[first]) | (stamps > stamps[first] + seconds)
    if left[first + 1:].sum() < 5:
        return
    away = np.hypot(*(xy[left][np.flatnonzero(left) > first][0] - xy[first]))
    if away < 0.3:
        return
    kinds = {found.kind for found in refused(stamps[left], xy[left])}
    assert kinds <= {BreakKind.HOLE, BreakKind.LEAP}


@given(seeds, st.sampled_from([1.0, 10.0, 50.0]), st.floats(0.3, 3.0), st.floats(0.0, 1.0))
@steady
def test_two_sources_in_turns_are_called_so(seed, rate, apart, late):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    other = smooth_drive(seed + 1, n_at(rate), rate)[1]
    other += np.array([apart + np.abs(other - xy).max(), 0.0])
    both = np.stack([xy, other], axis=1).reshape(-1, 2)
    times = np.stack([stamps, stamps + (0.2 + 0.6 * late) / rate], axis=1).reshape(-1)
    [found] = refused(times, both)
    assert found.kind is BreakKind.SOURCES
    assert 'two sources' in str(found)


@given(seeds, rates, st.sets(st.integers(1, 9), min_size=1, max_size=3), st.floats(1.5, 50.0),
       st.integers(1, 3))
@steady
def test_a_spike_is_left_out_and_said(seed, rate, where, off, n):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    n = n if n / rate < 0.4 else 1
    spiked = xy.copy()
    for tenth in where:
        at = tenth * len(xy) // 10
        spiked[at:at + n] += off
    drive = whole_drive(stamps, spiked, LIMITS)
    assert drive.n_spikes == n * len(where)
    np.testing.assert_array_equal(spiked[drive.kept], xy[drive.kept])
    assert f'{stamps[min(where) * len(xy) // 10] - 100.0:.2f} s' in ' '.join(drive.sentences())
    whole, cut = learn(stamps, xy)[0], learn(stamps, spiked)[0]
    assert whole.cells[[0, -1]].tolist() == cut.cells[[0, -1]].tolist()
    assert {tuple(c) for c in cut.cells.tolist()} <= {
        tuple(c) for c in GRID.cells_from_world(xy).tolist()}


@given(seeds, rates, st.booleans())
@steady
def test_a_spike_at_the_very_start_or_end_moves_neither(seed, rate, at_end):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    spiked = xy.copy()
    spiked[-1 if at_end else 0] += 3.0
    drive = whole_drive(stamps, spiked, LIMITS)
    np.testing.assert_array_equal(np.sort(drive.kept),
                                  np.arange(len(xy))[:-1] if at_end else np.arange(1, len(xy)))
    assert drive.sentences()


@given(seeds, shares, st.floats(0.6, 20.0))
@steady
def test_stamps_that_go_back_are_refused(seed, share, seconds):
    stamps, xy = smooth_drive(seed)
    at = int(share * len(xy))
    stamps[at:] -= seconds + 0.05
    [found] = refused(stamps, xy)
    assert found.kind is BreakKind.BACK
    assert found.at == pytest.approx((at - 1) / 20)
    assert found.seconds == pytest.approx(-seconds)


@given(shares, st.floats(60.0, 4000.0), st.booleans())
@steady
def test_a_round_whose_clock_is_set_back_does_not_end_in_its_middle(share, seconds, is_late):
    turn = np.linspace(0.0, 1.98 * np.pi, 600)
    stamps, xy = 100.0 + np.arange(600) / 20, np.stack([np.cos(turn), np.sin(turn)], axis=1)
    assert np.hypot(*(xy[-1] - xy[0])) < LIMITS.cell
    at = int(share * len(xy))
    stamps[at:] -= seconds
    if is_late:
        stamps[[at + 5, at + 6]] = stamps[[at + 6, at + 5]]
    assert refused(stamps, xy)[0].kind is BreakKind.BACK


@pytest.mark.parametrize('unit', [1e-3, 1e-6])
def test_stamps_that_are_not_in_seconds_are_called_so(unit):
    stamps, xy = smooth_drive(1)
    [found] = refused(100.0 + unit * (stamps - 100.0), xy)
    assert found.kind is BreakKind.FAST
    with pytest.raises(ImplausibleDriveError, match=r'it drives 0\.1.* not in seconds'):
        whole_drive(100.0 + unit * (stamps - 100.0), xy, LIMITS)


@pytest.mark.parametrize('seconds', [
    np.zeros_like, lambda stamps: stamps % 1.0,
    lambda stamps: np.where((stamps > 105.0) & (stamps < 108.0), 105.0, stamps)],
    ids=['none', 'whole seconds missing', 'three seconds standing'])
def test_stamps_that_stand_or_lack_their_seconds_are_refused(seconds):
    stamps, xy = smooth_drive(1)
    assert refused(seconds(stamps), xy)[0].kind in (BreakKind.STANDING, BreakKind.BACK)


@given(seeds, shares, st.floats(1.5, 30.0))
@steady
def test_a_robot_that_only_stood_before_the_leap_begins_after_it(seed, share, off):
    xy = smooth_drive(seed)[1]
    n = int(share * 200)
    waits = np.concatenate([np.tile(xy[0] + off, (n, 1)), xy])
    times = 100.0 + np.arange(len(waits)) / 20
    drive = whole_drive(times, waits, LIMITS)
    assert drive.kept.tolist() == list(range(n, len(waits)))
    assert drive.n_early == n
    assert f'{n} pose' in drive.sentences()[0]


@given(seeds, st.sampled_from([10.0, 20.0, 50.0]), shares, st.floats(0.9, 5.0))
@steady
def test_one_stamp_that_lacks_a_second_is_no_clock_that_was_set_back(seed, rate, share, seconds):
    stamps, xy = smooth_drive(seed, n_at(rate), rate)
    at = int(share * len(xy))
    stamps[at] -= seconds
    drive = whole_drive(stamps, xy, LIMITS)
    assert drive.n_spikes <= 1
    assert np.array_equal(np.delete(np.arange(len(xy)), at), drive.kept[drive.kept != at])


@given(seeds, st.sampled_from([1.0, 2.0]), st.floats(0.3, 3.0))
@steady
def test_two_sources_that_speak_rarely(seed, rate, apart):
    stamps, xy = smooth_drive(seed, 60, rate)
    both = np.stack([xy, xy + [0.0, apart]], axis=1).reshape(-1, 2)
    times = np.stack([stamps, stamps + 0.3 / rate], axis=1).reshape(-1)
    assert refused(times, both)[0].kind is BreakKind.SOURCES


@given(seeds, st.integers(2, 3), st.floats(1.5, 4.0), shares)
@steady
def test_some_spikes_of_a_drive_of_few_poses_are_no_driving(seed, n, off, share):
    stamps, xy = smooth_drive(seed, 40, 1.0)
    at = [int(40 * (k + share) / n) for k in range(n)]
    xy[at] += [off, -off]
    kinds = {found.kind for found in refused(stamps, xy)}
    assert kinds <= {BreakKind.LEAP, BreakKind.SOURCES}


def test_a_reset_beside_the_place_before_is_no_spike():
    x = np.concatenate([np.arange(0.3, 0.6, 0.005), np.arange(0.0, 2.0, 0.005)])
    [found] = refused(np.arange(len(x)) / 20.0, np.stack([x, 0.0 * x], axis=1))
    assert found.kind is BreakKind.LEAP


def test_a_drive_that_begins_in_a_hole_has_no_beginning():
    stamps, xy = smooth_drive(2)
    left = np.r_[0:4, 100:600]
    assert refused(stamps[left], xy[left])[0].kind is BreakKind.HOLE


def test_faster_than_the_robot_is_refused():
    stamps, xy = smooth_drive(3, rate=50.0, speed=4.5)
    assert refused(stamps, xy)
    slow = smooth_drive(3, speed=0.9)
    whole_drive(*slow, LIMITS)
    assert refused(*slow, DriveLimits(0.25, speed_max=0.5))


class TestHonestDrives:
    """What happens to good robots, too."""

    @given(seeds, rates, st.floats(0.0, 0.02))
    @steady
    def test_noise(self, seed, rate, noise):
        stamps, xy = smooth_drive(seed, n_at(rate), rate)
        noisy = xy + np.random.default_rng(seed).normal(0.0, noise, xy.shape)
        assert len(whole_drive(stamps, noisy, LIMITS).kept) == len(xy)

    @given(seeds, st.floats(0.5, 1.5), st.integers(200, 600))
    @steady
    def test_a_robot_that_waits_for_minutes_may_drive_off_fast(self, seed, speed, seconds):
        xy = smooth_drive(seed, 10, 1.0, speed)[1]
        xy = np.concatenate([np.tile(xy[:1], (seconds, 1)), xy])
        xy += np.random.default_rng(seed).normal(0.0, 0.004, xy.shape)
        assert len(whole_drive(np.arange(len(xy)) + 100.0, xy, LIMITS).kept) == len(xy)

    @given(seeds, rates)
    @steady
    def test_stamps_that_jitter_and_messages_that_come_late_or_twice(self, seed, rate):
        rng = np.random.default_rng(seed)
        stamps, xy = smooth_drive(seed, n_at(rate), rate)
        stamps += rng.uniform(-0.4, 0.4, len(stamps)) / rate
        twice = np.sort(np.concatenate([np.arange(len(xy)), rng.integers(len(xy), size=len(xy))]))
        mixed = twice[np.argsort(twice + rng.uniform(0.0, 4.0, len(twice)))]
        drive = whole_drive(stamps[mixed], xy[mixed], LIMITS)
        assert not drive.sentences()
        assert len(drive.kept) == len(mixed)

    @given(seeds, st.sampled_from([10.0, 20.0, 50.0]))
    @steady
    def test_a_localisation_that_corrects_itself_by_some_centimetres(self, seed, rate):
        rng = np.random.default_rng(seed)
        stamps, xy = smooth_drive(seed, n_at(rate), rate)
        jumps = np.where(rng.uniform(size=len(xy)) < 1.0 / rate, 0.05, 0.0)
        turn = rng.uniform(-np.pi, np.pi, len(xy))
        xy += np.cumsum(jumps * [np.cos(turn), np.sin(turn)], axis=1).T
        assert len(whole_drive(stamps, xy, LIMITS).kept) == len(xy)

    @given(seeds, st.floats(0.1, 2.0), st.floats(0.05, 1.0))
    @steady
    def test_sparse_poses(self, seed, rate, speed):
        stamps, xy = smooth_drive(seed, 60, rate, speed * rate * 0.5)
        if speed * rate * 0.5 > 2.5:
            return
        assert len(whole_drive(stamps, xy, LIMITS).kept) == len(xy)

    @given(seeds, shares)
    @steady
    def test_stops_and_a_clock_that_leaps_ahead_while_it_stands(self, seed, share):
        stamps, xy = smooth_drive(seed)
        at = int(share * len(xy))
        xy = np.concatenate([xy[:at], np.tile(xy[at], (50, 1)), xy[at:]])
        stamps = 100.0 + np.arange(len(xy)) / 20
        stamps[at + 25:] += 30.0
        assert len(whole_drive(stamps, xy, LIMITS).kept) == len(xy)

    def test_a_hole_in_which_less_than_a_cell_was_driven(self):
        stamps, xy = smooth_drive(5)
        left = np.r_[0:200, 222:600]
        assert len(whole_drive(stamps[left], xy[left], LIMITS).kept) == len(left)

    def test_a_drive_there_and_back(self):
        to, back = np.linspace(0.0, 3.0, 16), np.linspace(2.8, 1.0, 10)
        x = np.concatenate([to, back])
        whole_drive(np.arange(len(x)) * 1.0, np.stack([x, 0 * x], axis=1), LIMITS)


class TestOutside:
    """Drives that leave the workspace."""

    @given(seeds, st.integers(5, 40), st.integers(5, 40))
    @steady
    def test_they_are_refused_with_a_workspace_that_holds_them(self, seed, n_rows, n_cols):
        stamps, xy = smooth_drive(seed)
        small = Grid(n_rows, n_cols, 0.25, *(xy[0] - 0.125 * np.array([n_cols, n_rows])).tolist())
        low = np.array([small.origin_x, small.origin_y])
        high = low + 0.25 * np.array([n_cols, n_rows])
        if ((xy > low - 0.05) & (xy < high + 0.05)).all():
            learn(stamps, xy, small)
            return
        with pytest.raises(OutsideWorkspaceError, match=r'of 600 poses lie outside.*reaches from'
                           ) as caught:
            learn(stamps, xy, small)
        fitting = caught.value.fitting
        cells = learn(stamps, xy, fitting)[0].cells
        places = fitting.world_from_cells(cells[[0, -1]])
        assert np.abs(places - xy[[0, -1]]).max() < 0.2

    def test_a_place_that_no_workspace_holds(self):
        stamps = np.arange(20) * 1.0
        xy = np.stack([np.linspace(0.0, 1e12, 20), np.zeros(20)], axis=1)
        with pytest.raises(ImplausibleDriveError):
            learn(stamps, xy)
        with pytest.raises(OutsideWorkspaceError) as caught:
            learn(stamps * 1e12, xy)
        assert caught.value.fitting is None
