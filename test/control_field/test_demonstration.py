from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.drives.demonstration import demonstration_from_poses
from control_field.drives.loops import loop_erased
from control_field.grid import Grid
from strategies import drives, segment, steady

GRID = Grid(20, 20, 0.25, -1.0, 2.0)
L_SHAPE = segment((3, 2), (3, 15), (16, 15))
NOTHING = np.zeros(0), np.zeros(0, np.uint8), np.zeros(0, np.uint8)


def along(cells, n=20, offset=(0.0, 0.0)):
    """Return positions along straight lines between cell centres, ``offset`` cells beside."""
    corners = GRID.world_from_cells(np.array(cells)) + GRID.resolution * np.array(offset)
    share = np.arange(n)[:, None] / n
    segments = [a + share * (b - a) for a, b in pairwise(corners)]
    return np.concatenate([*segments, corners[-1:]])


def learn(xy, dt=0.05, local_grids=NOTHING, stamps=None):
    stamps = np.arange(len(xy)) * dt if stamps is None else stamps
    return demonstration_from_poses(GRID, stamps, np.asarray(xy), *local_grids, episode=3)


def cells_of(demonstration):
    return [tuple(cell) for cell in demonstration.cells.tolist()]


@given(drives(np.zeros((20, 20), np.int8)).filter(lambda cells: len(cells) > 1))
@steady
def test_a_drive_through_centres_gives_its_cells_back(cells):
    demonstration, report = learn(along(cells))
    assert cells_of(demonstration) == cells
    assert demonstration.episode == 3
    assert report.n_cells == len(cells)
    assert report.n_crossings == len(cells) - len(set(cells))
    assert report.n_filled == report.n_outside == report.n_idle_start == 0


@given(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45))
@steady
def test_a_drive_beside_the_centres_keeps_its_corner(dx, dy):
    demonstration, report = learn(along([(3, 2), (3, 15), (16, 15)], 200, (dx, dy)))
    cells = cells_of(demonstration)
    assert cells[0] == (3, 2)
    assert cells[-1] == (16, 15)
    assert report.n_filled == 0
    corner = {(3, 15), (3, 14), (4, 15)}
    assert set(cells) | corner == set(L_SHAPE) | corner
    assert len(cells) >= len(L_SHAPE) - 1


@given(drives(np.zeros((20, 20), np.int8)).filter(lambda cells: len(cells) > 1),
       st.sampled_from([2, 3, 7]))
@steady
def test_the_rate_of_the_poses_does_not_matter(cells, times):
    xy = along(cells, 21, (0.1, -0.05))
    stamps = np.arange(len(xy)) * 0.05
    finer = np.linspace(0.0, stamps[-1], times * (len(xy) - 1) + 1)
    fine = np.stack([np.interp(finer, stamps, xy[:, axis]) for axis in (0, 1)], axis=1)
    assert cells_of(learn(xy)[0]) == cells_of(learn(fine, stamps=finer)[0])


def test_a_slow_drive_is_a_drive():
    demonstration, report = learn(along([(3, 2), (3, 15)], 40_000), dt=0.005)
    assert cells_of(demonstration) == segment((3, 2), (3, 15))
    assert report.n_standing == 0


def test_creeping_is_standing():
    xy = np.concatenate([along([(3, 2), (3, 4)]), along([(3, 4), (3, 5)], 20)[1:]])
    stamps = np.concatenate([np.arange(21) * 0.05, 100.0 + 200.0 * np.arange(20)])
    assert 10 < learn(xy, stamps=stamps)[1].n_standing <= 20


@given(drives(np.zeros((20, 20), np.int8)).filter(lambda cells: len(cells) > 1))
@steady
def test_a_drive_through_its_own_cells_is_itself(cells):
    once = cells_of(learn(along(cells, 20, (0.05, 0.1)))[0])
    assert cells_of(learn(along(once))[0]) == once


def test_idling_is_trimmed_and_standing_is_counted():
    xy = along([(3, 2), (3, 6)], 50)
    times = np.ones(len(xy), int)
    times[[0, 25, -1]] = 31, 10, 41
    still = np.repeat(xy, times, axis=0)
    demonstration, report = learn(still)
    assert cells_of(demonstration) == segment((3, 2), (3, 6))
    assert (report.n_idle_start, report.n_idle_end, report.n_standing) == (30, 40, 9)
    assert demonstration.stamps[0] == pytest.approx(30 * 0.05)
    for part in ('5 cells from', '30 poses of standing still at the start',
                 '40 poses of standing still at the end', '9 poses of standing still in between'):
        assert part in str(report)


def test_noise_of_the_odometry_while_standing_is_no_drive():
    rng = np.random.default_rng(0)
    xy = np.array(GRID.world_from_cell(4, 4)) + rng.normal(0.0, 5e-4, (500, 2))
    with pytest.raises(ValueError, match='nothing to learn from this drive'):
        learn(xy)


def test_a_robot_that_stands_on_an_edge_and_jitters_is_not_driven():
    xy = np.tile(GRID.world_from_cell(4, 4), (42, 1))
    xy[:, 0] += GRID.resolution * (0.5 + np.array([0.015, *[0.015, -0.01] * 20, 0.0]))
    for drive in (xy, xy[::-1]):
        with pytest.raises(ValueError, match=r'1 cell .* poses of standing still') as caught:
            learn(drive)
        assert '-' not in str(caught.value)


@given(st.floats(-0.15, 0.15), st.integers(0, 3))
@steady
def test_a_diagonal_drive_that_grazes_corners_is_diagonal(off, quarter):
    ends = [((3, 3), (9, 9)), ((9, 3), (3, 9)), ((9, 9), (3, 3)), ((3, 9), (9, 3))][quarter]
    demonstration, _ = learn(along(ends, 400, (off, 0.0)))
    assert cells_of(demonstration) == segment(*ends)


