"""
Measure what things that move do to the paper's tasks, and what the robot does to them.

``python -m benchmarks.movers``: simulator, controller and learner in one process, in lock-step and
without ROS. A run is a demonstration, trials among things that move, with learning after each, and
trials after they are gone. Who ran into whom is what the simulator says, not the controller.
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import pairwise
import json
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks import localisation
from control_field.grid import Grid
from control_field.local_grid import cells_from_fine
from control_field.records import DECISION_DTYPE, Outcome, Trial
from control_field_node.driving.trial_run import Answer
from experience_cli.demo.show_and_try import WAY
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from world_maps.clearance import Clearance
from world_maps.mover import Mover, Waypoint
from world_maps.window import true_window
from world_maps.world import World

TICK: Final = 0.05
_LONGEST: Final = 400.0
_START: Final = Placement(0.625, 0.875, 0.0)
#: Fidelity of a field that leads by the shown way.
_FAITHFUL: Final = 0.95


@dataclass(frozen=True)
class Condition:
    """
    What is measured.

    Parameters
    ----------
    name : str
    tasks : tuple of str
    kind : str
        ``wander``: three discs; ``any``: three discs of random radius and speed; ``cross``: five
        that go to and fro across the shown way.
    radius, speed : float, [m] and [m/s]
        Of each disc, or the greatest.
    n_runs, n_trials, n_after : int
        Runs of each task, trials among movers, and after they are gone.
    fine : int
        Finer cells along a side of a cell of the local grid.
    settings : dict
        Parameters of the controller.

    """

    name: str
    tasks: tuple[str, ...]
    kind: str
    radius: float
    speed: float
    n_runs: int
    n_trials: int
    n_after: int
    fine: int = 1
    settings: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True)
class Ride:
    """
    One trial, as it truly was.

    Parameters
    ----------
    task, outcome, reason : str
    seed, trial : int
    is_clean : bool
        Whether nothing moved.
    robot_contacts, mover_contacts : int
        How often the robot ran into something, and something that moves into the robot.
    steps, reinforcements : int
    seconds : float
    fidelity : float
        Of the field that was driven on, see `Certificate`.
    phantoms : int
        Free cells that count as occupied for certain after it.

    """

    task: str
    seed: int
    trial: int
    is_clean: bool
    outcome: str
    reason: str
    robot_contacts: int
    mover_contacts: int
    steps: int
    reinforcements: int
    seconds: float
    fidelity: float
    phantoms: int


def discs(condition: Condition, world: World, seed: int) -> list[Mover]:
    """Return what moves in a run."""
    rng = np.random.default_rng([seed, 7])
    if condition.kind == 'cross':
        return [_crossing(condition, world, rng) for _ in range(5)]
    if condition.kind == 'any':
        return [Mover(rng.uniform(0.04, condition.radius), rng.uniform(0.1, condition.speed),
                      mode='wander') for _ in range(3)]
    return [Mover(condition.radius, condition.speed, mode='wander') for _ in range(3)]


def _crossing(condition: Condition, world: World, rng: np.random.Generator) -> Mover:
    """Return a disc that goes straight to and fro through a shown cell, touching no wall."""
    clearance, shown = Clearance(world, condition.radius), _shown_cells(world.grid)
    while True:
        x, y = world.grid.world_from_cell(*shown[rng.integers(len(shown))])
        angle, near, far = rng.uniform(0.0, math.tau), *rng.uniform(0.5, 1.5, 2)
        along = np.linspace(-near, far, 60)
        points = [(x + s * math.cos(angle), y + s * math.sin(angle)) for s in along]
        speed = float(rng.uniform(0.05, condition.speed))
        if all(clearance.at(*point) >= 0.0 for point in points):
            return Mover(condition.radius, speed, (Waypoint(*points[0]), Waypoint(*points[-1])),
                         mode='back_and_forth')


def _shown_cells(grid: Grid) -> list[tuple[int, int]]:
    """Return the cells of the demonstration between its corners."""
    way, cells = WAY, []
    for (row, col), (to_row, to_col) in pairwise(way):
        n = max(abs(to_row - row), abs(to_col - col))
        cells += [(row + (to_row - row) * k // n, col + (to_col - col) * k // n)
                  for k in range(n)]
    return [*cells, way[-1]]


class Bench(localisation.Bench):
    """
    A robot, its controller and its learner among things that move.

    Parameters
    ----------
    task : str
    condition : Condition
    seed : int

    """

    def __init__(self, task: str, condition: Condition, seed: int) -> None:
        super().__init__(task, localisation.Condition(
            condition.name, {}, dict(condition.settings)), seed)
        self.measured = condition

    def run_among_movers(self) -> Iterator[Ride]:
        """Show the way once, then try among movers, then after they are gone."""
        refresh = self.learner.add_demonstration(self._show())
        number = 0
        for is_clean, n in ((False, self.measured.n_trials), (True, self.measured.n_after)):
            movers = [] if is_clean else discs(self.measured, self.world, self.seed)
            self.simulation = Simulation(self.world, SimSettings(seed=self.seed), movers)
            for _ in range(n):
                number += 1
                self.supervisor.accept_field(refresh.field)
                ride, trial = self._try(number, is_clean)
                ride['fidelity'] = refresh.certificate.fidelity
                refresh = self.learner.add_trial(trial)
                phantoms = (refresh.field.known == 100) & (self.world.occupancy == 0)
                yield Ride(**ride, phantoms=int(phantoms.sum()))

    def _try(self, number: int, is_clean: bool) -> tuple[dict[str, Any], Trial]:
        simulation, supervisor = self.simulation, self.supervisor
        simulation.place(_START)
        before = simulation.n_collisions, simulation.n_mover_contacts
        rows: list[Any] = []
        self._take(self._sense(), rows)
        problem = supervisor.start(self._now)
        assert not problem, problem
        first, touched = self._now, False
        while supervisor.trial.run is not None and self._now - first < _LONGEST:
            if simulation.in_contact != touched:
                touched = simulation.in_contact
                self._take(supervisor.on_contact(touched, self._now), rows)
            self._take(self._sense(), rows)
            simulation.tick(TICK)
        status = supervisor.status
        outcome = status.outcome or Outcome.GAVE_UP
        if status.outcome is None:
            supervisor.stop()
        decisions = np.concatenate(rows) if rows else np.zeros(0, DECISION_DTYPE)
        ride = {
            'task': self.task, 'seed': self.seed, 'trial': number, 'is_clean': is_clean,
            'outcome': str(status.outcome or 'endless'), 'reason': status.reason,
            'robot_contacts': simulation.n_collisions - before[0],
            'mover_contacts': simulation.n_mover_contacts - before[1],
            'steps': status.steps, 'reinforcements': status.reinforcements,
            'seconds': self._now - first}
        return ride, Trial(decisions, outcome, number)

    def _sense(self) -> Answer:
        """Hand the controller what the robot senses in this tick."""
        self._n_ticks += 1
        robot, k = self.simulation.robot, self.measured.fine
        cell = self.grid.cell_from_world(*robot.truth[:2])
        fine = true_window(self.world, self.simulation.movers.discs, *cell, 1, k)
        self.supervisor.on_neighbourhood(
            Neighbourhood(self._now, *cell, cells_from_fine(fine, k),
                          fine=fine if k > 1 else None), self._now)
        return self.supervisor.on_pose(
            Pose(self._now, *robot.odometry, robot.speed, robot.turn_rate), self._now)


def conditions(fine: int, settings: tuple[tuple[str, Any], ...]) -> list[Condition]:
    """Return what is measured."""
    return [
        *(Condition(f'three discs, {speed} m/s', ('task1',), 'wander', 0.15, speed, 5, 60, 20,
                    fine, settings) for speed in (0.1, 0.2, 0.3)),
        Condition('discs of any size', ('task1', 'task2'), 'any', 0.15, 0.3, 15, 20, 0, fine,
                  settings),
        Condition('five crossing', ('task1', 'task2'), 'cross', 0.15, 0.15, 50, 1, 1, fine,
                  settings)]


def measure(job: tuple[str, Condition, int]) -> list[Ride]:
    """Make one run."""
    task, condition, seed = job
    return list(Bench(task, condition, seed).run_among_movers())


HEAD: Final = """\
| what moves | fine | trials | at the goal | the robot ran into something | it was run into | \
time, median [s] | after: at the goal | by the shown way from trial | phantom walls |
|---|---|---|---|---|---|---|---|---|---|"""


def line(condition: Condition, rides: Sequence[Ride]) -> str:
    """Return a row of the table."""
    among = [ride for ride in rides if not ride.is_clean]
    after = [ride for ride in rides if ride.is_clean]
    return (f'| {condition.name} | {condition.fine} | {len(among)} | '
            f'{sum(ride.outcome == "goal" for ride in among)} | '
            f'{sum(ride.robot_contacts for ride in among)} | '
            f'{sum(ride.mover_contacts for ride in among)} | '
            f'{np.median([ride.seconds for ride in among]):.0f} | {_after(condition, after)} |')


def _after(condition: Condition, after: Sequence[Ride]) -> str:
    """Return how it went once nothing moved any more."""
    if not after:
        return '- | - | -'
    others = [ride.trial - condition.n_trials for ride in after
              if ride.outcome != 'goal' or ride.fidelity < _FAITHFUL]
    return (f'{sum(ride.outcome == "goal" for ride in after)} of {len(after)} | '
            f'{max(others, default=0) + 1} | '
            f'{sum(r.phantoms for r in after if r.trial == condition.n_trials + 1)}')


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--runs', type=int, help='of each task and condition')
    parser.add_argument('--trials', type=int, help='of each run, among movers')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--fine', type=int, default=1, choices=(1, 3, 5))
    parser.add_argument('--only', default='', help='conditions whose name holds this')
    parser.add_argument('--set', action='append', default=[], metavar='NAME=VALUE',
                        help='a setting of the controller, for every condition')
    parser.add_argument('--json', type=Path)
    arguments = parser.parse_args()
    extra = tuple((name, json.loads(value)) for name, value in (
        item.split('=', 1) for item in arguments.set))
    results: dict[str, list[Any]] = {}
    print(HEAD)
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for condition in conditions(arguments.fine, extra):
            if arguments.only not in condition.name:
                continue
            jobs = [(task, condition, seed) for task in condition.tasks
                    for seed in range(arguments.runs or condition.n_runs)]
            rides = [ride for made in pool.map(measure, jobs) for ride in made]
            print(line(condition, rides), flush=True)
            results[condition.name] = [asdict(ride) for ride in rides]
    if arguments.json:
        arguments.json.write_text(json.dumps(results))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
