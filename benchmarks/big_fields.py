"""
Big fields: how long nobody looks after the robot while one arrives, and how long making one takes.

``python -m benchmarks.big_fields`` drives two controllers, processes of their own, in trials; one
of them gets field after field of so many cells a side, the other gets none: its longest silence
on `cmd_vel` in the same seconds is what probe and machine have by themselves. With ``--learn``
it measures what comes before, from a kept drive of 400 m, or an ended trial, to the message.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
import math
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any, Final

from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField
from experience_cli.demo.processes import Children, own_domain
from experience_evaluation.teachers import demonstration_from_path, shortest_path
from learner_node.learning.kernel_warm_up import warm_up_kernels
from msgs_bridge.messages.memory_identity import memory_of
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.serialized import cdr_from_cloud
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.node import qos

_SIDE: Final = 0.25
_PERIOD: Final = 0.02
#: Fields that are sent, and the time for each, [s].
_N_FIELDS: Final = 4
_APART: Final = 4.0


def field_along_x(n_rows: int, n_cols: int, revision: int) -> ControlField:
    """Return a field that leads along the middle row to its end."""
    grid = Grid(n_rows, n_cols, _SIDE)
    goal, one = (n_rows // 2, n_cols - 3), np.ones(grid.shape, dtype=np.float32)
    flags = np.full(grid.shape, CellFlag.SUPPORTED, dtype=np.uint8)
    flags[goal] |= CellFlag.GOAL
    q = np.full((*grid.shape, 8), 0.5, dtype=np.float32)
    q[:, :, 0] = 0.98 ** np.maximum(goal[1] - np.arange(n_cols), 0)
    return ControlField(grid, revision, goal, one, 0.0 * one, one, q,
                        np.zeros(grid.shape, dtype=np.int8), flags)


class Robot:
    """
    A robot that drives as it is told, and notes when it is.

    Parameters
    ----------
    node : Node
    namespace : str
        Of its controller.
    grid : Grid
        Of its field.

    """

    def __init__(self, node: Node, namespace: str, grid: Grid) -> None:
        self._node, self._grid = node, grid
        self.odom = node.create_publisher(Odometry, f'{namespace}/odom', qos.ODOMETRY_PUB)
        self._local_grid = node.create_publisher(
            OccupancyGrid, f'{namespace}/neighbourhood', qos.ODOMETRY_PUB)
        node.create_subscription(Twist, f'{namespace}/cmd_vel', self._on_command, 50)
        self._client = node.create_client(Trigger, f'{namespace}/control_field_node/start_trial')
        self._x, self._y = grid.world_from_cell(grid.n_rows // 2, 3)
        self.v = 0.0
        self.heard: list[float] = []

    def _on_command(self, msg: Twist) -> None:
        self.v = msg.linear.x
        self.heard.append(time.monotonic())

    def tick(self) -> None:
        """Drive on, and say where it is."""
        self._x += self.v * _PERIOD
        stamp = self._node.get_clock().now().nanoseconds * 1e-9
        cell = self._grid.cell_from_world(self._x, self._y)
        self._local_grid.publish(grid_from_neighbourhood(
            Neighbourhood(stamp, *cell, np.zeros((3, 3), np.int8)), self._grid))
        self.odom.publish(odometry_from_pose(Pose(stamp, self._x, self._y, 0.0, v=self.v)))

    def ask_to_start(self) -> Any:
        """Ask for a trial; return the future answer."""
        return self._client.call_async(Trigger.Request())

    def silence(self, since: float) -> float:
        """Return the longest time without a command since then, [s]."""
        times = [since, *(at for at in self.heard if at > since), time.monotonic()]
        return float(np.diff(times).max())


class Rig:
    """Two robots, and the ticks that they live by."""

    def __init__(self, node: Node, robots: Sequence[Robot]) -> None:
        self.node, self.robots = node, robots
        self._due = time.monotonic()

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Tick for so long, or until something is so; return whether it is."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            for robot in self.robots:
                robot.tick()
            self._due = max(self._due + _PERIOD, time.monotonic() - _PERIOD)
            while (left := self._due - time.monotonic()) > 0.0:
                rclpy.spin_once(self.node, timeout_sec=left)
        return until()

    def start(self, robot: Robot) -> None:
        """Let a robot set out on the field of its controller."""
        for _ in range(30):
            answer = robot.ask_to_start()
            if self.run(3.0, answer.done) and answer.result().success:
                break
            self.run(1.0)
        if not self.run(10.0, lambda: robot.v > 0.15):
            raise SystemExit('the robot does not set out')


@contextmanager
def rig(folder: Path, size: int) -> Iterator[tuple[Rig, Callable[[], None]]]:
    """Start both controllers, and who has fields for one: yield also what sends the next."""
    with own_domain() as environment, Children(folder, environment) as children:
        for name, space in (('with', '/with'), ('beside', '/beside')):
            children.start(name, [
                sys.executable, '-m', 'control_field_node.node', '--ros-args', '-r',
                f'__ns:={space}'])
        domain = environment.get('ROS_DOMAIN_ID')
        rclpy.init(domain_id=int(domain) if domain else None)
        node = Node('big_fields')
        small = field_along_x(12, 400, 1)
        fields = node.create_publisher(PointCloud2, '/beside/control_field', qos.LATCHED)
        fields.publish(cloud_from_field(small))
        robots = (Robot(node, '/with', Grid(size, size, _SIDE)),
                  Robot(node, '/beside', small.grid))
        try:
            with pusher(size, environment) as push:
                yield Rig(node, robots), push
        finally:
            rclpy.try_shutdown()


def silences(size: int) -> tuple[float, float, float]:
    """Return the longest silence without fields, with them, and of the controller beside, [s]."""
    with tempfile.TemporaryDirectory() as folder, rig(Path(folder), size) as (both, push):
        robot, beside = both.robots
        push()
        both.start(beside)
        both.start(robot)
        both.run(1.0)
        since = time.monotonic()
        both.run(_N_FIELDS * _APART)
        idle, since = robot.silence(since), time.monotonic()
        for _ in range(_N_FIELDS):
            push()
            both.run(_APART)
        return idle, robot.silence(since), beside.silence(since)


@contextmanager
def pusher(size: int, environment: Mapping[str, str]) -> Iterator[Callable[[], None]]:
    """Start a process that has fields ready; yield what makes it send the next one."""
    command = [sys.executable, '-m', 'benchmarks.big_fields', '--push', str(size)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, text=True,
                          env={**os.environ, **environment}) as process:
        assert process.stdin is not None
        pipe = process.stdin

        def push() -> None:
            pipe.write('next\n')
            pipe.flush()

        try:
            yield push
        finally:
            pipe.close()
            process.wait()


def push_fields(size: int) -> None:
    """Send a field for every line of the standard input."""
    rclpy.init()
    node = Node('pusher')
    publisher = node.create_publisher(PointCloud2, '/with/control_field', qos.LATCHED)
    for revision, _ in enumerate(sys.stdin, start=1):
        publisher.publish(cdr_from_cloud(cloud_from_field(
            field_along_x(size, size, revision))))
    rclpy.try_shutdown()


def building(size: int) -> GridWorld:
    """Return rooms of 40 x 40 cells with doors, and a few pillars; the robot sees 29 x 29."""
    rng = np.random.default_rng(1)
    occupancy = np.where(rng.random((size, size)) < 0.01, 100, 0).astype(np.int8)
    occupancy[::40] = occupancy[:, ::40] = occupancy[-1] = occupancy[:, -1] = 100
    for row, col in np.ndindex(size // 40, size // 40):
        at = 40 * row + int(rng.integers(8, 30)), 40 * col + int(rng.integers(8, 30))
        if row:
            occupancy[40 * row, at[1]:at[1] + 6] = 0
        if col:
            occupancy[at[0]:at[0] + 6, 40 * col] = 0
    return GridWorld(occupancy, Parameters(step_limit=20 * size), 29)


def drive(world: GridWorld, n_cells: int) -> Any:
    """Return a demonstration that winds through a building."""
    size, rng = len(world.truth), np.random.default_rng(1)
    cost = world.cost_to((20, 20))
    cells, at = [(20, 20)], (20, 20)
    for share in ((0.3, 0.3), (0.2, 0.7), (0.6, 0.6), (0.5, 0.3), (0.9, 0.4), (0.9, 0.9)):
        there = np.argwhere(np.isfinite(cost))
        near = there[np.abs(there - np.multiply(share, size)).sum(axis=1).argmin()]
        cells += shortest_path(world, at, (int(near[0]), int(near[1])), rng)[1:]
        at = cells[-1]
    return demonstration_from_path(world, cells[:n_cells], 1)


def learn_and_push(size: int, n_trials: int) -> None:
    """Print what a drive and trials after it take from the worker to the message, [ms]."""
    world = building(size)
    warm_up_kernels(world.parameters)
    learner, rng = Learner(Grid(size, size, _SIDE), world.parameters), np.random.default_rng(0)
    demonstration = drive(world, round(1.6 * size))
    _report('a drive', learner, partial(learner.add_demonstration, demonstration))
    for number in range(1, n_trials + 1):
        field = learner.trial_field(exploring=True)
        start = next(cell for cell in learner.next_starts(99, rng, field)
                     if world.truth[cell] == 0)
        trial = world.trial(field, start, number)[0]
        _report(f'trial {number}', learner, partial(learner.add_trial, trial))


def _report(name: str, learner: Learner, learn: Callable[[], Any]) -> None:
    took = []

    def step(work: Callable[[], Any]) -> Any:
        began = time.process_time()
        result = work()
        took.append(1e3 * (time.process_time() - began))
        return result

    refresh = step(learn)
    step(lambda: memory_of('task', refresh.field, refresh.prototypes))
    field = step(lambda: learner.trial_field(exploring=name != 'a drive'))
    message = step(lambda: cloud_from_field(field))
    step(lambda: cdr_from_cloud(message))
    print(f'{name:10}' + ''.join(f'{each:8.0f}' for each in (*took, math.fsum(took))), flush=True)


def main() -> int:
    """Measure, print; return 1 if the robot was alone for too long."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('sizes', nargs='*', type=int, default=[200, 1000, 2000],
                        help='cells a side (%(default)s)')
    parser.add_argument('--learn', type=int, metavar='N', help='a drive and N trials instead')
    parser.add_argument('--push', type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.push:
        push_fields(arguments.push)
        return 0
    if arguments.learn is not None:
        print('CPU [ms]:   learn    name   field message    CDR     all')
        for size in arguments.sizes:
            learn_and_push(size, arguments.learn)
        return 0
    print('longest silence of cmd_vel, a pose every 20 ms [ms]: none arrives, fields arrive, '
          'beside it', flush=True)
    worst = 0.0
    for size in arguments.sizes:
        idle, busy, beside = silences(size)
        worst = max(worst, busy - max(idle, beside))
        print(f'{size} x {size}: {1e3 * idle:.0f}, {1e3 * busy:.0f}, {1e3 * beside:.0f}',
              flush=True)
    return 1 if worst > 0.02 else 0


if __name__ == '__main__':
    sys.exit(main())
