"""The simulated robot among movers: what it sees, who runs into whom, the same every time."""

import math

import numpy as np
import pytest

from control_field.grid import Grid
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.changes import Change
from world_maps.mover import Mover, Waypoint
from world_maps.movers import Disc, gap_between
from world_maps.movers_file import Script
from world_maps.world import World

TICK = 0.05
#: Where the robot starts: in the middle of cell (3, 2), and looks along +x.
START = Placement(0.625, 0.875, 0.0)


def make(*movers, **parameters):
    world = World(Grid(20, 20, 0.25), np.zeros((20, 20), dtype=np.int8), 'here')
    return Simulation(world, SimSettings(**parameters), movers)


def standing(x, y=0.875, radius=0.15):
    return Mover(radius, waypoints=(Waypoint(x, y),))


def comes(speed=0.2, begin=2.0, **values):
    """Return one that comes along the robot's row, from the right."""
    return Mover(0.15, speed, (Waypoint(begin, 0.875), Waypoint(0.1, 0.875)),
                 **{'patience': 0.0, **values})


def run(simulation, seconds, v=0.0, w=0.0):
    for _ in range(round(seconds / TICK)):
        simulation.command(v, w)
        simulation.tick(TICK)
    return simulation


def counts(simulation):
    return (simulation.n_robot_contacts, simulation.n_mover_contacts, simulation.n_collisions)


class TestWhatItSees:
    def test_what_stands_beside_and_in_its_own_cell(self):
        assert make(standing(1.0)).local_grid().cells[1].tolist() == [0, 0, 100]
        assert make(standing(0.875)).local_grid().cells[1].tolist() == [0, 100, 100]
        assert not make().local_grid().cells.any()


class TestWhoRunsIntoWhom:
    def test_the_robot_into_one_that_stands(self):
        simulation = run(make(standing(1.5)), 10.0, 0.2)
        assert counts(simulation) == (1, 0, 1)
        assert simulation.in_contact
        assert simulation.has_collided
        assert simulation.robot.truth.x == pytest.approx(1.5 - 0.15 - 0.105, abs=1e-5)

    def test_it_drives_away_and_comes_again(self):
        simulation = run(run(make(standing(1.5)), 10.0, 0.2), 1.0, -0.2)
        assert not simulation.in_contact
        assert counts(run(simulation, 10.0, 0.2)) == (2, 0, 2)

    def test_one_that_runs_into_a_standing_robot_is_counted_apart(self):
        simulation = run(make(comes()), 20.0)
        assert counts(simulation) == (0, 1, 0)
        assert simulation.in_contact
        assert not simulation.has_collided
        assert simulation.robot.truth == START  # it is not pushed

    def test_turning_on_the_spot_closes_no_gap(self):
        assert counts(run(make(comes()), 20.0, w=1.0)) == (0, 1, 0)

    def test_who_meet_head_on_it_was_the_robot(self):
        assert counts(run(make(comes()), 20.0, 0.1)) == (1, 0, 1)

    def test_caught_up_with_from_behind_it_was_the_mover(self):
        follower = Mover(0.15, 0.3, (Waypoint(0.2, 0.875), Waypoint(4.0, 0.875)), patience=0.0)
        assert counts(run(make(follower), 10.0, 0.1)) == (0, 1, 0)

    def test_who_was_run_into_and_then_drives_on_runs_into_it(self):
        simulation = run(run(make(comes()), 20.0), 1.0, 0.2)
        assert counts(simulation) == (1, 1, 1)

    def test_contact_ends_when_the_mover_goes(self):
        simulation = run(make(comes(patience=1.0)), 9.0)
        assert counts(simulation) == (0, 1, 0)
        assert not simulation.in_contact

    def test_walls_are_counted_as_ever(self):
        assert counts(run(make(), 60.0, 0.2)) == (0, 0, 1)

    def test_placed_where_one_stands_they_part_freely(self):
        simulation = make(comes(begin=2.0))
        simulation.place(Placement(2.0, 0.875, 0.0))
        assert not simulation.in_contact
        assert counts(run(simulation, 5.0)) == (0, 0, 0)
        assert simulation.movers.discs[0].x < 1.5

    def test_no_disc_is_ever_driven_through(self):
        movers = [Mover(0.15, 0.3, mode='wander') for _ in range(5)]
        simulation, rng = make(*movers, seed=4), np.random.default_rng(1)
        for _ in range(300):
            run(simulation, 0.5, *rng.uniform((-0.2, -2.0), (0.2, 2.0)))
            robot = Disc(*simulation.robot.truth[:2], 0.105)
            assert min(gap_between(robot, disc) for disc in simulation.movers.discs) > -1e-6
        assert min(counts(simulation)) > 0


