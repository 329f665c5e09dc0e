"""Generated worlds, the places put on them, and the teachers."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation import worlds as generators
from experience_evaluation.changing_worlds import (
    doors_world, moved_obstacles, walled_world, with_block)
from experience_evaluation.starts import choose_places
from experience_evaluation.teachers import (
    demonstrate, detour_path, heading_table, longer_path, NoWayError, path_length, shortest_path)
from world_maps.world import find_world, load_world

FAMILIES = tuple(generators.FAMILIES)
worlds = st.tuples(st.sampled_from(FAMILIES), st.integers(8, 20), st.integers(0, 99))


def on_world(world, moves=8):
    occupancy = generators.generate(*world)
    goal, start = choose_places(occupancy, np.random.default_rng(world[2]))
    return GridWorld(occupancy, Parameters(moves=moves)), start, goal


@given(worlds)
@settings(max_examples=30, deadline=None)
def test_a_seed_gives_the_same_world(world):
    np.testing.assert_array_equal(generators.generate(*world), generators.generate(*world))


@pytest.mark.parametrize('family', FAMILIES)
def test_most_of_the_free_space_hangs_together(family):
    for seed in range(5):
        occupancy = generators.generate(family, 24, seed)
        goal, _ = choose_places(occupancy, np.random.default_rng(seed))
        cost = GridWorld(occupancy, Parameters()).cost_to(goal)
        assert np.isfinite(cost).sum() > 0.9 * (occupancy == 0).sum()


@pytest.mark.parametrize('family', [family for family in FAMILIES if family != 'open'])
def test_seeds_differ(family):
    assert (generators.generate(family, 16, 0) != generators.generate(family, 16, 1)).any()


@pytest.mark.parametrize(('family', 'size'), [('castle', 16), ('open', 3)])
def test_what_cannot_be_generated_is_refused(family, size):
    with pytest.raises(ValueError, match=r'castle|too small'):
        generators.generate(family, size, 0)


def test_dyna_maze_is_the_one_of_the_book():
    world = GridWorld(generators.dyna_maze(), Parameters(moves=4))
    assert world.cost_to(generators.DYNA_GOAL)[generators.DYNA_START] == 14.0
    assert (world.truth == 0).sum() == 47
    np.testing.assert_array_equal(load_world(find_world('dyna')).occupancy, world.truth)


@given(worlds, st.integers(0, 99))
@settings(max_examples=30, deadline=None)
def test_the_shortest_teacher_drives_a_shortest_path(world, seed):
    truth, start, goal = on_world(world)
    path = shortest_path(truth, start, goal, np.random.default_rng(seed))
    assert (path[0], path[-1]) == (start, goal)
    assert path_length(path) == pytest.approx(truth.cost_to(goal)[start])
    assert all(truth.truth[cell] == 0 for cell in path)


def test_seeds_draw_different_shortest_paths():
    world = GridWorld(generators.generate('open', 20, 0), Parameters())
    paths = {tuple(shortest_path(world, (0, 0), (19, 9), np.random.default_rng(seed)))
             for seed in range(20)}
    assert len(paths) > 5


@given(worlds, st.integers(0, 99))
@settings(max_examples=30, deadline=None)
def test_a_detour_is_longer_and_without_loops(world, seed):
    truth, start, goal = on_world(world)
    try:
        shown = demonstrate(truth, 'detour', start, goal, np.random.default_rng(seed), 1)
    except NoWayError:
        return  # there is no other way in a maze
    path = [(int(row), int(col)) for row, col in shown.cells]
    assert 1.3 <= path_length(path) / truth.cost_to(goal)[start] <= 2.0
    assert len(set(path)) == len(path)
    assert all(truth.truth[cell] == 0 for cell in path)


@pytest.mark.parametrize('moves', [4, 8])
def test_where_every_way_over_a_place_is_a_shortest_one_two_places_make_a_detour(moves):
    world = GridWorld(generators.generate('open', 20, 0), Parameters(moves=moves))
    for seed in range(5):
        path = detour_path(world, (0, 0), (19, 19), np.random.default_rng(seed))
        assert 1.3 <= path_length(path) / world.cost_to((19, 19))[0, 0] <= 2.0
        assert len(set(path)) == len(path)


def test_the_blind_teacher_drives_and_sees_through_walls():
    occupancy = np.zeros((5, 9), dtype=np.int8)
    occupancy[1:4, 4] = 100
    world = GridWorld(occupancy, Parameters())
    shown = demonstrate(world, 'blind', (2, 1), (2, 7), np.random.default_rng(0), 1)
    assert shown.cells.tolist() == [[2, col] for col in range(1, 8)]
    assert not shown.blocked.any()
    assert not shown.unknown.any()


def test_a_longer_path_has_the_length_asked_for():
    world = GridWorld(generators.dyna_maze(), Parameters(moves=4))
    for seed in range(10):
        path = longer_path(world, generators.DYNA_START, generators.DYNA_GOAL, 16,
                           np.random.default_rng(seed))
        assert len(path) == len(set(path)) == 17
    with pytest.raises(NoWayError, match='15 steps'):
        longer_path(world, generators.DYNA_START, generators.DYNA_GOAL, 15,
                    np.random.default_rng(0))


def test_a_cell_shown_twice_keeps_the_last_heading():
    world = GridWorld(np.zeros((3, 5), dtype=np.int8), Parameters())
    rng = np.random.default_rng(0)
    shown = [demonstrate(world, 'shortest', (1, 0), (1, 4), rng, 1),
             demonstrate(world, 'shortest', (1, 2), (1, 0), rng, 2)]
    assert heading_table(shown, (3, 5))[1].tolist() == [0, 4, 4, 0, -1]


def test_a_world_without_room_for_a_task_is_refused():
    with pytest.raises(NoWayError):
        choose_places(np.full((3, 3), 100, dtype=np.int8), np.random.default_rng(0))


@given(worlds, st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_moved_furniture_is_as_much_as_before_and_leaves_a_way(world, seed):
    occupancy = generators.generate(*world)
    goal, start = choose_places(occupancy, np.random.default_rng(world[2]))
    moved = moved_obstacles(occupancy, 0.1, np.random.default_rng(seed), goal, start)
    n = round(0.1 * (occupancy != 0).sum())
    assert ((occupancy != 0) & (moved == 0)).sum() == ((occupancy == 0) & (moved != 0)).sum() == n
    assert np.isfinite(GridWorld(moved, Parameters()).cost_to(goal)[start])


def test_what_cannot_be_moved_so_that_a_way_is_left_is_refused():
    corridor = np.array([[0, 0, 0], [100, 100, 100]], dtype=np.int8)
    with pytest.raises(ValueError, match='cannot be moved'):
        moved_obstacles(corridor, 0.34, np.random.default_rng(0), (0, 2), (0, 0))


def test_doors_shut_and_open_and_walls_stay():
    first, *later = doors_world(18, np.random.default_rng(0), 3)
    assert len(later) == 3
    for shut in later:
        assert ((shut != 0) >= (first != 0)).all()
        assert 0 < ((shut != 0) & (first == 0)).sum() < 12
    assert (later[0] != later[1]).any()


def test_gaps_of_a_wall_and_a_block_are_where_they_are_said_to_be():
    wall = walled_world(2, 5, n_rows=8, n_cols=8, row=3)
    assert (wall != 0).sum() == 6
    assert wall[3, 2] == wall[3, 5] == 0
    assert np.argwhere(with_block(np.zeros((5, 5), np.int8), (0, 2), 1) != 0).tolist() == [
        [0, 1], [0, 2], [0, 3], [1, 1], [1, 2], [1, 3]]
