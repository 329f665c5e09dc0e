"""A robot that stands outside of what the bags need: the field is grown to hold it."""

import numpy as np
import pytest

from control_field.grid import TooLargeError
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import Outcome
from control_field.windows import moved
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.task_folder import TaskFolder
from fitted_bags import demo
from sample_helpers import bytes_of

FAR = (-5.1, 6.3)


@pytest.fixture
def fold(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    fold = Relearner(None, Parameters(), fitted=True)
    fold.learn(Episode(demo(task, [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0)])))
    return fold


@pytest.mark.parametrize('places', [[], [(0.0, 0.0)], [(1.0, 1.0), (2.0, 1.0)]])
def test_where_there_is_room_nothing_is_made_anew(fold, places):
    assert fold.grown_to(places) is fold


def test_a_robot_far_away_is_led_to_the_goal_and_nothing_else_changes(fold):
    before = bytes_of(fold.refresh)
    grown = fold.grown_to([FAR, (0.0, 0.0)])
    field, old = grown.field(), fold.field()
    start = field.grid.cell_from_world(*FAR)
    assert field.grid.contains(start[0] - 8, start[1] - 8)
    assert fold.grid == old.grid
    assert bytes_of(fold.refresh) == before
    assert (field.grid.world_from_cell(*field.goal) == old.grid.world_from_cell(*old.goal))
    for name in ('vx', 'vy', 'known', 'flags'):
        assert (moved(getattr(field, name), field.grid, old.grid, 9) == getattr(old, name)).all()
    world = GridWorld(np.zeros(field.grid.shape, np.int8), Parameters())
    assert world.trial(field, start, seed=0)[0].outcome is Outcome.GOAL


def test_the_same_place_gives_the_same_bytes(fold):
    assert bytes_of(fold.grown_to([FAR]).refresh) == bytes_of(fold.grown_to([FAR]).refresh)


def test_beside_the_edge_there_is_room_for_what_the_robot_sees(fold):
    grid = fold.grid
    x, y = grid.world_from_cell(0, 5)
    assert fold.grown_to([(x, y + 0.25)]) is fold
    assert fold.grown_to([(x, y)]).grid.n_rows == grid.n_rows + 8


def test_a_place_that_is_likely_wrong_does_not_fill_the_memory(fold):
    with pytest.raises(TooLargeError, match='would hold it'):
        fold.grown_to([(400.0, 400.0)])
    assert fold.grown_to([(400.0, 0.0)]).grid.n_cols > 1600


def test_a_robot_on_the_other_side_of_the_earth_is_too_far(fold):
    with pytest.raises(TooLargeError, match='resolution'):
        fold.grown_to([(1e6, 1e6)])


def test_an_explicit_workspace_and_an_empty_memory_stay_as_they_are(fold):
    for other in (Relearner(None, Parameters(), fitted=True), Relearner(fold.grid, Parameters())):
        assert other.grown_to([FAR]) is other
