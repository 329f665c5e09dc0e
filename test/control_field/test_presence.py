"""Trials whose decisions and odometry belong together, and those that were made up."""

from hypothesis import assume, given
from hypothesis import strategies as st
import numpy as np

from control_field.drives.presence import doubt_about_trial
from control_field.grid import Grid
from control_field.records import DECISION_DTYPE
from strategies import drives, steady

GRID = Grid(20, 20, 0.25, -1.0, 2.0)
ways = drives(np.zeros((20, 20), np.int8)).filter(lambda cells: len(cells) > 3)


def driven(cells, rate=10.0, seconds=1.2):
    """Return decisions and odometry of a robot that goes from centre to centre."""
    rows = np.zeros(len(cells) - 1, dtype=DECISION_DTYPE)
    rows['row'], rows['col'] = np.array(cells[:-1]).T
    rows['next_row'], rows['next_col'] = np.array(cells[1:]).T
    corners = 50.0 + seconds * np.arange(len(cells))
    stamps = np.arange(corners[0], corners[-1] + 1e-9, 1.0 / rate)
    xy = np.stack([np.interp(stamps, corners, axis)
                   for axis in GRID.world_from_cells(np.array(cells)).T], axis=1)
    # A step is decided on a little before the centre.
    rows['stamp'] = np.maximum(corners[:-1] - 0.25 * seconds, corners[0])
    return rows, stamps, xy


def doubt(rows, stamps, xy):
    return doubt_about_trial(rows, stamps, xy, GRID, 3.0)


@given(ways, st.sampled_from([2.0, 10.0, 50.0]), st.integers(0, 99))
@steady
def test_a_trial_that_was_driven_is_believed(cells, rate, seed):
    rows, stamps, xy = driven(cells, rate)
    rng = np.random.default_rng(seed)
    assert doubt(rows, stamps, xy + rng.normal(0.0, 0.005, xy.shape)) == ''
    late = np.argsort(np.arange(len(stamps)) + rng.uniform(0.0, 4.0, len(stamps)))
    assert doubt(rows, stamps[late], xy[late]) == ''


@given(ways, st.floats(-0.1, 0.1), st.floats(-0.3, 0.3), st.floats(0.95, 1.05))
@steady
def test_a_place_that_is_mended_may_be_off_the_wheels(cells, turn, off, slip):
    rows, stamps, xy = driven(cells)
    assume(np.hypot(*np.ptp(xy, axis=0)) > 0.6)
    turned = slip * (xy - xy[0]) @ np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    assert doubt(rows, stamps, xy[0] + turned + off) == ''


@given(ways)
@steady
def test_where_messages_were_lost_the_rest_counts(cells):
    rows, stamps, xy = driven(cells)
    left = (stamps < 51.0) | (stamps > stamps[-1] - 0.5)
    assert doubt(rows, stamps[left], xy[left]) == ''


@given(ways, st.integers(0, 19), st.integers(0, 19))
@steady
def test_decisions_of_a_robot_that_stands_are_made_up(cells, row, col):
    rows, stamps, _ = driven(cells)
    assume(max(np.ptp(rows['row']), np.ptp(rows['col'])) > 0)
    place = np.tile(GRID.world_from_cell(row, col), (len(stamps), 1))
    assert 'its decisions do not fit where the robot was' in doubt(rows, stamps, place)


@given(ways, st.integers(8, 12))
@steady
def test_a_start_where_the_robot_was_not_is_made_up(cells, off):
    rows, stamps, xy = driven(cells)
    assert 'at 0.00 s one is made at' in doubt(rows, stamps, xy + 0.25 * off)


def test_one_made_up_decision_among_true_ones_is_found():
    rows, stamps, xy = driven([(3, 3), (3, 4), (3, 5)])
    rows = np.concatenate([rows, rows[-1:]])
    rows['row'][-1], rows['stamp'][-1] = 12, stamps[-1]
    assert '(1 of 3 decisions are such)' in doubt(rows, stamps, xy)


def test_odometry_that_is_missing_or_another_robots():
    rows, stamps, xy = driven([(3, 3), (3, 4), (3, 5), (3, 6)])
    for shown in (doubt(rows, stamps[:0], xy[:0]), doubt(rows, stamps + 1e3, xy)):
        assert 'no odometry was recorded with it' in shown
    mixed = xy.copy()
    mixed[1::2] += 2.0
    assert 'its odometry is not that of one robot' in doubt(rows, stamps, mixed)
    assert doubt(rows[:0], stamps[:0], xy[:0]) == ''
