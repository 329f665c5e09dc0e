"""The learner as a process: user errors, signals, a full disk."""

from itertools import pairwise
import shutil
import signal
import sys

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger

from bridge_helpers import content_of, demonstration_bag
from control_field.grid import Grid
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.errors import mcap_path
from episode_store.task_folder import EpisodeKind, TaskFolder
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import call, collect, node_command, Process, REPEAT, start_node, wait_until

LEARNER = 'learner_node.node'


def start(tmp_path, **parameters):
    return start_node(LEARNER, tmp_path, {'bags': str(tmp_path / 'bags'), **parameters})


def empty_bag(tmp_path, **header):
    """Write a bag with nothing but a header into the task `task`."""
    header = {'kind': EpisodeKind.TRIAL, 'task': 'task', 'grid': Grid(20, 20, 0.25),
              'parameters': Parameters(), **header}
    start_bag(TaskFolder(tmp_path / 'bags', 'task'), header['kind'],
              EpisodeHeader(**header).to_mapping()).close()


class Robot:
    """Publishes odometry when it is told to."""

    def __init__(self, node):
        self.node = node
        self.publisher = node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
        self.stamp = 0.0

    def drive(self, x):
        self.stamp += 0.1
        self.publisher.publish(odometry_from_pose(Pose(self.stamp, x, 0.875, 0.0)))
        return True

    def meet(self, process):
        """Publish until the learner has heard it and begins to record."""
        def is_recording():
            self.drive(0.6)
            return call(self.node, SetBool, 'learner_node/record_demonstration',
                        SetBool.Request(data=True), again=REPEAT).success
        wait_until(is_recording, node=self.node, processes=[process], what='a recording')

    def cross(self, process, bag, until):
        """Drive along x until something is so."""
        def is_done():
            self.drive(0.6 + (self.stamp * 0.05) % 3.0)
            return until()
        wait_until(is_done, node=self.node, processes=[process], what='the end of the drive')


@pytest.mark.parametrize(('parameters', 'words'), [
    ({'task': '../elsewhere'}, ['task', "'../elsewhere'", 'letters']),
    ({'rows': 0}, ['rows', '1', '2000']),
    ({'resolution': -1.0}, ['resolution', '0.01']),
    ({'power': 99.0}, ['power', '0.5', '16']),
    ({'starts': 'anywhere'}, ['starts', 'anywhere', 'fixed, spread']),
    ({'start_poses': [1.0, 2.0]}, ['start_poses', '2 numbers']),
    ({'start_poses': [9.0, 1.0, 0.0]}, ['start_poses', '(9, 1)', 'outside']),
    ({'start_poses': ['a']}, ['start_poses']),
    ({'auto_start': True}, ['auto_start', 'simulation']),
])
def test_a_wrong_parameter_is_one_line_and_exit_code_2(quiet_domain, tmp_path, parameters, words):
    with start(tmp_path, **parameters) as process:
        assert process.wait() == 2, process.report()
    assert len(process.stderr.splitlines()) == 1
    for word in words:
        assert word in process.stderr


def test_a_bags_folder_that_cannot_be_made_is_said(quiet_domain, tmp_path):
    (tmp_path / 'file').touch()
    with start(tmp_path, bags=str(tmp_path / 'file')) as process:
        assert process.wait() == 2, process.report()
    assert 'cannot record into' in process.stderr
    assert len(process.stderr.splitlines()) == 1


def test_what_is_refused_of_one_topic_does_not_hide_another(ros_domain, ros_node, tmp_path):
    bad = ros_node.create_publisher(PointCloud2, 'experience', qos.EXPERIENCE)
    worse = ros_node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
    with start(tmp_path) as process:
        def wait_for(refusal):
            wait_until(lambda: bad.publish(PointCloud2()) or refusal in process.report(),
                       node=ros_node, processes=[process], what=refusal)
        wait_for('refused: experience: ')
        worse.publish(DiagnosticStatus())
        wait_for('refused: trial: ')


@pytest.mark.parametrize(('header', 'words'), [
    ({'grid': Grid(10, 12, 0.5)}, ['10 x 12 cells of 0.5 m', '20 x 20 cells of 0.25 m']),
    ({'grid': Grid(20, 20, 0.25, frame_id='map')}, ["'map'", "'odom'"]),
])
def test_bags_of_another_workspace_are_refused(quiet_domain, tmp_path, header, words):
    empty_bag(tmp_path, **header)
    with start(tmp_path) as process:
        assert process.wait() == 2, process.report()
    for word in [*words, '0001_trial']:
        assert word in process.stderr.splitlines()[-1]


