"""What has come into a cell a short while ago may go on moving."""

import numpy as np
import pytest

from control_field.robot.motion_watch import MotionWatch


def sight(*blocked, n=3, unknown=()):
    cells = np.zeros((n, n), np.int8)
    for cell in blocked:
        cells[cell] = 100
    for cell in unknown:
        cells[cell] = -1
    return cells


def moving(watch, stamp, cells, low=(4, 4)):
    return {(int(i), int(j)) for i, j in np.argwhere(watch.moving(stamp, low, cells))}


@pytest.fixture
def watch():
    """Return a watch that has seen nothing but free cells for a second."""
    watch = MotionWatch()
    for stamp in (0.0, 0.5, 1.0):
        assert not moving(watch, stamp, sight())
    return watch


def test_what_comes_moves_for_a_while(watch):
    assert moving(watch, 1.1, sight((0, 1))) == {(0, 1)}
    assert moving(watch, 3.0, sight((0, 1))) == {(0, 1)}
    assert not moving(watch, 3.2, sight((0, 1)))


def test_what_goes_on_goes_on_moving(watch):
    moving(watch, 1.1, sight((0, 1)))
    assert moving(watch, 3.0, sight((0, 1), (1, 1))) == {(0, 1), (1, 1)}
    assert moving(watch, 3.2, sight((0, 1), (1, 1))) == {(1, 1)}


def test_what_was_there_at_first_stands():
    watch = MotionWatch()
    for stamp in (0.0, 0.5, 1.0):
        assert not moving(watch, stamp, sight((0, 1)))


def test_what_comes_into_sight_as_the_robot_moves_stands(watch):
    assert not moving(watch, 1.1, sight((0, 2)), low=(4, 5))
    assert moving(watch, 1.2, sight((0, 1), (0, 2)), low=(4, 5)) == {(0, 1)}


def test_the_same_place_is_the_same_however_the_robot_moves(watch):
    moving(watch, 1.1, sight((0, 2)))
    assert moving(watch, 1.2, sight((0, 1)), low=(4, 5)) == {(0, 1)}
    assert not moving(watch, 1.3, sight(), low=(40, 5))


def test_a_cell_at_the_edge_of_a_wall_that_flickers_does_not_move(watch):
    for k in range(40):
        shown = moving(watch, 2.0 + 0.05 * k, sight((0, 1)) if k % 3 else sight())
        assert not shown or k < 3


def test_behind_something_it_is_remembered(watch):
    assert not moving(watch, 1.1, sight(unknown=[(0, 1)]))
    assert moving(watch, 1.2, sight((0, 1))) == {(0, 1)}


def test_what_is_where_nothing_was_remembered_has_come():
    watch, remembered = MotionWatch(), sight((0, 2), unknown=[(0, 0)])
    cells = sight((0, 0), (0, 1), (0, 2))
    found = watch.moving(0.0, (4, 4), cells, remembered=remembered)
    assert np.argwhere(found).tolist() == [[0, 1]]
    assert not watch.moving(2.5, (4, 4), cells, remembered=remembered).any()


def test_in_the_own_cell_it_may_go_on_as_long_as_it_is_there(watch):
    for stamp in np.arange(1.1, 10.0, 0.5):
        assert moving(watch, stamp, sight((1, 1))) == {(1, 1)}
    assert not moving(watch, 10.1, sight())


def test_a_clock_set_back_and_other_cells_begin_anew(watch):
    assert not moving(watch, 0.5, sight((0, 1)))
    assert not moving(watch, 1.5, sight((0, 1), n=15))


def test_what_has_come_goes_on_moving_when_the_workspace_grows(watch):
    assert moving(watch, 1.5, sight((0, 0))) == {(0, 0)}
    watch.shift(7, -2)
    assert moving(watch, 1.6, sight((0, 0)), low=(11, 2)) == {(0, 0)}
