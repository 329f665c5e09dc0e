"""
Measure what late, irregular and lost messages do to a trial: collisions, success, time.

``python -m benchmarks.late_poses --runs 100``: simulator and controller in one process, without
ROS, with a link between them that delays and loses odometry, local grid and commands. A run is one
trial of a field that was demonstrated without the obstacles that are met now, from a random start.
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import lru_cache
import heapq
import itertools
import json
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.localisation import Bench as LearningBench
from benchmarks.localisation import Condition as Wheels
from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField, Outcome
from control_field_node.driving.trial_run import Answer
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.clearance import Clearance
from world_maps.world import find_world, load_world, World

#: Step of everything, [s]; how often the robot says where it is, how often the controller looks
#: after itself, in steps.
STEP: Final = 0.01
POSE_EVERY, GUARD_EVERY, WATCH_EVERY = 5, 2, 10
#: The robot is heard for so long before the trial is asked for, and for so long at most, [s].
WARM_UP, LONGEST = 3.0, 400.0


@dataclass(frozen=True)
class Link:
    """
    How messages travel.

    Parameters
    ----------
    delay, jitter : float, [s]
        A message takes ``delay`` and up to ``jitter`` more.
    loss : float
        Share of the messages that never arrive.
    command_delay, command_jitter : float, [s]
        The same for commands.
    command_loss : float
    overtakes : bool
        Whether a message may overtake the one before it.
    clock_offset : float, [s]
        What the robot's clock is ahead of the controller's.
    good_for : float, [s]
        The link is perfect until so long after the trial has begun.
    outage, command_outage : float, [s]
        For so long nothing arrives, neither way or no command, about every fourth second.
    is_stamped : bool
        Whether commands say when they were sent: the base then drops those older than its
        timeout.
    name : str

    """

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    command_delay: float = 0.0
    command_jitter: float = 0.0
    command_loss: float = 0.0
    overtakes: bool = False
    clock_offset: float = 0.0
    good_for: float = 0.0
    outage: float = 0.0
    command_outage: float = 0.0
    is_stamped: bool = False
    name: str = ''


@dataclass(frozen=True)
class Ride:
    """
    What became of a trial.

    Parameters
    ----------
    outcome, reason : str
        What the controller says.
    n_collisions : int
        Times the robot touched something.
    seconds : float
    steps : int

    """

    outcome: str
    reason: str
    n_collisions: int
    seconds: float
    steps: int

    @property
    def is_success(self) -> bool:
        """Return whether the robot is at the goal, untouched."""
        return self.outcome == Outcome.GOAL and not self.n_collisions


class Way:
    """One direction of a link: what is sent arrives later, or never."""

    def __init__(self, delay: float, jitter: float, loss: float, overtakes: bool,
                 rng: np.random.Generator) -> None:
        self._spec = delay, jitter, loss
        self._overtakes, self._rng = overtakes, rng
        self.bad_from = -math.inf
        self.outage = 0.0
        self._out: list[tuple[float, int, Any]] = []
        self._number, self._last = itertools.count(), -math.inf

    def send(self, now: float, what: Any) -> None:
        """Put something on its way."""
        delay, jitter, loss = self._spec if now >= self.bad_from else (0.0, 0.0, 0.0)
        if self.outage and (now + 0.37 * int(now / 4.0)) % 4.0 < self.outage:
            return
        if loss and self._rng.random() < loss:
            return
        at = now + delay + (jitter * self._rng.random() if jitter else 0.0)
        if not self._overtakes:
            at = self._last = max(at, self._last)
        heapq.heappush(self._out, (at, next(self._number), what))

    def arrived(self, now: float) -> Iterator[Any]:
        """Yield what has arrived."""
        while self._out and self._out[0][0] <= now + 1e-9:
            yield heapq.heappop(self._out)[2]


class LateBench:
    """
    A robot and its controller at the two ends of a link.

    Parameters
    ----------
    world : World
    field : ControlField
    link : Link
    seed : int
        Of the link and of the start.
    robot : dict
        Parameters of the simulator.
    settings : dict
        Parameters of the controller.

    """

    def __init__(
        self, world: World, field: ControlField, link: Link, seed: int,
        robot: dict[str, Any] | None = None, settings: dict[str, Any] | None = None,
    ) -> None:
        self.n_steps, self.now = 0, 100.0
        self.rng = np.random.default_rng(seed)
        x, y, yaw = self._somewhere(world, field)
        self.simulation = Simulation(world, SimSettings(
            seed=seed, start_x=x, start_y=y, start_yaw=yaw, **(robot or {})))
        self.lines: list[str] = []
        self.supervisor = Supervisor(
            Settings(**(settings or {})), Parameters(seed=seed),
            lambda level, text: self.lines.append(f'{self.now:.2f} {level}: {text}'))
        self.supervisor.accept_field(field)
        self.link, self.field = link, field
        self.up = Way(link.delay, link.jitter, link.loss, link.overtakes, self.rng)
        self.down = Way(link.command_delay, link.command_jitter, link.command_loss,
                        link.overtakes, self.rng)
        self.up.outage, self.down.outage = link.outage, link.outage or link.command_outage
        if link.good_for:
            self.up.bad_from = self.down.bad_from = 100.0 + WARM_UP + link.good_for
        self.commands: list[tuple[float, tuple[float, float]]] = []

    def _somewhere(self, world: World, field: ControlField) -> Placement:
        clearance = Clearance(world, 0.105)
        to_goal = GridWorld(world.occupancy, Parameters()).cost_to(field.goal)
        while True:
            row, col = (int(self.rng.integers(n)) for n in world.grid.shape)
            x, y = world.grid.world_from_cell(row, col)
            x, y = x + self.rng.uniform(-0.01, 0.01), y + self.rng.uniform(-0.01, 0.01)
            if clearance.at(x, y) > 0.005 and (row, col) != field.goal and np.isfinite(
                    to_goal[row, col]):
                return Placement(x, y, self.rng.uniform(-math.pi, math.pi))

    def run(self) -> Ride:
        """Let the robot be heard, start a trial, and go on until it has ended."""
        while self.now < 100.0 + WARM_UP:
            self.step()
        problem = self.supervisor.start(self.now)
        began = self.now
        while not problem and self.supervisor.trial.run is not None and self.now - began < LONGEST:
            self.step()
        if problem:
            return Ride('refused', problem, self.simulation.n_collisions, 0.0, 0)
        status, seconds = self.supervisor.status, self.now - began
        for _ in range(round(3.0 / STEP)):  # whatever is still on its way
            self.step()
        return Ride(str(status.outcome or 'endless'), status.reason,
                    self.simulation.n_collisions, seconds, status.steps)

    def step(self) -> None:
        """Let a step of time pass at both ends."""
        for sent, velocity in self.down.arrived(self.now):
            age = self.now - sent if self.link.is_stamped else 0.0
            if age <= self.simulation.parameters.cmd_vel_timeout:
                self.simulation.command(*velocity)
        self.simulation.tick(STEP)
        self.n_steps += 1
        self.now += STEP
        if self.n_steps % POSE_EVERY == 0:
            self._sense()
        for message in self.up.arrived(self.now):
            self._hear(message)
        if self.n_steps % GUARD_EVERY == 0:
            self._take(self.supervisor.guard(self.now, self.now))
        if self.n_steps % WATCH_EVERY == 0:
            self._take(self.supervisor.check_inputs(self.now))

    def _sense(self) -> None:
        robot, seen = self.simulation.robot, self.simulation.local_grid()
        stamp = self.now + self.link.clock_offset
        self.up.send(self.now, Neighbourhood(stamp, seen.row, seen.col, seen.cells))
        self.up.send(self.now, Pose(stamp, *robot.odometry, robot.speed, robot.turn_rate))

    def _hear(self, message: Any) -> None:
        """Do as the node does."""
        if isinstance(message, Neighbourhood):
            self.supervisor.on_neighbourhood(message, self.now)
        elif problem := self.supervisor.sensing.inputs.poses.check(message, self.now):
            self.supervisor.sensing.inputs.odometry.pass_over(self.now, problem)
        else:
            self._take(self.supervisor.on_pose(message, self.now, self.now))

    def _take(self, answer: Answer) -> None:
        if answer.velocity is not None:
            self.commands.append((self.now, answer.velocity))
            self.down.send(self.now, (self.now, answer.velocity))


def cluttered(seed: int, share: float = 0.2, side: int = 14) -> tuple[World, ControlField]:
    """Return a world of obstacles at random, and the field that leads straight to a free cell."""
    rng = np.random.default_rng([seed, 11])
    occupancy = np.where(rng.random((side, side)) < share, 100, 0).astype(np.int8)
    goal = side - 3, side - 3
    occupancy[side - 4:side - 1, side - 4:side - 1] = 0
    grid = Grid(side, side, 0.25)
    return World(grid, occupancy, 'cluttered'), straight_to(goal, grid)


def straight_to(goal: tuple[int, int], grid: Grid, discount: float = 0.98) -> ControlField:
    """Return a field whose course is the straight line, with the Q-matrix that goes with it."""
    rows, cols = np.indices(grid.shape)
    ahead = np.stack([goal[1] - cols, goal[0] - rows]).astype(float)
    length = np.hypot(*ahead)
    vx, vy = (ahead / np.where(length > 0.0, length, 1.0)).astype(np.float32)
    q = np.stack([discount ** (STEP_LENGTH[h] + _octile(
        goal[0] - rows - STEP_ROW[h], goal[1] - cols - STEP_COL[h]))
        for h in range(8)], axis=2).astype(np.float32)
    flags = np.full(grid.shape, CellFlag.SUPPORTED, np.uint8)
    flags[goal] |= CellFlag.GOAL
    return ControlField(
        grid, 1, goal, vx, vy, (length > 0.0).astype(np.float32), q,
        np.full(grid.shape, -1, np.int8), flags)


def _octile(rows: Any, cols: Any) -> Any:
    near, far = np.sort(np.abs([rows, cols]), axis=0)
    return far + (math.sqrt(2.0) - 1.0) * near


@lru_cache
def learnt(task: str) -> tuple[World, ControlField]:
    """Return a world with obstacles, and the field that was demonstrated without them."""
    bench = LearningBench(task, Wheels('exact', {}, {}), 0)
    return load_world(find_world(task)), bench.learner.add_demonstration(bench._show()).field


def ride(job: tuple[str, Link, int, dict[str, Any], dict[str, Any]]) -> Ride:
    """Make one run."""
    task, link, seed, robot, settings = job
    scene = cluttered(seed) if task == 'cluttered' else learnt(task)
    return LateBench(*scene, link, seed, robot, settings).run()


def links() -> list[Link]:
    """Return what is measured."""
    return [
        Link(name='none'),
        *(Link(delay=d, name=f'{d:g} s') for d in (0.1, 0.2, 0.3, 0.4, 0.6)),
        *(Link(delay=d, command_delay=d, name=f'{d:g} s both ways') for d in (0.1, 0.2, 0.3)),
        Link(delay=0.1, jitter=0.2, loss=0.3, name='0.1 s + 0.2 s jitter, 30 % lost'),
        Link(delay=0.1, jitter=0.2, loss=0.3, overtakes=True,
             name='the same, messages overtake'),
        Link(0.1, 0.2, 0.3, 0.1, 0.2, 0.3, True, name='the same both ways'),
        Link(0.0, 0.0, 0.5, 0.0, 0.0, 0.5, name='50 % lost both ways'),
        Link(0.3, 0.0, 0.0, 0.3, good_for=3.0, name='0.3 s both ways, from 3 s on'),
        Link(outage=0.6, name='silent for 0.6 s every 4 s'),
        Link(0.3, 1.0, 0.5, 0.3, 1.0, 0.5, True, name='0.3 s + 1 s jitter, 50 % lost both ways'),
        *commands_alone(),
        Link(1.0, 0.0, 0.0, 1.0, good_for=4.0, name='1 s both ways, from 4 s on'),
        Link(delay=0.2, clock_offset=1e6, name='0.2 s, another clock'),
        Link(0.15, 0.0, 0.0, 0.15, clock_offset=1e6, name='0.15 s both ways, another clock'),
        Link(delay=0.2, clock_offset=0.15, name="0.2 s, the robot's clock 0.15 s ahead"),
        Link(delay=0.2, clock_offset=-0.15, name="0.2 s, the robot's clock 0.15 s behind"),
    ]


def commands_alone() -> list[Link]:
    """Return links that are bad for commands and good for odometry."""
    return [
        *(Link(command_delay=d, name=f'commands {d:g} s') for d in (0.3, 0.6)),
        Link(command_jitter=0.5, name='commands irregular by 0.5 s'),
        Link(command_jitter=0.5, overtakes=True, name='the same, they overtake'),
        Link(command_loss=0.8, name='80 % of the commands lost'),
        *(Link(command_delay=d, good_for=4.0, name=f'commands {d:g} s, from 4 s on')
          for d in (0.3, 0.7, 1.0, 2.0)),
        Link(command_delay=2.0, good_for=4.0, is_stamped=True, name='the same, stamped'),
        *(Link(command_outage=d, name=f'no commands for {d:g} s every 4 s') for d in (0.6, 2.0)),
    ]


HEAD: Final = """\
| late by | runs | at the goal | collisions | time, median [s] | ended otherwise |
|---|---|---|---|---|---|"""


def line(name: str, rides: Sequence[Ride]) -> str:
    """Return a row of the table."""
    seconds = [ride.seconds for ride in rides if ride.is_success]
    others: dict[str, int] = {}
    for r in rides:
        if not r.is_success:
            others[r.reason[:60] or r.outcome] = others.get(r.reason[:60] or r.outcome, 0) + 1
    shown = f'{np.median(seconds):.0f}' if seconds else '-'
    return (f'| {name} | {len(rides)} | {sum(r.is_success for r in rides)} | '
            f'{sum(r.n_collisions > 0 for r in rides)} | {shown} | '
            f'{"; ".join(f"{n} {why}" for why, n in others.items())} |')


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--runs', type=int, default=100, help='of each link')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--only', default='', help='links whose name holds this')
    parser.add_argument('--robot', default='{}', help='parameters of the simulator, as JSON')
    parser.add_argument('--settings', default='{}', help='those of the controller')
    parser.add_argument('--json', type=Path)
    arguments = parser.parse_args()
    results: dict[str, list[Ride]] = {}
    print(HEAD)
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for link in links():
            if arguments.only in link.name:
                jobs = [(('task1', 'cluttered', 'task2', 'cluttered')[seed % 4], link, seed,
                         json.loads(arguments.robot), json.loads(arguments.settings))
                        for seed in range(arguments.runs)]
                results[link.name] = list(pool.map(ride, jobs))
                print(line(link.name, results[link.name]), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(
            {name: [asdict(r) for r in rides] for name, rides in results.items()}))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
