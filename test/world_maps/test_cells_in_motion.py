"""Trials on a grid world among movers, that are read from a file."""

from dataclasses import replace

import numpy as np
import pytest

from control_field.grid import Grid
from control_field.kernels import moving_world as kernels
from control_field.kernels.moving_world import new_scene, pass_tick, see_moving
from control_field.kernels.visibility import Scanner
from control_field.learning.learner import Learner
from control_field.learning.moving_world import MovingWorld
from control_field.parameters import Parameters
from control_field.rays import rays_within
from control_field.records import Outcome
from experience_evaluation.teachers import demonstration_from_path
from world_maps.cells_in_motion import moving_in_cells, pace_in_cells, TICK
from world_maps.changes import Change
from world_maps.mover import Mover, Waypoint
from world_maps.movers_file import find_movers, load_movers
from world_maps.world import find_world, load_world, World

#: Ten metres to the right, in a corridor one cell wide.
CORRIDOR = World(Grid(1, 20, 0.5), np.zeros((1, 20), dtype=np.int8), 'corridor')
OPEN = World(Grid(5, 20, 0.5), np.zeros((5, 20), dtype=np.int8), 'open')


def world_with(world, *movers, changes=(), patience=2.0, flips=0.0, sight=3):
    return MovingWorld(
        world.occupancy, Parameters(step_limit=200),
        moving_in_cells(world, movers, changes, 0, 6000),
        pace_in_cells(world, patience=patience, flips=flips), sight)


def taught(moving, world, row):
    learner = Learner(world.grid, moving.parameters)
    path = [(row, col) for col in range(20)]
    learner.add_demonstration(demonstration_from_path(moving, path, 1))
    return learner


def run(moving, world, row, n_trials=1):
    """Run trials; return how they ended, their rewards, and the learner."""
    learner, outcomes, rewards = taught(moving, world, row), [], 0
    for number in range(1, n_trials + 1):
        trial, _ = moving.trial(learner.refresh.field, (row, 0), number, number)
        outcomes.append(trial.outcome)
        rewards += int((trial.decisions['reward'] != 0).sum())
        learner.add_trial(trial)
    return outcomes, rewards, learner


def passes_by(speed=0.3, **values):
    """Return one who goes to and fro across the corridor, in the middle."""
    return Mover(0.15, speed, (Waypoint(5.25, -2.0), Waypoint(5.25, 2.5)), 'back_and_forth',
                 **values)


class TestPatience:
    def test_who_passes_by_is_waited_for_and_nothing_is_learnt(self):
        moving = world_with(CORRIDOR, passes_by(), patience=10.0)
        outcomes, rewards, learner = run(moving, CORRIDOR, 0, 5)
        assert outcomes == [Outcome.GOAL] * 5
        assert rewards == 0
        assert not learner.refresh.field.known.any()

    def test_without_patience_a_corridor_that_is_stood_in_ends_the_trial(self):
        stands = Mover(0.15, waypoints=(Waypoint(5.25, 0.25),))
        assert run(world_with(CORRIDOR, stands, patience=0.0), CORRIDOR, 0)[0] == [
            Outcome.GAVE_UP]

    def test_one_who_stays_is_gone_round(self):
        stands = Mover(0.15, waypoints=(Waypoint(5.25, 1.25),))
        outcomes, rewards, _ = run(world_with(OPEN, stands), OPEN, 2)
        assert outcomes == [Outcome.GOAL]
        assert rewards > 0


class TestMeeting:
    def test_one_who_comes_along_the_corridor_turns_back(self):
        comes = Mover(0.15, 0.2, (Waypoint(12.0, 0.25), Waypoint(-2.0, 0.25)), 'back_and_forth')
        moving = world_with(CORRIDOR, comes, patience=60.0)
        assert run(moving, CORRIDOR, 0, 3)[0] == [Outcome.GOAL] * 3

    def test_who_runs_into_the_standing_robot_is_counted(self):
        follows = Mover(0.1, 0.5, (Waypoint(-1.0, 0.25), Waypoint(11.0, 0.25)), 'back_and_forth')
        moving = world_with(CORRIDOR, follows)
        run(moving, CORRIDOR, 0, 3)
        assert moving.n_mover_contacts > 0

    def test_no_disc_is_in_another(self, monkeypatch):
        """The robot and five people who wander, at each tick of plain Python."""
        gaps = []

        def watched(scene, radius):
            pass_tick(scene, radius)
            gaps.extend(kernels.gap_to(scene, m, scene.at[m], radius) for m in range(5))

        monkeypatch.setattr(kernels, 'pass_tick', watched)
        monkeypatch.setattr('control_field.learning.moving_world.compiled', kernels)
        moving = world_with(OPEN, *[Mover(0.2, 0.3, mode='wander')] * 5)
        run(moving, OPEN, 2, 2)
        # Who stood on the start began in it: the two part.
        assert np.mean(np.array(gaps) > -1e-9) > 0.99

    @pytest.mark.parametrize('name', ['task1', 'task2'])
    def test_the_same_seeds_give_the_same_trials(self, name):
        world = load_world(find_world(name))
        movers = load_movers(find_movers('crossing'), world).movers
        first, again = (self.trials(world, movers) for _ in range(2))
        assert first == again
        assert len({rows for rows, _ in first}) > 1

    def trials(self, world, movers):
        moving = world_with(world, *movers)
        learner = taught(moving, world, 1)
        return [(trial.decisions.tobytes(), length) for trial, length in (
            moving.trial(learner.refresh.field, (1, 0), seed) for seed in range(5))]


