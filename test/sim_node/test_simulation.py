"""The simulation: commands and their age, contacts, placing, local grid, parameters."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from sim_node.robot import Placement
from sim_node.settings import FIXED, SimSettings
from sim_node.simulation import Simulation
from world_maps.world import World

TICK = 0.05


def make(blocked=(), world=None, **parameters):
    cells = np.zeros((20, 20), dtype=np.int8)
    for cell in blocked:
        cells[cell] = 100
    world = world or World(Grid(20, 20, 0.25), cells, 'here')
    return Simulation(world, SimSettings(**parameters))


def run(simulation, n_ticks, command=None):
    for _ in range(n_ticks):
        if command:
            simulation.command(*command)
        simulation.tick(TICK)
    return simulation.robot.truth


class TestCommands:
    def test_no_command_no_motion(self):
        simulation = make()
        assert run(simulation, 100) == simulation.parameters.start

    def test_a_command_holds_until_it_is_stale(self):
        simulation = make()
        simulation.command(0.2, 0.0)
        for n in range(30):
            assert simulation.is_stale == (n >= 10)
            simulation.tick(TICK)
        assert simulation.robot.truth.x == pytest.approx(0.625 + 0.2 * 0.5)
        assert simulation.robot.speed == 0.0
        simulation.command(0.2, 0.0)
        assert not simulation.is_stale

    @pytest.mark.parametrize('command', [
        (math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (0.0, -math.inf)])
    def test_what_is_not_finite_is_refused_and_changes_nothing(self, command):
        simulation = make()
        simulation.command(0.1, 0.0)
        with pytest.raises(ValueError, match='finite'):
            simulation.command(*command)
        simulation.tick(TICK)
        assert simulation.robot.speed == 0.1


class TestContact:
    def test_is_reported_once_and_ends_with_moving_away(self):
        simulation = make([(3, 5)])
        run(simulation, 100, (0.2, 0.0))
        assert simulation.in_contact
        assert simulation.n_collisions == 1
        run(simulation, 5, (0.2, 0.0))
        run(simulation, 5, (0.0, 0.0))
        assert simulation.in_contact
        assert simulation.n_collisions == 1
        run(simulation, 1, (-0.2, 0.0))
        assert not simulation.in_contact
        run(simulation, 10, (0.2, 0.0))
        assert simulation.n_collisions == 2

    def test_placing_ends_it(self):
        simulation = make([(3, 5)])
        run(simulation, 100, (0.2, 0.0))
        simulation.place(Placement(1.0, 3.0, 0.0))
        assert not simulation.in_contact
        assert simulation.n_collisions == 1
        simulation.reset()
        assert simulation.n_collisions == 0


class TestPlacing:
    @pytest.mark.parametrize(('where', 'word'), [
        ((math.nan, 1.0, 0.0), 'finite'), ((1.0, math.inf, 0.0), 'finite'),
        ((1.0, 1.0, math.nan), 'finite'), ((-0.1, 1.0, 0.0), 'outside'),
        ((1.0, 5.0, 0.0), 'outside'), ((1e300, 1.0, 0.0), 'outside'),
        ((1.375, 0.875, 0.0), 'obstacle'), ((1.2, 0.875, 0.0), 'obstacle'),
        ((0.05, 1.0, 0.0), 'wall')])
    def test_nonsense_is_refused_and_changes_nothing(self, where, word):
        simulation = make([(3, 5)])
        run(simulation, 5, (0.1, 0.1))
        before = simulation.robot.truth
        with pytest.raises(ValueError, match=word) as caught:
            simulation.place(Placement(*where), 'initialpose')
        assert str(caught.value).startswith('initialpose is (')
        assert simulation.robot.truth == before
        assert simulation.robot.speed == 0.1

    def test_the_old_command_is_forgotten(self):
        simulation = make()
        simulation.command(0.2, 0.0)
        simulation.place(Placement(2.0, 2.0, 1.0))
        assert run(simulation, 3) == (2.0, 2.0, 1.0)

    def test_a_start_that_is_none(self):
        with pytest.raises(ValueError, match='start_x'):
            make([(3, 2)])

    def test_reset_repeats_the_random_numbers(self):
        simulation = make(slip=0.05, noise_std=0.05, seed=3)
        ends = []
        for _ in range(2):
            ends.append((run(simulation, 40, (0.2, 0.1)), simulation.robot.odometry))
            simulation.reset()
        assert ends[0] == ends[1]
        assert ends[0][0] != ends[0][1]


class TestChange:
    def test_another_world_leaves_the_robot_where_it_is(self):
        simulation = make()
        other = make([(3, 5)]).world
        run(simulation, 5, (0.1, 0.0))
        before = simulation.robot.truth
        simulation.change(simulation.parameters, other)
        assert simulation.robot.truth == before
        assert not simulation.in_contact
        run(simulation, 200, (0.2, 0.0))
        assert simulation.in_contact

    def test_an_obstacle_on_top_of_the_robot_is_a_contact_that_one_can_leave(self):
        simulation = make()
        simulation.change(simulation.parameters, make([(3, 2)], start_x=2.0).world)
        assert simulation.in_contact
        with pytest.raises(ValueError, match='start'):
            simulation.reset()
        run(simulation, 60, (0.2, 0.0))
        assert not simulation.in_contact
        assert simulation.robot.truth.x > 0.85

    def test_parameters(self):
        simulation = make()
        simulation.change(SimSettings(v_max=0.05, robot_radius=0.3, seed=1))
        run(simulation, 1, (0.2, 0.0))
        assert simulation.robot.speed == 0.05
        with pytest.raises(ValueError, match='wall'):
            simulation.place(Placement(0.25, 1.0, 0.0))


class TestLocalGrid:
    @given(st.integers(0, 19), st.integers(0, 19))
    def test_is_the_truth_around_the_robot_with_walls_beyond_the_border(self, row, col):
        blocked = [(r, c) for r in range(20) for c in range(20)
                   if (r * 7 + c * 3) % 5 == 0 and (r, c) not in ((row, col), (3, 2))]
        simulation = make(blocked)
        world = simulation.world
        simulation.place(Placement(*world.grid.world_from_cell(row, col), 0.0))
        local_grid = simulation.local_grid()
        assert (local_grid.row, local_grid.col) == (row, col)
        for d_row in (-1, 0, 1):
            for d_col in (-1, 0, 1):
                assert (local_grid.cells[1 + d_row, 1 + d_col] == 100) == world.is_blocked(
                    row + d_row, col + d_col)

    def test_is_seen_from_the_true_cell_and_placed_by_the_odometry(self):
        simulation = make([(4, 4)], slip=0.5)
        while simulation.robot.odometry.x < 1.3:
            run(simulation, 1, (0.2, 0.0))
        local_grid = simulation.local_grid()
        row, col = simulation.world.grid.cell_from_world(*simulation.robot.truth[:2])
        assert (local_grid.row, local_grid.col) == (3, 5)
        assert (row, col) == (3, 3)
        assert local_grid.cells[2, 2] == 100


class TestParameters:
    def test_every_parameter_is_described(self):
        names = set(SimSettings.__dataclass_fields__)
        assert set(FIXED) < names
        for spec in SimSettings.__dataclass_fields__.values():
            assert len(spec.metadata['meaning']) > 4

    @pytest.mark.parametrize(('name', 'value'), [
        ('rate', 0.0), ('rate', math.nan), ('rate', 2000.0), ('slip', -0.1), ('slip', 'much'),
        ('seed', -1), ('seed', 1.5), ('lockstep', 1), ('v_max', 0.0), ('robot_radius', 0.0),
        ('frame_id', ''), ('world', ' '), ('cmd_vel_timeout', math.inf), ('start_x', math.nan),
        ('speed_factor', 0.0)])
    def test_out_of_range(self, name, value):
        with pytest.raises(ValueError, match=name):
            SimSettings(**{name: value})

    def test_lockstep_brings_stamps_and_a_clock(self):
        assert SimSettings(lockstep=True, publish_clock=False).is_stamped
        assert SimSettings(lockstep=True, publish_clock=False).has_clock
        assert not SimSettings(publish_clock=False).has_clock
        assert not SimSettings().is_stamped
