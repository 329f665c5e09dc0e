"""Controller and simulator on a map of small pixels, without ROS: nothing holds or is hit."""

import numpy as np
import pytest

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from experience_evaluation.teachers import demonstrate
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.raster import Raster
from world_maps.robot_cells import robot_cells, robot_grid
from world_maps.world import World

TICK = 0.05


def posts(x, y, radius=0.105):
    """Return a room of 3.5 x 3.5 m with nine posts of 30 cm, a metre apart, anywhere on cells."""
    occupancy = np.zeros((70, 70), dtype=np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    rows, cols = np.indices(occupancy.shape)
    for row in (15, 35, 55):
        for col in (15, 35, 55):
            occupancy[np.hypot(rows - row, cols - col) < 3.0] = 100
    pixels = Raster(Grid(70, 70, 0.05, x, y), occupancy)
    grid = robot_grid(pixels.grid, 0.25)
    return World(grid, robot_cells(pixels, grid, radius), 'posts', (), pixels, radius)


class Bench:
    """A controller and the robot it drives."""

    def __init__(self, world, x, y, yaw=0.0):
        self.simulation = Simulation(world, SimSettings(start_x=x, start_y=y, start_yaw=yaw))
        self.supervisor = Supervisor(Settings(), Parameters(), lambda *_: None)
        self.now = 1.0

    def sense(self):
        self.now += TICK
        robot, seen = self.simulation.robot, self.simulation.local_grid()
        grid = self.simulation.world.grid
        self.supervisor.on_neighbourhood(
            Neighbourhood(self.now, seen.row, seen.col, seen.cells, fine=seen.fine), self.now,
            grid)
        return self.supervisor.on_pose(
            Pose(self.now, *robot.odometry, robot.speed, robot.turn_rate), self.now)

    def tick(self, velocity):
        if velocity is not None:
            self.simulation.command(*velocity)
        self.simulation.tick(TICK)

    def tries(self):
        self.sense()
        assert self.supervisor.start(self.now) == ''
        first = self.now
        while self.supervisor.trial.run is not None and self.now - first < 120.0:
            self.tick(self.sense().velocity)
        return self.supervisor.status.outcome, self.now - first


@pytest.mark.parametrize(('x', 'y'), [(0.0, 0.0), (-1.13, -1.62), (0.06, 7.47)])
def test_a_way_that_was_shown_is_driven_in_time_and_nothing_is_touched(x, y):
    world = posts(x, y)
    start, goal = (world.grid.cell_from_world(x + a, y + a) for a in (0.35, 3.15))
    truth, learner = GridWorld(world.occupancy, Parameters()), Learner(world.grid, Parameters())
    demonstration = demonstrate(truth, 'shortest', start, goal, np.random.default_rng(0), 1)
    bench = Bench(world, *world.grid.world_from_cell(*start))
    bench.supervisor.accept_field(learner.add_demonstration(demonstration).field)
    outcome, seconds = bench.tries()
    assert outcome == 'goal'
    assert seconds < 60.0  # about 4 m at 0.2 m/s, turning where it has to
    assert bench.simulation.n_collisions == 0


@pytest.mark.parametrize('room', [0.03, 0.07])
def test_by_hand_one_drives_past_a_post_as_near_as_there_is_room(room):
    world = posts(0.0, 0.0)
    y = 0.775 + 0.15 + 0.105 + room  # the posts' middles are at 0.775 m
    bench = Bench(world, 0.4, y)
    for _ in range(100):
        bench.sense()
        bench.tick(bench.supervisor.manual.on_teleop_command((0.2, 0.0), bench.now, TICK).velocity)
    assert bench.simulation.robot.truth[:2] == pytest.approx((1.4, y), abs=0.05)
    assert bench.simulation.n_collisions == 0