class TestChangesInTime:
    def change(self, seconds, state):
        cells = np.zeros((1, 20), dtype=bool)
        cells[0, 10] = True
        return Change(cells, np.full((1, 20), state, dtype=np.int8), at_time=seconds)

    def test_a_door_is_waited_for_that_opens_in_time(self):
        changes = [self.change(5.0, 100), self.change(60.0, 0)]
        for patience, expected in ((60.0, Outcome.GOAL), (2.0, Outcome.GAVE_UP)):
            moving = world_with(CORRIDOR, changes=changes, patience=patience)
            assert run(moving, CORRIDOR, 0)[0] == [expected]

    def test_no_door_closes_on_the_robot(self):
        moving = moving_in_cells(CORRIDOR, (), [self.change(TICK, 100)], 0, 10)
        truth = CORRIDOR.occupancy
        for col, closed in ((10, 0), (9, 100)):
            scene = new_scene(moving, truth, truth, (0, col), 0)
            pass_tick(scene, 0.4)
            assert scene.truth[0, 10] == closed


class TestSeenFarAway:
    @pytest.mark.parametrize(('sight', 'seen', 'behind'), [(15, 100, -1), (3, None, None)])
    def test_who_comes_across_the_way_at_distance_four(self, sight, seen, behind):
        moving = moving_in_cells(OPEN, [passes_by()], n_ticks=200)
        scene = new_scene(moving, OPEN.occupancy, OPEN.occupancy, (2, 6), 108)
        reach = sight // 2
        scanner = Scanner(rays_within(reach if reach > 1 else 0),
                          np.zeros((sight, sight), np.int8))
        assert see_moving(scene, 2, 6, scanner, 0.0, np.random.default_rng(0)) == 0
        if seen is None:
            assert not scanner.shown.any()
        else:
            assert scanner.shown[reach].tolist()[reach:] == [0] * 4 + [seen] + [behind] * 3

    def test_who_stands_far_away_is_left_before_the_robot_stands_there_and_is_written_down(self):
        stands = Mover(0.15, waypoints=(Waypoint(5.25, 1.25),))
        leaves = {}
        for sight in (3, 15):
            moving = world_with(OPEN, stands, sight=sight)
            trial, _ = moving.trial(taught(moving, OPEN, 2).refresh.field, (2, 0), 1)
            assert trial.outcome is Outcome.GOAL
            rows = trial.decisions
            leaves[sight] = rows['col'][rows['next_row'] != 2].min()
        assert leaves[15] < leaves[3] == 9
        shown = trial.local_grids[trial.local_grids['col'] == 6]['cells'][0]
        assert shown[7 + 2 - trial.local_grids['row'][6], 11] == 100

    def test_no_wall_is_left_of_who_passed_by_far_away(self):
        moving = world_with(OPEN, passes_by(), patience=10.0, sight=15)
        outcomes, _, learner = run(moving, OPEN, 2, 5)
        assert outcomes == [Outcome.GOAL] * 5
        assert not (learner.refresh.field.known == 100).any()


@pytest.mark.parametrize('something_moves', [True, False])
def test_where_things_move_all_that_was_seen_closed_is_looked_at_once_more(something_moves):
    wall = OPEN.occupancy.copy()
    wall[:, 10] = 100
    moving_along = [Mover(0.15, 0.3, (Waypoint(2.25, 0.25), Waypoint(2.25, 2.25)),
                          'back_and_forth')]
    door = np.zeros(wall.shape, dtype=bool)
    door[0, 10] = True  # opens behind the robot's back, which looks for a way in the other rows
    moving = world_with(replace(OPEN, occupancy=wall), *moving_along[:something_moves], changes=[
        Change(door, np.zeros(wall.shape, np.int8), at_time=26.0)])
    field = replace(taught(world_with(OPEN), OPEN, 0).refresh.field, known=wall - (wall == 0))
    trial, _ = moving.trial(field, (0, 0), 1)
    assert (trial.outcome is Outcome.GOAL) == something_moves


class TestFlips:
    def test_a_share_of_what_is_seen_is_wrong_the_same_every_time(self):
        moving = moving_in_cells(OPEN, (), n_ticks=1)
        scene = new_scene(moving, OPEN.occupancy, OPEN.occupancy, (2, 5), 0)

        def seen(seed):
            rng = np.random.default_rng(seed)
            return [see_moving(scene, 2, 5, scene.around, 0.1, rng) for _ in range(500)]

        assert seen(1) == seen(1) != seen(2)
        assert 0.05 < np.mean([mask.bit_count() / 8 for mask in seen(1)]) < 0.15

    def test_a_wrong_glance_in_a_hundred_is_no_collision(self):
        moving = world_with(load_world(find_world('task1')), flips=0.01)
        learner = taught(moving, load_world(find_world('task1')), 1)
        starts = np.argwhere(moving.truth == 0)[::20]
        runs = moving.trials(learner.refresh.field, starts, 0)
        assert (runs.outcome != 1).all()


def test_a_run_leaves_nothing_to_the_next():
    moving = world_with(OPEN)
    field = taught(moving, OPEN, 2).refresh.field
    known = field.known.copy()
    known[:, 10] = 60  # in doubt, and gone
    nothing_said = np.zeros_like(field.q)  # prices are those of the map then
    ready = moving._ready(replace(field, known=known, q=nothing_said))
    before = ready.ground.factor.copy()
    outcome, *_ = moving._run(ready, (2, 0), 1, moving._new_log(0))
    assert outcome == 0
    assert (before[:, 10] > 1.0).all()
    np.testing.assert_array_equal(ready.ground.factor, before)
    np.testing.assert_array_equal(ready.ground.known, known)
