"""
Record the sample bags in ``bags/sample`` anew, on the real nodes.

``python -m tools.record_sample_bags`` teaches a short way in the open workspace and lets the robot
try it twice in the world of task 1: for when the format of the bags has changed on purpose. With
``--digest-only`` the bags stay, and what they teach is written down anew: for when the learner has
changed on purpose.
"""

import argparse
import hashlib
from pathlib import Path
import shutil
import tempfile
from typing import Final

from control_field.grid import Grid
from episode_store.relearn import relearnt
from episode_store.task_folder import TaskFolder, tasks
from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.path_follower import Driver, points_from_cells
from experience_cli.demo.processes import Children, own_domain
from msgs_bridge.messages.tables import cloud_from_field

TASK: Final = 'sample'
#: The way that is shown, as cells (row, col), and how often the robot tries it.
WAY: Final = ((3, 4), (3, 13), (9, 13))
TRIALS: Final = 2
#: Ticks a second; a low rate keeps the bags small.
RATE: Final = 10.0
_GRID: Final = Grid(20, 20, 0.25)
_BAGS: Final = Path(__file__).resolve().parent.parent / 'bags'
#: Holds the SHA-256 of the bytes of the field that the samples teach.
DIGEST: Final = _BAGS / 'sample.sha256'


def node_parameters(bags: Path) -> dict[str, dict[str, object]]:
    """Return the parameters of the three nodes."""
    x, y = _GRID.world_from_cell(*WAY[0])
    common: dict[str, object] = {'lockstep': True, 'enable_stamped_cmd_vel': True}
    return {
        'sim_node': {**common, 'world': 'open', 'rate': RATE, 'start_x': x, 'start_y': y},
        'control_field_node': common,
        'learner_node': {**common, 'simulation': True, 'task': TASK, 'bags': str(bags),
                         'auto_trials': TRIALS}}


def record(bags: Path, logs: Path) -> None:
    """Teach and try; the bags go into the folder of the task in ``bags``."""
    with own_domain() as environment, Children(logs, environment) as children:
        for name, parameters in node_parameters(bags).items():
            children.start_node(name, parameters)
        domain = environment.get('ROS_DOMAIN_ID')
        with DemoNode(int(domain) if domain else None, children.check) as node:
            node.wait_for_peers()
            node.ask('learner_node/record_demonstration', True)
            node.drive(Driver(points_from_cells(_GRID, WAY)), lambda share: None)
            print(node.ask('learner_node/record_demonstration', False))
            node.set_parameter('sim_node', 'world', 'task1')
            node.ask('learner_node/run_trials')
            node.wait_until(
                lambda: int(node.learner.get('revision', 0)) > TRIALS
                and node.learner.get('phase') == 'idle', 'the end of the trials')


def digest_of(task: TaskFolder) -> str:
    """Return the SHA-256 of the bytes of the field that a task's bags teach."""
    refresh = relearnt(task)
    if refresh is None:
        raise ValueError(f'{task.path} holds no demonstration')
    return hashlib.sha256(bytes(cloud_from_field(refresh.field).data)).hexdigest()


def renew_bags() -> None:
    """Record into a folder of its own, then let it take the old samples' place."""
    with tempfile.TemporaryDirectory() as folder:
        logs, bags = Path(folder) / 'logs', Path(folder) / 'bags'
        logs.mkdir()
        record(bags, logs)
        if tasks(bags) != [TASK]:
            raise ValueError(f'nothing was recorded, see {logs}')
        # Beside the old ones, so that there are never half of the new ones.
        new = _BAGS / f'.{TASK}-new'
        shutil.rmtree(new, ignore_errors=True)
        shutil.copytree(bags / TASK, new, ignore=shutil.ignore_patterns('.*'))
        shutil.rmtree(_BAGS / TASK, ignore_errors=True)
        new.rename(_BAGS / TASK)


def main() -> int:
    """Renew the samples, or only what they teach."""
    parser = argparse.ArgumentParser(description='record the sample bags anew')
    parser.add_argument('--digest-only', action='store_true',
                        help='keep the bags, write down what they teach now')
    if not parser.parse_args().digest_only:
        renew_bags()
    task = TaskFolder(_BAGS, TASK)
    DIGEST.write_text(digest_of(task) + '\n')
    for episode in task.episodes():
        print(f'{episode.path}: {episode.bag.stat().st_size} bytes')
    print(f'{DIGEST}: {DIGEST.read_text().strip()}')
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
