"""
Measure what wheel slip and heading drift do to the paper's tasks, and what mends it.

``python -m benchmarks.localisation --runs 100 --json OUT``: simulator, controller and learner in
one process, in lock-step and without ROS. A run is a demonstration and a few trials with learning
between them; every run has its own random slip. What is judged is where the robot truly was.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
import json
import math
from pathlib import Path
import time
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.drives.demonstration import demonstration_from_poses
from control_field.grid import Grid
from control_field.learning.learner import Learner
from control_field.local_grid import masks_from_neighbourhood
from control_field.parameters import Parameters
from control_field.records import DECISION_DTYPE, Demonstration, Outcome, Trial
from control_field.robot.stop_rules import StopReason
from control_field_node.driving.trial_run import Answer
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from experience_cli.demo.path_follower import Driver, points_from_cells
from experience_cli.demo.show_and_try import WAY
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.clearance import Clearance
from world_maps.world import find_world, load_world

TASKS: Final = ('task1', 'task2')
TICK: Final = 0.05
#: How far from the goal's cell the robot may truly stand in the end, [m].
GRACE: Final = 0.15
#: A localisation as AMCL's: standard deviations [m] and [rad], ticks between two poses.
POSE_STD, POSE_YAW_STD, POSE_EVERY = 0.02, math.radians(2.0), 2
_MAX_TICKS: Final = 20_000
_START: Final = Placement(0.625, 0.875, 0.0)

SLIP: Final = {'slip': 0.05, 'heading_drift': 0.01745}


@dataclass(frozen=True)
class Condition:
    """
    What is measured.

    Parameters
    ----------
    name : str
    wheels : dict
        Parameters of the simulator.
    settings : dict
        Parameters of the controller.
    localised : bool
        Whether poses come from a localisation.

    """

    name: str
    wheels: dict[str, Any]
    settings: dict[str, Any]
    localised: bool = False


@dataclass(frozen=True)
class Ride:
    """
    One trial, as it truly was.

    Parameters
    ----------
    outcome : str
        What the controller says.
    touched : bool
        Whether the robot touched something.
    off_x, off_y : float, [m]
        Where it truly stood in the end, from the goal's centre.
    worst : float, [m]
        Greatest distance between where it was and where it believed to be.
    steps, reinforcements : int
    room : float, [m]
        Least distance of its edge to anything under way.
    seconds : float
        Simulated.

    """

    task: str
    seed: int
    trial: int
    outcome: str
    touched: bool
    off_x: float
    off_y: float
    worst: float
    room: float
    steps: int
    reinforcements: int
    seconds: float
    micros: float

    def is_success(self, resolution: float = 0.25) -> bool:
        """Return whether the robot is truly at the goal, untouched."""
        near = 0.5 * resolution + GRACE
        return (self.outcome == 'goal' and not self.touched
                and max(abs(self.off_x), abs(self.off_y)) <= near)


class Bench:
    """
    A robot, its controller and its learner in one process.

    Parameters
    ----------
    task : str
    condition : Condition
    seed : int

    """

    def __init__(self, task: str, condition: Condition, seed: int) -> None:
        self.task, self.condition, self.seed = task, condition, seed
        wheels = SimSettings(seed=seed, **condition.wheels)
        self.open, self.world = (load_world(find_world(name)) for name in ('open', task))
        self.simulation = Simulation(self.open, wheels)
        self.learner = Learner(self.open.grid, Parameters(seed=seed))
        self.clearance = Clearance(self.world, wheels.robot_radius)
        self.supervisor = Supervisor(
            Settings(lockstep=True, **condition.settings), Parameters(seed=seed),
            lambda *_: None)
        self._rng = np.random.default_rng([seed, 1])
        self._n_ticks = 0
        self._spent = 0.0

    @property
    def grid(self) -> Grid:
        """Return the workspace."""
        return self.open.grid

    def run(self, n_trials: int) -> Iterator[Ride]:
        """Show the way once, then try, learning after each trial."""
        field = self.learner.add_demonstration(self._show()).field
        self.simulation.change(self.simulation.parameters, self.world)
        for number in range(1, n_trials + 1):
            self.supervisor.accept_field(field)
            ride, trial = self._ride(number)
            yield ride
            field = self.learner.add_trial(trial).field

    def _show(self) -> Demonstration:
        """Drive the way in the open workspace, by odometry, as the demo's driver does."""
        driver = Driver(points_from_cells(self.grid, WAY))
        stamps: list[float] = []
        xy: list[tuple[float, ...]] = []
        masks: list[tuple[int, int]] = []
        self.simulation.place(_START)
        while True:
            pose = self.simulation.robot.odometry
            stamps.append(len(stamps) * TICK)
            xy.append(pose[:2])
            masks.append(masks_from_neighbourhood(self.simulation.local_grid().cells))
            command = driver.command(*pose)
            if command is None:
                break
            self.simulation.command(*command)
            self.simulation.tick(TICK)
        blocked, unknown = np.array(masks, dtype=np.uint8).T
        return demonstration_from_poses(
            self.grid, np.array(stamps), np.array(xy), np.array(stamps), blocked, unknown, 1)[0]

    def _ride(self, number: int) -> tuple[Ride, Trial]:
        """Set the robot back and let it try once."""
        field = self.supervisor.field.current
        assert field is not None
        self.simulation.place(_START)
        before = self.simulation.n_collisions
        first, self._spent = self._n_ticks, 0.0
        rows: list[npt.NDArray[np.void]] = []
        worst, room = 0.0, math.inf
        for _ in range(POSE_EVERY):
            self._take(self._sense(), rows)
        problem = self.supervisor.start(self._now)
        assert not problem, problem
        while self.supervisor.trial.run is not None and self._n_ticks - first < _MAX_TICKS:
            self._take(self._sense(), rows)
            truth, believed = self.simulation.robot.truth, self.supervisor.sensing.pose
            assert believed is not None
            worst = max(worst, math.hypot(truth.x - believed.x, truth.y - believed.y))
            self.simulation.tick(TICK)
            room = min(room, self.clearance.at(*self.simulation.robot.truth[:2]))
            if self.simulation.in_contact:
                self._take(self.supervisor.trial.halt(StopReason.CONTACT), rows)
        status, truth = self.supervisor.status, self.simulation.robot.truth
        goal = self.grid.world_from_cell(*field.goal)
        n_ticks = self._n_ticks - first
        ride = Ride(
            self.task, self.seed, number, str(status.outcome or 'endless'),
            self.simulation.n_collisions > before, truth.x - goal[0], truth.y - goal[1], worst,
            room, status.steps, status.reinforcements, n_ticks * TICK,
            1e6 * self._spent / n_ticks)
        decisions = np.concatenate(rows) if rows else np.zeros(0, DECISION_DTYPE)
        return ride, Trial(decisions, status.outcome or Outcome.GAVE_UP, number)

    @property
    def _now(self) -> float:
        return self._n_ticks * TICK

    def _sense(self) -> Answer:
        """Hand the controller what the robot senses in this tick."""
        self._n_ticks += 1
        robot, local_grid = self.simulation.robot, self.simulation.local_grid()
        began = time.perf_counter()
        self.supervisor.on_neighbourhood(
            Neighbourhood(self._now, local_grid.row, local_grid.col, local_grid.cells), self._now)
        answer = self.supervisor.on_pose(
            Pose(self._now, *robot.odometry, robot.speed, robot.turn_rate), self._now)
        if self.condition.localised and self._n_ticks % POSE_EVERY == 0:
            self._localise()
        self._spent += time.perf_counter() - began
        return answer

    def _localise(self) -> None:
        """Hand the controller a noisy pose."""
        noise = self._rng.standard_normal(3) * (POSE_STD, POSE_STD, POSE_YAW_STD)
        x, y, yaw = (np.array(self.simulation.robot.truth) + noise).tolist()
        self.supervisor.sensing.on_localised_pose(
            Pose(self._now, x, y, yaw, frame_id='map'),
            (POSE_STD**2, POSE_STD**2, POSE_YAW_STD**2), self._now)

    def _take(self, answer: Answer, rows: list[Any]) -> None:
        rows += answer.rows
        if answer.velocity is not None:
            self.simulation.command(*answer.velocity)


