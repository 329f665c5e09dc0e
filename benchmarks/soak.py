"""
An hour of simulated trials in lock-step in one go: ``python -m benchmarks.soak``.

The three nodes run as processes of their own; the demonstration is driven once, then trial
follows trial. Watched are the memory of each process, ticks a second of the wall clock, how long
an answer takes, and whether every decision that the controller has counted is in the bags.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass, field
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any, Final

import numpy as np

from control_field.grid import Grid
from control_field.records import Trial
from episode_store.episode import Episode
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.topic_tables import statuses
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.path_follower import Driver, points_from_cells
from experience_cli.demo.processes import Children, own_domain
from experience_cli.demo.show_and_try import WAY
from msgs_bridge.messages.poses import seconds_from_stamp

NODES: Final = ('sim_node', 'control_field_node', 'learner_node')
#: Share of the run that processes may take to reach their size.
_WARM_UP: Final = 0.2
_LOOK_PERIOD: Final = 1.0
_MAX_GROWTH: Final = 0.05
#: How much more than in the first quarter a tick may cost in the last one.
_MAX_COST: Final = 1.2
#: Ticks a second of simulated time.
_RATE: Final = 20.0


@dataclass
class Watch:
    """
    What was seen, once a second.

    Parameters
    ----------
    wall, simulated : list of float, [s]
    memory : dict of list of float, [MB]
        Resident memory of each process.
    work : dict of list of float, [s]
        Processor time that each process has used so far.

    """

    wall: list[float] = field(default_factory=list)
    simulated: list[float] = field(default_factory=list)
    memory: dict[str, list[float]] = field(default_factory=dict)
    work: dict[str, list[float]] = field(default_factory=dict)

    def look(self, pids: dict[str, int], simulated: float) -> None:
        """Look once."""
        self.wall.append(time.monotonic())
        self.simulated.append(simulated)
        for name, pid in pids.items():
            self.memory.setdefault(name, []).append(resident(pid))
            self.work.setdefault(name, []).append(processor_time(pid))

    def speed(self, part: slice) -> float:
        """Return ticks a second of the wall clock in a part of the run."""
        wall = self.wall[part]
        return self.ticks(part) / (wall[-1] - wall[0])

    def ticks(self, part: slice) -> float:
        """Return how many ticks there were in a part of the run."""
        simulated = self.simulated[part]
        return _RATE * (simulated[-1] - simulated[0])

    def cost(self, name: str, part: slice) -> float:
        """Return the processor time of a process for a tick, [ms], whatever else runs."""
        work = self.work[name][part]
        return 1000.0 * (work[-1] - work[0]) / self.ticks(part)

    def growth(self, name: str) -> float:
        """Return by which share a process has grown since it was warm."""
        warm = self.memory[name][int(_WARM_UP * len(self.memory[name])):]
        tenth = max(len(warm) // 10, 1)
        return float(np.median(warm[-tenth:]) / np.median(warm[:tenth]) - 1.0)


def resident(pid: int) -> float:
    """Return the resident memory of a process, [MB]."""
    for line in Path(f'/proc/{pid}/status').read_text().splitlines():
        if line.startswith('VmRSS'):
            return int(line.split()[1]) / 1024
    raise ProcessLookupError(pid)


def processor_time(pid: int) -> float:
    """Return the processor time that a process has used, [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


@contextmanager
def running(folder: Path, n_trials: int) -> Iterator[tuple[Children, DemoNode]]:
    """Start the three nodes on a domain of their own, and a node that talks to them."""
    common = {'lockstep': True, 'enable_stamped_cmd_vel': True}
    parameters: dict[str, dict[str, object]] = {
        'sim_node': {**common, 'world': 'open'}, 'control_field_node': dict(common),
        'learner_node': {**common, 'simulation': True, 'task': 'task1', 'starts': 'spread',
                         'auto_trials': n_trials, 'bags': str(folder / 'bags')}}
    with own_domain() as environment, Children(folder, environment) as children:
        for name in NODES:
            children.start_node(name, parameters[name])
        domain = environment.get('ROS_DOMAIN_ID')
        with DemoNode(int(domain) if domain else None, children.check) as node:
            yield children, node


def teach(node: DemoNode) -> None:
    """Drive the demonstration, put the obstacles there, and let the trials begin."""
    node.wait_for_peers()
    node.ask('learner_node/record_demonstration', True)
    node.drive(Driver(points_from_cells(Grid(20, 20, 0.25), WAY)), lambda share: None)
    node.ask('learner_node/record_demonstration', False)
    node.set_parameter('sim_node', 'world', 'task1')
    node.ask('learner_node/run_trials')


def soak(folder: Path, seconds: float) -> Watch:
    """Run trials until so much simulated time has passed, and finish the one under way."""
    with running(folder, 1_000_000) as (children, node):
        teach(node)
        watch, first = Watch(), _simulated(node)

        def is_over() -> bool:
            if not watch.wall or time.monotonic() - watch.wall[-1] >= _LOOK_PERIOD:
                watch.look(children.pids, _simulated(node) - first)
                print(f'\r{watch.simulated[-1]:6.0f} of {seconds:.0f} s simulated', end='',
                      file=sys.stderr, flush=True)
            return watch.simulated[-1] >= seconds

        node.wait_until(is_over, 'the end of the hour', patience=10 * seconds)
        node.ask('learner_node/stop_trials')
        node.wait_until(lambda: node.learner.get('phase') == 'idle', 'the end of the last trial')
    print(file=sys.stderr)
    return watch


def _simulated(node: DemoNode) -> float:
    odometry: Any = node.odometry
    return seconds_from_stamp(odometry.header.stamp)


def count_decisions(task: TaskFolder) -> tuple[int, int, int, Counter[str]]:
    """Return trials, decisions that the controller has counted, those in the bags, outcomes."""
    counted = recorded = 0
    outcomes: Counter[str] = Counter()
    trials = [episode for episode in task.episodes() if episode.kind is EpisodeKind.TRIAL]
    for episode in trials:
        said = [status for _, status in statuses(BagReader(episode.bag).messages('/trial'))]
        record = Episode.at(episode.path).content.record
        assert isinstance(record, Trial)
        counted += max(status.decisions for status in said if status.trial == said[0].trial)
        recorded += len(record.decisions)
        outcomes[str(record.outcome)] += 1
    return len(trials), counted, recorded, outcomes


def report(watch: Watch, task: TaskFolder) -> bool:
    """Print what was measured; tell whether all of it is as it should be."""
    n_trials, counted, recorded, outcomes = count_decisions(task)
    quarter = len(watch.wall) // 4
    first, last = slice(None, quarter), slice(-quarter, None)
    print(f'simulated {watch.simulated[-1]:.0f} s in {watch.wall[-1] - watch.wall[0]:.0f} s, '
          f'{n_trials} trials: {dict(outcomes)}')
    print(f'decisions: {counted} counted by the controller, {recorded} in the bags')
    print(f'ticks a second: {watch.speed(first):.0f} in the first quarter, '
          f'{watch.speed(last):.0f} in the last')
    good = counted == recorded
    for name in NODES:
        growth, before, after = watch.growth(name), *(
            watch.cost(name, part) for part in (first, last))
        good = good and growth < _MAX_GROWTH and after < _MAX_COST * before
        print(f'{name:20} {watch.memory[name][-1]:6.1f} MB at the end, {growth:+.1%} since it '
              f'was warm; {before:.2f} ms of processor a tick, then {after:.2f}')
    return good


def main() -> int:
    """Soak; return 1 if something grew or is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=3600.0, help='simulated (%(default)s)')
    parser.add_argument('--keep', type=Path, metavar='FOLDER', help='keep bags and logs there')
    arguments = parser.parse_args()
    with ExitStack() as stack:
        folder = arguments.keep or Path(stack.enter_context(
            tempfile.TemporaryDirectory(prefix='soak_')))
        folder.mkdir(parents=True, exist_ok=True)
        watch = soak(folder, arguments.seconds)
        return 0 if report(watch, TaskFolder(folder / 'bags', 'task1')) else 1


if __name__ == '__main__':
    sys.exit(main())
