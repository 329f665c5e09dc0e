"""Simulator, controller and learner as real processes in lock-step, taught by a real drive."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, ExitStack
from pathlib import Path

from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.task_folder import TaskFolder
from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.path_follower import Driver, points_from_cells
from experience_cli.demo.show_and_try import WAY
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import Process, start_node

COMMON = {'lockstep': True, 'enable_stamped_cmd_vel': True}
PARAMETERS = {
    'sim_node': {**COMMON, 'world': 'open', 'rate': 10.0},
    'control_field_node': COMMON,
    'learner_node': {**COMMON, 'simulation': True, 'task': 'task1', 'auto_trials': 2},
}
DEADLINE = 60.0


class Suite:
    """The three processes, and a node that talks to them."""

    def __init__(
        self, folder: Path, domain: int, stack: ExitStack, namespace: str = '',
        env: Mapping[str, str] | None = None, **learner,
    ):
        self.folder = folder
        self._options = {'namespace': f'/{namespace}' if namespace else None,
                         'env': {'ROS_DOMAIN_ID': str(domain), **(env or {})}}
        self.bags = folder / 'bags'
        self.task = TaskFolder(self.bags, 'task1')
        self.processes: dict[str, Process] = {}
        self._stack = stack
        self._learner = {'bags': str(self.bags), **learner}
        self.node = stack.enter_context(DemoNode(domain, self._check, namespace))
        self.fields: list[PointCloud2] = []
        self.node._node.create_subscription(
            PointCloud2, 'control_field', self.fields.append, qos.LATCHED)

    def start(self, *names: str, **changes):
        """Start nodes, all of them by default."""
        for name in names or tuple(PARAMETERS):
            parameters = {**PARAMETERS[name], **changes}
            if name == 'learner_node':
                parameters |= self._learner
            process = start_node(f'{name}.node', self.folder, parameters, **self._options)
            self.processes[name] = self._stack.enter_context(process)

    def kill(self, name: str):
        """End a node as a crash would."""
        self.processes.pop(name).kill()

    def _check(self):
        for process in self.processes.values():
            assert process.running, process.report()

    def wait(self, predicate, what: str, patience: float = DEADLINE):
        """Wait for something; a report of all processes goes with a failure."""
        try:
            return self.node.wait_until(predicate, what, patience)
        except Exception as error:
            raise AssertionError(f'{error}\n{self.report()}') from None

    def report(self) -> str:
        """Return what the processes said so far, for a failing test."""
        return '\n'.join(process.report() for process in self.processes.values())

    def demonstrate(self) -> str:
        """Drive the demonstration in the open world; return what the learner says of it."""
        self.node.wait_for_peers()
        self.node.ask('learner_node/record_demonstration', True)
        self.node.drive(Driver(points_from_cells(Grid(20, 20, 0.25), WAY)), lambda share: None)
        # Before it is kept: with `auto_start` the first trial begins right after that.
        self.node.set_parameter('sim_node', 'world', 'task1')
        return self.node.ask('learner_node/record_demonstration', False)

    def wait_for_revision(self, revision: int):
        """Wait until so many episodes were learnt from, and the last trial is done."""
        def is_done():
            learner = self.node.learner
            return (int(learner.get('revision', -1)) >= revision
                    and learner['phase'] == 'idle' and learner['trials_left'] == '0')

        self.wait(is_done, f'field revision {revision}')

    def wait_for_step(self, steps: int):
        """Wait until a trial is running and has come so far."""
        self.wait(lambda: self.has_come_to_step(steps), f'step {steps}')

    def has_come_to_step(self, steps: int) -> bool:
        """Return whether a trial is running and has come so far."""
        status = self.node.status
        return status is not None and status.trial > 0 and (
            status.outcome is None and status.steps >= steps)

    def newest_revision(self) -> int:
        """Return the revision of the newest field that has arrived here, -1 for none."""
        return field_from_cloud(self.fields[-1]).revision if self.fields else -1

    def live_bytes(self) -> bytes:
        """Return the bytes of the field that the learner has published last."""
        self.wait(lambda: self.fields, 'a field')
        return bytes(self.fields[-1].data)


@contextmanager
def running_suite(folder: Path, domain: int, **options) -> Iterator[Suite]:
    """Start the three processes, stop them at the end; `options` are those of `Suite`."""
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        suite = Suite(folder, domain, stack, **options)
        suite.start()
        yield suite


def relearnt(task):
    """Return what the bags of a task teach when they are read anew, in order."""
    relearner = Relearner.for_bags(task.episodes())
    assert relearner is not None
    for episode in task.episodes():
        relearner.learn(Episode(episode))
    return relearner
