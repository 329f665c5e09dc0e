"""
How long `experience learn` takes for a thousand trials.

``python -m benchmarks.relearn`` writes the bags of trials in the world of task 1, from starts that
teach most, and relearns them in a process of its own, as a user would.
"""

import argparse
from pathlib import Path
import subprocess
import sys
import tempfile
import time

import numpy as np
from rclpy.serialization import serialize_message

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import Demonstration, Trial
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.commands.learn import digest
from experience_cli.demo.path_follower import cells_along
from experience_cli.demo.show_and_try import WAY
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import (
    cloud_from_decisions, cloud_from_field, cloud_from_prototypes)
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node.environment import child_environment, prepare
from world_maps.world import find_world, load_world

#: Seconds a cell, and odometry messages in one.
STEP, TICKS = 1.25, 12
TASK = 'task1'


def write_bags(root: Path, n_trials: int) -> str:
    """Teach, try so often, record it all; return the digest of the field in the end."""
    parameters = Parameters()
    world = load_world(find_world(TASK))
    truth, grid = GridWorld(world.occupancy, parameters), Grid(20, 20, 0.25)
    learner, recorder = Learner(grid, parameters), Recorder(TaskFolder(root, TASK), grid)
    learner.add_demonstration(recorder.demonstration(GridWorld(
        np.zeros_like(world.occupancy), parameters)))
    rng = np.random.default_rng(0)
    reachable = np.isfinite(truth.cost_to(WAY[-1]))
    for number in range(2, n_trials + 2):
        field = learner.trial_field(exploring=True)
        start = next(cell for cell in learner.next_starts(400, rng, field) if reachable[cell])
        trial, _ = truth.trial(field, start, number, number)
        recorder.trial(trial, learner, truth)
        learner.add_trial(trial)
    return digest(learner.trial_field(exploring=False))


class Recorder:
    """Writes bags as the learner node would have."""

    def __init__(self, task: TaskFolder, grid: Grid) -> None:
        self._task, self._grid = task, grid

    def demonstration(self, world: GridWorld) -> Demonstration:
        """Record the way that is shown."""
        cells = cells_along(WAY)
        with self._start(EpisodeKind.DEMO) as bag:
            self._drive(bag, np.array(cells), world)
        stamps = STEP * np.arange(len(cells), dtype=np.float64)
        return Demonstration(np.array(cells, dtype=np.int32), stamps, np.array(
            [world.local_grid(*cell) for cell in cells], dtype=np.uint8),
            np.zeros(len(cells), dtype=np.uint8), 1)

    def trial(self, trial: Trial, learner: Learner, world: GridWorld) -> None:
        """Record a trial with all that a bag of one holds."""
        rows, refresh = trial.decisions.copy(), learner.refresh
        # Each is made when the robot of `_drive` is in its cell, else nothing would be learnt.
        rows['stamp'] = STEP * np.arange(len(rows))
        assert refresh is not None
        number = int(rows['trial'][0])
        with self._start(EpisodeKind.TRIAL) as bag:
            self._write(bag, 'control_field', cloud_from_field(learner.trial_field(True)), 0.0)
            self._write(bag, 'prototypes', cloud_from_prototypes(
                refresh.prototypes, self._grid), 0.0)
            self._write(bag, 'trial', status_from_trial(TrialStatus(
                State.RUNNING, number, revision=refresh.field.revision)), 0.0)
            for place in range(len(rows)):
                self._write(bag, 'experience', cloud_from_decisions(
                    rows[place:place + 1], self._grid), float(rows['stamp'][place]))
            moved = rows[rows['next_row'] >= 0]
            self._drive(bag, np.stack([moved['row'], moved['col']], axis=1), world)
            self._write(bag, 'trial', status_from_trial(TrialStatus(
                State.ENDED, number, trial.outcome, decisions=len(rows),
                revision=refresh.field.revision)), len(rows) * STEP)

    def _start(self, kind: EpisodeKind) -> BagWriter:
        return start_bag(self._task, kind, EpisodeHeader(
            kind, self._task.task, self._grid).to_mapping())

    def _drive(self, bag: BagWriter, cells: np.ndarray, world: GridWorld) -> None:
        for step, (row, col) in enumerate(cells.tolist()):
            local_grid = np.zeros((3, 3), dtype=np.int8)
            for d_row in (-1, 0, 1):
                for d_col in (-1, 0, 1):
                    near = row + d_row, col + d_col
                    inside = 0 <= near[0] < self._grid.n_rows and 0 <= near[1] < self._grid.n_cols
                    blocked = not inside or world.truth[near] != 0
                    local_grid[d_row + 1, d_col + 1] = 100 if blocked else 0
            x, y = self._grid.world_from_cell(row, col)
            for tick in range(TICKS):
                stamp = (step + tick / TICKS) * STEP
                self._write(bag, 'odom', odometry_from_pose(Pose(stamp, x, y, 0.0)), stamp)
                self._write(bag, 'neighbourhood', grid_from_neighbourhood(
                    Neighbourhood(stamp, row, col, local_grid), self._grid), stamp)

    @staticmethod
    def _write(bag: BagWriter, topic: str, message: object, stamp: float) -> None:
        package, _, module = type(message).__module__.partition('.msg')
        assert module
        bag.write(f'/{topic}', f'{package}/msg/{type(message).__name__}',
                  serialize_message(message), round(stamp * 1e9))


def main() -> int:
    """Measure, print; return 1 if the field is not the one the trials were learnt to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--trials', type=int, default=1000, metavar='N')
    parser.add_argument('--folder', type=Path, help='keep the bags here')
    arguments = parser.parse_args()
    prepare()
    with tempfile.TemporaryDirectory() as temporary:
        root = arguments.folder or Path(temporary)
        expected = write_bags(root, arguments.trials)
        size = sum(file.stat().st_size for file in root.rglob('*.mcap'))
        began = time.perf_counter()
        learnt = subprocess.run(
            [sys.executable, '-m', 'experience_cli.main', 'learn', '--quiet', str(root / TASK)],
            env=child_environment(), capture_output=True, text=True, check=True).stdout
        took = time.perf_counter() - began
    print(f'{arguments.trials} trials, {size / 1e6:.0f} MB: relearnt in {took:.1f} s')
    return 0 if expected in learnt else 1


if __name__ == '__main__':
    raise SystemExit(main())