def conditions() -> list[Condition]:
    """Return what is measured."""
    mended = {'anchoring': True}
    return [
        Condition('exact wheels', {}, {'anchoring': False}),
        Condition('exact wheels, anchoring', {}, mended),
        Condition('slip and drift', SLIP, {'anchoring': False}),
        Condition('slip and drift, anchoring', SLIP, mended),
        Condition('slip and drift, pose_topic', SLIP,
                  {'anchoring': False, 'pose_topic': 'amcl_pose'}, True),
        Condition('slip and drift, both', SLIP, {**mended, 'pose_topic': 'amcl_pose'}, True),
    ]


def measure(job: tuple[str, Condition, int, int]) -> list[Ride]:
    """Make one run."""
    task, condition, seed, n_trials = job
    return list(Bench(task, condition, seed).run(n_trials))


def line(condition: str, task: str, trials: str, rides: Sequence[Ride]) -> str:
    """Return a row of the table."""
    n = len(rides)
    off = [math.hypot(ride.off_x, ride.off_y) for ride in rides if ride.outcome == 'goal']
    shown = [f'{100 * value:.1f}' for value in (
        np.quantile(off, (0.5, 0.95)) if off else (math.nan, math.nan))]
    return (f'| {condition} | {task} | {trials} | {n} | '
            f'{sum(ride.is_success() for ride in rides)} | '
            f'{sum(ride.touched for ride in rides)} | '
            f'{shown[0]} / {shown[1]} | {100 * np.median([r.worst for r in rides]):.1f} | '
            f'{100 * min(r.room for r in rides):.1f} | '
            f'{np.median([r.steps for r in rides]):g} | '
            f'{np.median([r.micros for r in rides]):.0f} |')