class TestRepeatable:
    def drive(self, simulation):
        rng, seen = np.random.default_rng(5), []
        for _ in range(100):
            run(simulation, 0.5, *rng.uniform((-0.2, -2.0), (0.2, 2.0)))
            seen.append((simulation.robot.truth, simulation.local_grid().cells.tolist()))
        return seen, counts(simulation), simulation.movers.discs

    def test_a_run_is_the_same_every_time_and_after_a_reset(self):
        movers = [Mover(0.1, 0.2, mode='wander'), comes(mode='once', comes_every=10.0)]
        simulation = make(*movers, seed=2)
        first = self.drive(simulation)
        simulation.reset()
        assert math.isclose(simulation.seconds, 0.0)
        assert self.drive(simulation) == first == self.drive(make(*movers, seed=2))
        assert self.drive(make(*movers, seed=3)) != first


class TestChanges:
    CELLS = np.zeros((20, 20), dtype=bool)
    CELLS[:, 8] = True

    def make(self, **when):
        world = World(Grid(20, 20, 0.25), np.zeros((20, 20), dtype=np.int8), 'here')
        states = np.full((20, 20), 100, dtype=np.int8)
        change = Change(self.CELLS, states, **when)
        return Simulation(world, SimSettings(), changes=[change])

    def test_a_door_that_closes_at_a_time_stops_the_robot(self):
        simulation = run(self.make(at_time=2.0), 10.0, 0.2)
        assert counts(simulation) == (0, 0, 1)
        assert simulation.robot.truth.x == pytest.approx(2.0 - 0.105, abs=1e-5)

    def test_it_closes_behind_the_robot_only(self):
        simulation = run(self.make(at_time=7.0), 7.0, 0.2)  # at 2.025 m
        assert not simulation.world.occupancy[3, 8]
        assert simulation.world.occupancy.sum() == 19 * 100
        run(simulation, 3.0, 0.2)
        assert simulation.world.occupancy[3, 8] == 100
        assert counts(simulation) == (0, 0, 0)

    def test_at_a_trial_and_anew_after_a_reset(self):
        simulation = self.make(at_trial=2)
        simulation.on_trial_end(0)
        assert not simulation.world.occupancy.any()
        simulation.on_trial_end(1)
        assert simulation.world.occupancy.any()
        simulation.reset()
        assert not simulation.world.occupancy.any()

    def test_in_another_world_nothing_moves_or_changes_unless_it_is_said(self):
        simulation = run(self.make(at_time=1.0), 2.0)
        simulation.change(simulation.parameters, World(Grid(8, 9, 0.25), np.zeros((8, 9))))
        assert not run(simulation, 5.0).world.occupancy.any()

    def test_a_contact_ends_where_nothing_moves_any_more(self):
        simulation = run(make(comes()), 20.0)
        assert simulation.in_contact
        simulation.change(simulation.parameters, None, Script())
        assert not simulation.in_contact

    def test_another_seed_begins_anew(self):
        simulation = run(make(Mover(0.1, 0.2, mode='wander'), seed=1), 5.0)
        simulation.change(SimSettings(seed=2))
        assert simulation.movers.discs == make(
            Mover(0.1, 0.2, mode='wander'), seed=2).movers.discs

    def test_another_script_begins_anew(self):
        simulation = run(self.make(at_time=1.0), 2.0)
        assert simulation.world.occupancy.any()
        simulation.change(simulation.parameters, None, Script((standing(1.0),)))
        assert not simulation.world.occupancy.any()
        assert simulation.local_grid().cells[1].tolist() == [0, 0, 100]
