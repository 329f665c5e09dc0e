"""Another task for a learner that runs: when it may be, what of it holds, and whose bags are."""

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2

from bridge_helpers import demonstration_bag
from episode_store.episode import Episode
from episode_store.lock import is_in_use
from episode_store.rosbag2.errors import mcap_path
from episode_store.task_folder import TaskFolder
from learner_helpers import Robot, start
from learner_node.session.phases import Phase
from msgs_bridge.messages.memory_identity import task_of
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import call, collect, wait_until
from session_helpers import HERE, running


class Learner:
    """A learner as a process, its fields, what it says of itself, and its parameters."""

    def __init__(self, node, process, bags):
        self.node, self.process, self.bags = node, process, bags
        self.fields = collect(node, PointCloud2, 'control_field', qos.LATCHED)
        self.told = collect(node, DiagnosticArray, '/diagnostics', 10)

    def wait(self, predicate, what):
        return wait_until(predicate, node=self.node, processes=[self.process], what=what)

    @property
    def status(self):
        """What it said of itself last, as a mapping."""
        found = [status for array in self.told for status in array.status
                 if status.name.endswith(': learner')]
        return {each.key: each.value for each in found[-1].values} if found else {}

    @property
    def field(self):
        return field_from_cloud(self.fields[-1]) if self.fields else None

    def set(self, **values):
        """Set parameters; return why that is refused, empty if it is not."""
        request = SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])
        result = call(self.node, SetParametersAtomically,
                      'learner_node/set_parameters_atomically', request).result
        return '' if result.successful else result.reason

    @property
    def parameter(self):
        return call(self.node, GetParameters, 'learner_node/get_parameters',
                    GetParameters.Request(names=['task'])).values[0].string_value

    def is_at(self, task):
        return self.status.get('task') == task and self.status['phase'] == Phase.IDLE


def test_it_goes_from_task_to_task_and_each_bag_is_where_it_belongs(
        ros_domain, ros_node, tmp_path):
    bags = tmp_path / 'bags'
    demonstration_bag(bags)
    mcap_path(demonstration_bag(bags / 'x')).write_bytes(b'no bag at all')
    (bags / 'x' / 'task1').rename(bags / 'kitchen')
    robot = Robot(ros_node)
    with start(tmp_path) as process:
        learner = Learner(ros_node, process, bags)
        learner.wait(lambda: learner.field is not None and learner.is_at('task'), 'the start')
        for name in ('../hall', '', 'a' * 65, 7):
            assert 'letters' in learner.set(task=name)
        assert learner.parameter == 'task'

        assert not learner.set(task='task1')
        learner.wait(lambda: learner.is_at('task1') and not learner.field.is_void, 'task1')
        assert task_of(learner.field.memory) == 'task1'
        assert not (bags / 'task').exists()  # nothing came into it
        assert is_in_use(bags / 'task1')
        assert 'new_task:=true' in learner.set(task='kitchn')

        assert not learner.set(task='kitchen')  # its bag cannot be read: that is found later
        learner.wait(lambda: 'the task stays task1' in process.stderr, 'the sentence')
        learner.wait(lambda: learner.parameter == 'task1', 'the parameter')
        learner.wait(lambda: learner.is_at('task1'), 'the old task')
        assert not is_in_use(bags / 'kitchen')

        assert not learner.set(task='kitchn', new_task=True)
        learner.wait(lambda: learner.is_at('kitchn') and learner.field.is_void, 'a void field')
        assert learner.status['episode'] == '0'
        robot.meet(process)
        assert 'a demonstration is recorded' in learner.set(task='task1')
        [episode] = TaskFolder(bags, 'kitchn').episodes()
        header = Episode(episode).header
        assert (header.task, header.fitted) == ('kitchn', True)
        assert len(TaskFolder(bags, 'task1').episodes()) == 1
        assert not is_in_use(bags / 'task1')


def test_a_folder_that_another_process_holds_is_refused(ros_domain, ros_node, tmp_path):
    taken = TaskFolder(tmp_path / 'bags', 'hall')
    taken.hold()
    with start(tmp_path) as process:
        learner = Learner(ros_node, process, tmp_path / 'bags')
        learner.wait(lambda: learner.is_at('task'), 'the start')
        assert 'in use' in learner.set(task='hall')
        taken.release()
        assert not taken.path.exists()
        assert not learner.set(task='hall')


class TestSession:
    def test_a_trial_that_runs_keeps_the_task(self, play):
        play('on_status', running())
        for _ in range(2):
            with pytest.raises(ValueError, match='cannot begin another task now'):
                play.session.check_between('begin another task', 'change')
            play.session.state.phase = Phase.IDLE  # nor one that is not recorded

    def test_one_that_began_on_the_field_before_is_not_recorded(self, play):
        play('begin')
        play('on_status', running())
        play.session.on_other_task()
        play('on_learnt', 1)
        assert play.phase is Phase.IDLE

    def test_between_trials_it_may_change(self, play):
        play('on_pose', *HERE)
        play.session.check_between('begin another task', 'change')