HEAD: Final = """\
| condition | task | trial | runs | success | collisions | off the goal, median / 95 % [cm] | \
pose error [cm] | least room [cm] | steps | us a tick |
|---|---|---|---|---|---|---|---|---|---|---|"""


def table(results: dict[str, list[Ride]], n_trials: int) -> str:
    """Return the table as Markdown."""
    rows = [HEAD]
    for name, rides in results.items():
        for task in TASKS:
            for label, keep in _parts(n_trials):
                chosen = [r for r in rides if r.task == task and keep(r.trial)]
                if chosen:
                    rows.append(line(name, task, label, chosen))
    return '\n'.join(rows)


def _parts(n_trials: int) -> list[tuple[str, Callable[[int], bool]]]:
    parts: list[tuple[str, Callable[[int], bool]]] = [('1', lambda n: n == 1)]
    if n_trials > 1:
        parts.append((f'2 to {n_trials}', lambda n: n > 1))
    return parts


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--runs', type=int, default=100, help='of each task and condition')
    parser.add_argument('--trials', type=int, default=3, help='of each run')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--only', default='', help='conditions whose name holds this')
    parser.add_argument('--set', action='append', default=[], metavar='NAME=VALUE',
                        help='a setting of the controller, for every condition')
    parser.add_argument('--json', type=Path)
    arguments = parser.parse_args()
    extra = {name: json.loads(value) for name, value in (
        item.split('=', 1) for item in arguments.set)}
    results: dict[str, list[Ride]] = {}
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for condition in conditions():
            if arguments.only not in condition.name:
                continue
            if extra:
                condition.settings.update(extra)
            jobs = [(task, condition, seed, arguments.trials)
                    for task in TASKS for seed in range(arguments.runs)]
            results[condition.name] = [
                ride for rides in pool.map(measure, jobs) for ride in rides]
            print(table({condition.name: results[condition.name]}, arguments.trials), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(
            {name: [asdict(ride) for ride in rides] for name, rides in results.items()}))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