def test_fresh_sets_the_bags_aside(quiet_domain, tmp_path):
    empty_bag(tmp_path, grid=Grid(10, 12, 0.5))
    with start(tmp_path, fresh=True) as process:
        wait_until(lambda: 'task/0001 is set aside' in process.stderr + process.stdout,
                   processes=[process], what='a line')
    assert (tmp_path / 'bags' / 'task' / '.forgotten' / '0001_trial').is_dir()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(ros_domain, ros_node, tmp_path, number):
    with start(tmp_path) as process:
        client = ros_node.create_client(Trigger, 'learner_node/run_trials')
        wait_until(client.service_is_ready, node=ros_node, processes=[process])
        process.stop(number)
    assert [line for line in process.stderr.splitlines() if '[INFO]' not in line] == []


def test_at_the_start_it_says_what_to_do_next(quiet_domain, tmp_path):
    with start(tmp_path) as process:
        wait_until(lambda: '~/record_demonstration' in process.stderr, processes=[process])
        [line] = [line for line in process.stderr.splitlines() if 'teleop_node' in line]
    assert f"task task in {(tmp_path / 'bags' / 'task').resolve()}: nothing was learnt" in line


def test_what_cannot_be_done_is_refused_with_a_reason(ros_domain, ros_node, tmp_path):
    with start(tmp_path, simulation=True) as process:
        answers = {}
        for name in ('run_trials', 'stop_trials', 'discard_demonstration'):
            answers[name] = call(ros_node, Trigger, f'learner_node/{name}', again=REPEAT)
        answers['keep'] = call(ros_node, SetBool, 'learner_node/record_demonstration',
                               SetBool.Request(data=False), again=REPEAT)
        assert process.running
    assert not any(answer.success for answer in answers.values())
    assert all(answer.message for answer in answers.values())


