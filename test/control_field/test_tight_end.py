import numpy as np
import pytest

from control_field.drives.demonstration import demonstration_from_poses
from control_field.drives.tight_end import first_free_cell
from control_field.grid import Grid
from control_field.records import Demonstration

GRID = Grid(20, 20, 0.25)
EAST, WEST = 1 << 0, 1 << 4


def drive(blocked_at, n=8):
    """Drive ``n`` cells east; in the cells of ``blocked_at`` the next one is seen blocked."""
    x = np.linspace(2, 2 + n - 1, 20 * (n - 1) + 1)
    xy = np.stack([(x + 0.5) * 0.25, np.full(len(x), 5.5 * 0.25)], axis=1)
    stamps = np.arange(len(x)) * 0.05
    cells = GRID.cells_from_world(xy)
    blocked = np.array([EAST if col in blocked_at else 0 for _, col in cells], np.uint8)
    return demonstration_from_poses(
        GRID, stamps, xy, stamps, blocked, np.zeros(len(x), np.uint8), local_grid_cells=cells)


@pytest.mark.parametrize(('blocked_at', 'last'), [([8], 8), ([7, 8], 7), ([], 9), ([3], 9)])
def test_the_goal_lies_before_what_is_blocked_at_the_end(blocked_at, last):
    demonstration, report = drive(blocked_at)
    assert demonstration.cells[-1].tolist() == [5, last]
    assert len(demonstration.stamps) == len(demonstration.cells) == last - 1
    said = [sentence for sentence in report.sentences() if 'shows as blocked' in sentence]
    assert len(said) == (last < 9)
    if said:
        x, y = GRID.world_from_cell(5, last)
        where = f'the goal is before it, at ({x:.2f}, {y:.2f}) m'
        assert said[0].endswith(f'a cell that the local grid shows as blocked: {where}')


def test_a_goal_deep_among_walls_stays_there():
    demonstration, report = drive([6, 7, 8])
    assert demonstration.cells[-1].tolist() == [5, 9]
    assert not report.sentences()


def test_a_drive_of_two_cells_keeps_both():
    assert drive([2], n=2)[0].cells.tolist() == [[5, 2], [5, 3]]


def test_who_steps_aside_before_the_robot_comes_is_no_wall():
    x = np.linspace(2, 9, 141)
    xy = np.stack([(x + 0.5) * 0.25, np.full(len(x), 5.5 * 0.25)], axis=1)
    stamps, cells = np.arange(len(x)) * 0.05, GRID.cells_from_world(xy)
    blocked = np.where((cells[:, 1] == 8) & (x < 8.2), EAST, 0).astype(np.uint8)
    demonstration, _ = demonstration_from_poses(
        GRID, stamps, xy, stamps, blocked, np.zeros(len(x), np.uint8), local_grid_cells=cells)
    assert demonstration.cells[-1].tolist() == [5, 9]


def test_what_was_seen_from_nobody_knows_where_counts_by_its_time():
    x = np.linspace(2, 9, 141)
    xy = np.stack([(x + 0.5) * 0.25, np.full(len(x), 5.5 * 0.25)], axis=1)
    stamps = np.arange(len(x)) * 0.05
    blocked = np.where((x > 8.3) & (x < 8.6), EAST, WEST).astype(np.uint8)
    ends = [demonstration_from_poses(
        GRID, stamps, xy, times, blocked[:len(times)], np.zeros(len(times), np.uint8),
    )[0].cells[-1, 1] for times in (stamps, stamps[x < 8.55])]
    assert ends == [9, 8]


@pytest.mark.parametrize(('blocked_in', 'first'), [
    ([], 0), ([1], 1), ([1, 2], 2), ([1, 2, 3], 0), ([2], 0)])
def test_trials_start_behind_what_is_blocked_at_the_beginning(blocked_in, first):
    cells = np.array([(5, col) for col in range(2, 9)], np.int32)
    blocked = np.zeros(7, np.uint8)
    blocked[blocked_in] = WEST
    shown = Demonstration(cells, np.arange(7.0), blocked, np.zeros(7, np.uint8))
    assert first_free_cell(shown) == first


def test_a_drive_of_two_cells_starts_in_its_first():
    blocked = np.array([0, WEST], np.uint8)
    cells = np.array([(5, 2), (5, 3)], np.int32)
    shown = Demonstration(cells, np.arange(2.0), blocked, np.zeros(2, np.uint8))
    assert first_free_cell(shown) == 0
