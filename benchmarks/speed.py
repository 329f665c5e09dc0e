"""
How fast the parts are that somebody waits for: ``make bench``.

Each line is the median of a few runs on this machine, beside what was promised for it; ``make
bench BENCH_ARGS=certificate`` measures the lines whose name holds that word. Exit code 1 says that
a promise was not kept. How well the method learns is the business of ``make evaluation``.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path
from statistics import median
import tempfile
import time
from typing import Final

import numpy as np
from rclpy.serialization import serialize_message

from control_field.grid import Grid
from control_field.kernels import compiled
from control_field.kernels.interpolation import Centres, Sums, Window
from control_field.kernels.steps import StepRules
from control_field.learning.certificate import certify
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import Trial
from control_field.robot.policy import TrialPolicy
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.topic_tables import local_grid_table, pose_table
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_evaluation.teachers import demonstration_from_path, shortest_path
from experience_evaluation.worlds import generate
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_field, field_from_cloud
from msgs_bridge.node.environment import prepare

Work = Callable[[], object]

#: Ten minutes at 50 Hz.
_RATE, _N_MESSAGES = 50.0, 30_000
_N_RUNS: Final = 7


@dataclass(frozen=True)
class Case:
    """
    Something to measure.

    Parameters
    ----------
    name : str
    limit : float, [s]
        What was promised; inf where nothing was.
    prepare : callable
        Given a folder of its own, it returns the work to measure.

    """

    name: str
    limit: float
    prepare: Callable[[Path], Work]

    def measure(self, folder: Path) -> float:
        """Return the median of a few runs after one that does not count, [s]."""
        work = self.prepare(folder)
        work()
        took = []
        for _ in range(_N_RUNS):
            began = time.perf_counter()
            work()
            took.append(time.perf_counter() - began)
        return median(took)


def taught(size: int, family: str = 'open') -> tuple[Learner, GridWorld, Trial]:
    """Return a learner that was shown a way across a world, and a trial to be learnt."""
    parameters = Parameters(step_limit=20 * size)
    world = GridWorld(generate(family, size, 1), parameters)
    goal = tuple(np.argwhere(world.truth == 0)[-1].tolist())
    reachable = np.argwhere(np.isfinite(world.cost_to(goal)))
    learner = Learner(Grid(size, size, 0.25), parameters)
    path = shortest_path(world, tuple(reachable[0].tolist()), goal, np.random.default_rng(1))
    learner.add_demonstration(demonstration_from_path(world, path, 1))
    start = tuple(reachable[len(reachable) // 2].tolist())
    return learner, world, world.trial(learner.trial_field(exploring=False), start, 1)[0]


def decisions(_: Path) -> Work:
    """Decide 100 times as the controller does, in plain Python."""
    learner, world, _trial = taught(20)
    field = learner.trial_field(exploring=False)
    cells = [(row, col, world.local_grid(row, col))
             for row, col in np.argwhere(world.truth == 0)[:100].tolist()]

    def decide() -> None:
        policy = TrialPolicy(field, Parameters(), np.random.default_rng(1), 1)
        for row, col, local_grid in cells:
            policy.decide(row, col, local_grid, 0, 0.0)
    return decide


def generalisation(_: Path) -> Work:
    """Evaluate eq. 7 with its windows: 1000 prototypes on 200 x 200 cells."""
    rng = np.random.default_rng(1)
    cells = np.stack(np.divmod(rng.choice(200 * 200, 1000, replace=False), 200), axis=1)
    headings = rng.integers(0, 8, 1000).astype(np.int8)
    everywhere = np.ones((200, 200), np.bool_)
    known, centres = np.zeros((200, 200), np.int8), Centres(
        cells, headings, rng.uniform(0.1, 1.0, 1000))
    window = Window(min(Parameters().effective_window, 200.0), Parameters().power, True)

    def add() -> None:
        compiled.add_windows(Sums.none(known.shape), known, centres, window, everywhere)
    return add


def refresh(size: int, family: str) -> Callable[[Path], Work]:
    """Learn a trial: rehearsal, repair, pruning and the certificate."""
    def prepare_it(_: Path) -> Work:
        learner, _world, trial = taught(size, family)
        return lambda: learner.add_trial(trial)
    return prepare_it


def certificate(size: int, family: str) -> Callable[[Path], Work]:
    """Certify a field from each of its cells."""
    def prepare_it(_: Path) -> Work:
        learner, _world, _trial = taught(size, family)
        field, memory = learner.trial_field(exploring=False), learner.memory
        return lambda: certify(field, memory.demonstrated, 1, StepRules(False, False, 8))
    return prepare_it


def wire(_: Path) -> Work:
    """Put a field of 200 x 200 cells on the wire and take it off."""
    learner, _world, _trial = taught(200)
    field = learner.trial_field(exploring=False)
    return lambda: field_from_cloud(cloud_from_field(field))


def bag(folder: Path) -> Work:
    """Read a bag of ten minutes at 50 Hz: poses and local grids as columns."""
    grid = Grid(20, 20, 0.25)
    task, local_grid = TaskFolder(folder, 'speed'), np.zeros((3, 3), np.int8)
    header = EpisodeHeader(EpisodeKind.DEMO, 'speed', grid).to_mapping()
    with start_bag(task, EpisodeKind.DEMO, header) as writer:
        for index in range(_N_MESSAGES):
            stamp, x = index / _RATE, 0.125 + 4.5 * index / _N_MESSAGES
            row, col = grid.cell_from_world(x, 2.0)
            for topic, kind, message in (
                    ('odom', 'Odometry', odometry_from_pose(Pose(stamp, x, 2.0, 0.0))),
                    ('neighbourhood', 'OccupancyGrid', grid_from_neighbourhood(
                        Neighbourhood(stamp, row, col, local_grid), grid))):
                writer.write(f'/{topic}', f'nav_msgs/msg/{kind}', serialize_message(message),
                             round(stamp * 1e9))

    def read() -> None:
        source = open_bag(writer.folder)
        pose_table(source.messages('/odom'), 'odom')
        local_grid_table(source.messages('/neighbourhood'), grid)
    return read


CASES: Final = (
    Case('100 decisions of a trial', math.inf, decisions),
    Case('generalisation, eq. 7, 200 x 200, 1000 prototypes', math.inf, generalisation),
    Case('refresh, 20 x 20', 0.2, refresh(20, 'rooms')),
    Case('refresh with rehearsal, 200 x 200', 1.0, refresh(200, 'random')),
    Case('certificate, 32 x 32', 0.05, certificate(32, 'maze')),
    Case('certificate, 1000 x 1000', 1.0, certificate(1000, 'open')),
    Case('field onto the wire and back, 200 x 200', math.inf, wire),
    Case('bag of ten minutes at 50 Hz', 0.05, bag),
)


def main() -> int:
    """Measure, print; return 1 if a promise was not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('only', nargs='*', help='words of the names to measure; all by default')
    words = parser.parse_args().only
    prepare()
    kept = True
    for case in CASES:
        if words and not any(word in case.name for word in words):
            continue
        with tempfile.TemporaryDirectory() as folder:
            took = case.measure(Path(folder))
        kept = kept and took <= case.limit
        limit = f'promised {case.limit * 1e3:g} ms' if math.isfinite(case.limit) else ''
        print(f'{case.name:52}{took * 1e3:10.2f} ms   {limit}', flush=True)
    return 0 if kept else 1


if __name__ == '__main__':
    raise SystemExit(main())