def test_a_signal_during_a_demonstration_closes_the_bag(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        task = TaskFolder(tmp_path / 'bags', 'task')
        robot.cross(process, task, lambda: robot.stamp > 5.0)
        process.stop()
    assert 'a demonstration is recorded: broken off, the learner was stopped' in process.stderr
    [episode] = task.episodes()
    assert Episode(episode).is_closed
    with pytest.raises(NothingToLearnError, match='not kept'):
        content_of(episode.path)


@pytest.mark.parametrize('durability', ['VOLATILE', 'TRANSIENT_LOCAL'])
@pytest.mark.parametrize('reliability', ['RELIABLE', 'BEST_EFFORT'])
def test_a_bumper_is_recorded_however_it_publishes(
        ros_domain, ros_node, tmp_path, reliability, durability):
    bumper = ros_node.create_publisher(Bool, 'contact', QoSProfile(
        depth=10, reliability=ReliabilityPolicy[reliability],
        durability=DurabilityPolicy[durability]))
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        task = TaskFolder(tmp_path / 'bags', 'task')

        def touches():
            bumper.publish(Bool(data=robot.stamp > 1.0))
            return robot.stamp > 3.0

        robot.cross(process, task, touches)
        process.stop()
    [episode] = task.episodes()
    said = [cdr[4] for cdr in Episode(episode).messages('contact')]
    assert said[-1] == 1
    assert all(a != b for a, b in pairwise(said)), said


def test_a_kept_demonstration_is_answered_with_what_it_taught(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.cross(process, None, lambda: robot.stamp > 30.0)
        answer = call(ros_node, SetBool, 'learner_node/record_demonstration',
                      SetBool.Request(data=False))
        assert process.running
    assert answer.success, answer.message
    assert answer.message.startswith('Drive 0001 kept: ')
    assert 'gets to the goal' in answer.message
    assert 'cells from' not in answer.message
    assert 'in numbers: ' in process.stderr


def test_a_demonstration_can_be_labelled_and_dropped(ros_domain, ros_node, tmp_path):
    def ask(name):
        return call(ros_node, Trigger, f'learner_node/{name}')

    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        assert not ask('drop_last').success  # a demonstration is recorded
        robot.cross(process, None, lambda: robot.stamp > 30.0)
        kept = call(ros_node, SetBool, 'learner_node/record_demonstration',
                    SetBool.Request(data=False))
        assert kept.success, kept.message
        failure, success, dropped = map(ask, ('label_failure', 'label_success', 'drop_last'))
        again = ask('drop_last')
        assert process.running
        fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
        wait_until(lambda: fields, node=ros_node, what='a field')
    assert field_from_cloud(fields[-1]).is_void
    assert 'Nothing is left' in failure.message
    assert 'gets to the goal' in success.message
    assert dropped.success
    assert not again.success
    assert 'no bag' in again.message
    assert not TaskFolder(tmp_path / 'bags', 'task').episodes()


def test_without_bags_there_is_no_field(ros_domain, ros_node, tmp_path):
    fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
    with start(tmp_path, rows=7) as process:
        wait_until(lambda: fields, node=ros_node, processes=[process], what='a field')
    [field] = map(field_from_cloud, fields)
    assert field.is_void
    assert (field.revision, field.grid.n_rows) == (0, 7)


def test_a_drop_during_a_keep_leaves_no_request_without_an_answer(
    ros_domain, ros_node, tmp_path,
):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.cross(process, None, lambda: robot.stamp > 30.0)
        keeps = ros_node.create_client(SetBool, 'learner_node/record_demonstration')
        drops = ros_node.create_client(Trigger, 'learner_node/drop_last')
        wait_until(lambda: keeps.service_is_ready() and drops.service_is_ready(), node=ros_node)
        keep = keeps.call_async(SetBool.Request(data=False))
        drop = drops.call_async(Trigger.Request())
        wait_until(lambda: keep.done() and drop.done(), node=ros_node, processes=[process],
                   what='both answers')
    assert keep.result().success, keep.result().message
    assert drop.result().message


def test_a_demonstration_in_another_frame_is_not_even_begun(ros_domain, ros_node, tmp_path):
    with start(tmp_path, frame_id='r2/odom') as process:
        robot, answers = Robot(ros_node), []

        def is_heard():
            robot.drive(0.6)
            answers.append(call(ros_node, SetBool, 'learner_node/record_demonstration',
                                SetBool.Request(data=True), again=REPEAT))
            return 'no odometry' not in answers[-1].message

        wait_until(is_heard, node=ros_node, processes=[process], what='an odometry')
    assert not answers[-1].success
    assert "must be 'r2/odom'" in answers[-1].message
    assert answers[-1].message.endswith('start learner_node with frame_id:=odom')
    assert not list((tmp_path / 'bags' / 'task').glob('0*'))


def test_a_drive_that_teaches_nothing_is_said(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        answer = call(ros_node, SetBool, 'learner_node/record_demonstration',
                      SetBool.Request(data=False))
        assert process.running
    assert not answer.success
    assert 'Drive 0001 is not learnt' in answer.message


def test_a_drive_that_ends_where_it_began_is_said_and_the_task_goes_on(
    ros_domain, ros_node, tmp_path,
):
    for _ in range(2):  # the second learner finds the bag of the first one
        with start(tmp_path) as process:
            robot = Robot(ros_node)
            robot.meet(process)
            robot.cross(process, None, lambda robot=robot: robot.stamp > 30.0)
            wait_until(lambda robot=robot: robot.drive(max(
                0.6, 2.1 - 0.5 * (robot.stamp - 30.0))) and robot.stamp > 35.0, node=ros_node)
            answer = call(ros_node, SetBool, 'learner_node/record_demonstration',
                          SetBool.Request(data=False))
            assert process.running
        assert not answer.success
        assert 'ends in the cell where it began' in answer.message
        assert 'Traceback' not in process.stderr
    assert len(TaskFolder(tmp_path / 'bags', 'task').episodes()) == 2


def test_a_drive_that_leaps_is_refused_where_it_is_kept_and_after_a_restart(
    ros_domain, ros_node, tmp_path,
):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.cross(process, None, lambda: robot.stamp > 20.0)
        wait_until(lambda: robot.drive(4.4 + 0.01 * (robot.stamp - 20.0)) and robot.stamp > 30.0,
                   node=ros_node)
        answer = call(ros_node, SetBool, 'learner_node/record_demonstration',
                      SetBool.Request(data=False))
    assert not answer.success
    assert answer.message.startswith('Drive 0001 is not learnt: this is not one drive of')
    assert 'the pose leaps by' in answer.message
    assert '[WARN]' in next(
        line for line in process.stderr.splitlines() if 'Drive 0001 is not learnt' in line)
    with start(tmp_path) as process:
        wait_until(lambda: 'the pose leaps by' in process.stderr, processes=[process],
                   what='the same sentence')


def test_a_change_that_cannot_be_relearnt_publishes_nothing(ros_domain, ros_node, tmp_path):
    bags = [demonstration_bag(tmp_path / 'bags', n) for n in (200, 250)]
    fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
    with start(tmp_path, task='task1') as process:
        wait_until(lambda: fields, node=ros_node, processes=[process], what='a field')
        mcap_path(bags[0]).write_bytes(b'no bag at all')
        answer = call(ros_node, Trigger, 'learner_node/drop_last')
        assert not answer.success
        assert answer.message.startswith('task1/0002 is dropped')
        assert 'but the control field stays as it was' in answer.message
        again = call(ros_node, Trigger, 'learner_node/run_trials')  # it is idle again
        assert 'simulation is false' in again.message
        assert not call(ros_node, Trigger, 'learner_node/label_failure').success
    assert len(fields) == 1
    assert not field_from_cloud(fields[-1]).is_void


def test_the_start_poses_are_fixed(ros_domain, ros_node, tmp_path):
    with start(tmp_path, start_poses=[1.0, 1.0, 0.0]):
        answer = call(ros_node, SetParameters, 'learner_node/set_parameters',
                      SetParameters.Request(parameters=[
                          Parameter('start_poses', value=[2.0, 2.0, 0.0]).to_parameter_msg()]))
    [result] = answer.results
    assert not result.successful
    assert 'read-only' in result.reason


def test_a_full_disk_is_one_line_and_keeps_what_was_recorded(ros_domain, ros_node, tmp_path):
    parameters = {'bags': str(tmp_path / 'bags')}
    command = node_command(LEARNER, tmp_path, parameters)
    # No file of this process may be greater than this; the error is the same as of a full disk.
    limited = ('import resource, os, sys; '
               'resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)); '
               'os.execv(sys.argv[1], sys.argv[1:])')
    with Process([sys.executable, '-c', limited, *command], tmp_path, name='learner') as process:
        robot, stops = Robot(ros_node), []
        ros_node.create_service(Trigger, 'control_field_node/stop_trial',
                                lambda _, response: stops.append(1) or response)
        robot.meet(process)

        def said():
            return [line for line in (process.stderr + process.stdout).splitlines()
                    if 'cannot record' in line]

        robot.cross(process, None, said)
        wait_until(lambda: robot.drive(1.0) and robot.stamp > 20.0, node=ros_node)
        assert len(said()) == 1
        answer = call(ros_node, SetBool, 'learner_node/record_demonstration',
                      SetBool.Request(data=False))
        assert not answer.success
        assert 'cannot record' in answer.message
        wait_until(lambda: stops, node=ros_node, what='the request to stop the robot')
        assert process.running
    [episode] = TaskFolder(tmp_path / 'bags', 'task').episodes()
    assert episode.bag.stat().st_size > 50_000


@pytest.mark.parametrize('is_removed', [True, False])
def test_bags_that_are_taken_away_are_said_at_once_and_not_called_kept(
    ros_domain, ros_node, tmp_path, is_removed,
):
    bags = tmp_path / 'bags'

    def said():
        return [line for line in (process.stderr + process.stdout).splitlines()
                if 'cannot record' in line]

    def ask(data):
        return call(ros_node, SetBool, 'learner_node/record_demonstration',
                    SetBool.Request(data=data))

    with start(tmp_path) as process:
        robot, stops = Robot(ros_node), []
        ros_node.create_service(Trigger, 'control_field_node/stop_trial',
                                lambda _, response: stops.append(1) or response)
        robot.meet(process)
        bags.rename(tmp_path / 'elsewhere')
        if is_removed:
            shutil.rmtree(tmp_path / 'elsewhere')
        robot.cross(process, None, said)
        wait_until(lambda: stops, node=ros_node, what='the request to stop the robot')
        [line] = said()
        assert 'removed or renamed while it was recorded' in line
        assert 'kept' not in line
        assert 'removed or renamed' in ask(False).message
        again = ask(True)
        assert not again.success
        assert 'restart the learner' in again.message
        assert process.running
    assert not bags.exists()
    assert 'Traceback' not in process.stderr