def test_jitter_on_an_edge_is_no_step():
    xy = along([(3, 2), (3, 8)], 300)
    xy[:, 1] += GRID.resolution * (0.5 + 0.1 * np.sin(np.arange(len(xy))))
    rows = {row for row, _ in cells_of(learn(xy)[0])[1:-1]}
    assert rows <= {3, 4}
    assert len(cells_of(learn(xy)[0])) <= 8


@pytest.mark.parametrize(('to', 'beside'), [((6, 13), 1), ((3, 13), 0), ((12, 11), 1)], ids=str)
def test_what_is_filled_in_over_many_cells_lies_on_the_straight_line(to, beside):
    ends = np.array([(3, 2), to])
    cells = np.array(cells_of(learn(GRID.world_from_cells(ends), 3.0)[0]))
    line = np.array([ends[0] + share * (ends[1] - ends[0]) for share in np.linspace(0, 1, 101)])
    off = np.hypot(*(cells[:, np.newaxis] - line).transpose(2, 0, 1)).min(axis=1)
    assert off.max() <= 0.51 * beside + 0.1
    assert np.abs(np.diff(cells, axis=0)).max() == 1


def test_sparse_poses_are_filled_with_straight_steps_that_nothing_was_seen_from():
    corners = [(3, 2), (3, 4), (5, 7), (7, 10), (7, 12)]
    local_grids = np.array([0.0]), np.array([7], np.uint8), np.array([0], np.uint8)
    demonstration, report = learn(GRID.world_from_cells(np.array(corners)), 3.0, local_grids)
    cells = cells_of(demonstration)
    assert cells == segment(*corners)
    assert report.n_filled == len(cells) - len(corners)
    filled = np.array([cell not in corners for cell in cells])
    assert (demonstration.unknown == np.where(filled, 255, 0)).all()
    assert (demonstration.blocked == np.where(filled, 0, 7)).all()


def test_a_jump_is_not_filled():
    xy = np.concatenate([along([(3, 2), (3, 4)]), along([(7, 10), (7, 12)])])
    with pytest.raises(ValueError, match='not one drive of one robot'):
        learn(xy)


def test_poses_on_the_edge_and_poses_that_are_none_are_dropped_and_counted():
    xy = along([(0, 3), (0, 8)], 20)
    bad = np.array([[np.nan, 0.0], [np.inf, 1.0]])
    demonstration, report = learn(np.concatenate([xy[:40], bad, xy[40:]]))
    assert cells_of(demonstration) == segment((0, 3), (0, 8))
    assert report.n_outside == 2
    assert '2 poses on the edge outside the workspace' in str(report)
    xy[:, 1] -= 0.13  # along its lower edge, just outside
    edge = learn(np.concatenate([along([(0, 3), (0, 3)]), xy, along([(0, 8), (0, 8)])]))
    assert cells_of(edge[0]) == segment((0, 3), (0, 8))
    assert edge[1].n_outside == len(xy)
    stamps = np.arange(len(xy)) * 0.05
    stamps[5] = np.nan
    assert learn(along([(0, 3), (0, 8)], 20), stamps=stamps)[1].n_outside == 1


@pytest.mark.parametrize('xy', [
    np.zeros((0, 2)), np.full((9, 2), np.nan), along([(3, 3), (3, 3)])])
def test_what_leads_nowhere_is_refused_with_what_was_dropped(xy):
    with pytest.raises(ValueError, match=r'nothing to learn from this drive.*drive at least'):
        learn(xy)


def test_each_cell_has_the_local_grid_that_was_newest_when_it_was_entered():
    xy = along(segment((3, 2), (3, 5)), 20)
    at = np.arange(len(xy)) * 0.05
    local_grids = at[9:], np.arange(len(at) - 9).astype(np.uint8), np.zeros(len(at) - 9, np.uint8)
    demonstration, _ = learn(xy, local_grids=local_grids)
    assert demonstration.unknown.tolist()[0] == 255  # nothing had been seen yet
    for stamp, blocked, unknown in list(zip(demonstration.stamps, demonstration.blocked,
                                            demonstration.unknown, strict=True))[1:]:
        assert unknown == 0
        assert at[9 + blocked] == pytest.approx(stamp)


def test_a_drive_around_a_block_and_back_is_cut_down_to_the_way_out():
    drive = segment((3, 3), (3, 6), (6, 6), (6, 3), (3, 3), (2, 3))
    demonstration, report = learn(along(drive))
    assert cells_of(demonstration) == drive
    assert report.n_crossings == 1
    assert report.n_steps == 1
    assert ('12 of 14 cells driven are not learnt, they only lead back to where the robot had '
            'been: 12 (3.0 m) from (-0.12, 2.88) back to it, 0.0 to 11.8 s') in str(report)


@given(drives(np.zeros((20, 20), np.int8), longest=60).filter(lambda cells: len(cells) > 1))
@steady
def test_the_loops_that_are_cut_out_are_all_that_is_not_learnt(cells):
    demonstration, report = learn(along(cells))
    left = loop_erased(demonstration.cells)
    assert report.n_erased == len(cells) - len(left)
    assert report.n_steps == max(len(left) - 1, 0)
    for loop in report.loops:
        first, last = (demonstration.stamps.tolist().index(at) for at in (loop.first, loop.last))
        assert last - first == loop.n_cells
        assert cells[first] == cells[last]
        assert GRID.world_from_cell(*cells[last]) == pytest.approx(loop.place)
        assert loop.length >= GRID.resolution * loop.n_cells - 1e-9
