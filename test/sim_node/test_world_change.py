"""Another world around the robot: where it stands then, and what is under way meanwhile."""

from itertools import cycle
import math

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from control_field.grid import Grid
from control_field.records import Outcome
from msgs_bridge.messages.neighbourhoods import occupancy_from_map
from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
import ros_helpers
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from sim_node.start import place_in
from sim_node.world_change import WorldChange
from simulator_peer import simulator
from world_maps.world import save_world, World

GRID = Grid(8, 8, 0.25)


def saved(folder, name, blocked=(), grid=GRID):
    """Write a world with some blocked cells; return its path as a parameter has it."""
    cells = np.zeros(grid.shape, np.int8)
    for row, col in blocked:
        cells[row, col] = 100
    return str(save_world(folder / f'{name}.yaml', World(grid, cells)))


def all_but(*free):
    return [cell for cell in np.ndindex(GRID.shape) if cell not in free]


class Changing:
    """A simulation whose world is changed as its node does it."""

    def __init__(self, folder):
        self.settings = SimSettings(world=saved(folder, 'first'))
        cells = np.zeros(GRID.shape, np.int8)
        self.simulation = Simulation(World(GRID, cells), self.settings)
        self.recorder, self.has_controller = '', True
        self.change = WorldChange(
            self.simulation, lambda: self.recorder, lambda: self.has_controller)

    def to(self, world):
        self.change.check(self.settings, {'world': world})
        return self.change.make(self.settings)


@pytest.fixture
def changing(tmp_path):
    """Return a simulation whose world can be changed; its robot stands at (0.625, 0.875)."""
    return Changing(tmp_path)


class TestWhereTheRobotGoes:
    def test_one_that_has_room_stays(self, changing, tmp_path):
        before = changing.simulation.robot.truth
        loaded, notes = changing.to(saved(tmp_path, 'other', [(6, 6)]))
        assert (loaded.world.name, notes) == ('other', [])
        assert changing.simulation.robot.truth == before

    def test_one_in_a_wall_is_set_to_the_nearest_free_cell_and_that_is_said(
            self, changing, tmp_path):
        _, [note] = changing.to(saved(tmp_path, 'other', [(3, 2), (2, 2), (3, 1)]))
        truth = changing.simulation.robot.truth
        assert (truth.x, truth.y) in {(0.875, 0.875), (0.625, 1.125)}
        for word in ('(0.62, 0.8', 'other', f'({truth.x:.2f}, {truth.y:.2f})'):
            assert word in note
        assert changing.simulation.robot.odometry == truth
        assert not changing.simulation.in_contact

    def test_a_pocket_is_no_free_place_where_there_is_a_larger_one(self, changing, tmp_path):
        changing.to(saved(tmp_path, 'other', all_but((3, 3), (7, 6), (7, 7))))
        assert changing.simulation.robot.truth[:2] == (1.625, 1.875)

    def test_one_beyond_the_world_is_set_to_its_start(self, changing, tmp_path):
        far = saved(tmp_path, 'far', grid=Grid(8, 8, 0.25, 10.0, 10.0))
        changing.settings = SimSettings(start_x=10.4, start_y=10.4)
        changing.to(far)
        assert changing.simulation.robot.truth[:2] == (10.4, 10.4)

    def test_where_nothing_is_free_the_world_is_refused(self, changing, tmp_path):
        before = changing.simulation.world
        with pytest.raises(ValueError, match='nothing in it is free'):
            changing.to(saved(tmp_path, 'full', all_but()))
        assert changing.simulation.world is before

    @pytest.mark.parametrize('n_free', [1, 5, 30])
    def test_the_place_is_always_one_to_stand_at(self, n_free):
        rng = np.random.default_rng(n_free)
        for _ in range(50):
            cells = np.full(GRID.shape, 100, np.int8)
            cells.reshape(-1)[rng.permutation(cells.size)[:n_free]] = 0
            world = World(GRID, cells)
            here = Placement(*rng.uniform(0.0, 2.0, 2), math.pi / 3)
            place = place_in(world, here, SimSettings())
            assert not world.is_blocked(*GRID.cell_from_world(place.x, place.y))
            assert place.yaw == here.yaw
            simulation = Simulation(world, SimSettings(start_x=place.x, start_y=place.y))
            assert not simulation.in_contact


class TestWhatIsUnderWay:
    @pytest.mark.parametrize('state', [State.RUNNING, State.PAUSED])
    def test_a_trial_keeps_its_robot_and_its_cells(self, changing, tmp_path, state):
        changing.change.on_status(TrialStatus(state, 7))
        for blocked, grid, word in (([(3, 2)], GRID, 'robot'), ([], Grid(7, 7, 0.3), 'cells')):
            with pytest.raises(ValueError, match=f'{word}.*trial 7 is {state}'):
                changing.to(saved(tmp_path, 'other', blocked, grid))
        changing.to(saved(tmp_path, 'other', [(6, 6)]))  # walls may come and go
        changing.change.on_status(TrialStatus(State.ENDED, 7, Outcome.GOAL))
        changing.to(saved(tmp_path, 'other', [(3, 2)]))

    def test_so_does_a_demonstration(self, changing, tmp_path):
        changing.recorder = 'learner_node'
        with pytest.raises(ValueError, match='learner_node records a demonstration'):
            changing.to(saved(tmp_path, 'other', [(3, 2)]))

    def test_a_controller_that_is_gone_keeps_nothing(self, changing, tmp_path):
        changing.change.on_status(TrialStatus(State.RUNNING, 7))
        changing.has_controller = False
        changing.to(saved(tmp_path, 'other', [(3, 2)]))


@pytest.mark.parametrize('lockstep', [False, True])
def test_a_file_that_was_drawn_anew_is_the_world_at_once(ros_node, tmp_path, lockstep):
    maps = ros_helpers.collect(ros_node, OccupancyGrid, 'map', qos.LATCHED)
    trials = ros_node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
    path = saved(tmp_path, 'drawn', grid=Grid(20, 20, 0.25))

    def refusal(world):
        request = SetParameters.Request(
            parameters=[Parameter('world', value=world).to_parameter_msg()])
        [result] = ros_helpers.call(
            ros_node, SetParameters, 'sim_node/set_parameters', request).results
        return '' if result.successful else result.reason

    with simulator(ros_node, tmp_path, stamped=lockstep, lockstep=lockstep, world=path) as peer:
        peer.wait(lambda: maps and peer.of(Odometry), 'the map')
        saved(tmp_path, 'drawn', [(3, 2)], Grid(20, 20, 0.25))
        assert not refusal(path)
        peer.wait(lambda: occupancy_from_map(maps[-1])[1][3, 2] == 100, 'the new map')
        peer.wait(lambda: pose_from_odometry(peer.of(Odometry)[-1]).y != 0.875, 'the new place')
        peer.wait(lambda: 'has no room for it' in peer.process.stderr, 'the sentence')
        others = cycle([saved(tmp_path, 'wide', grid=Grid(9, 9, 0.5)), path])
        trials.publish(status_from_trial(TrialStatus(State.RUNNING, 3), 'robot'))
        peer.wait(lambda: 'trial 3 is running' in refusal(next(others)), 'the refusal')
