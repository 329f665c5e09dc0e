"""The learner as a process: user errors, signals, other bags."""

import signal

from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

from bridge_helpers import demonstration_bag
from control_field.grid import Grid
from control_field.parameters import Parameters
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.errors import mcap_path
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_helpers import start
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import call, collect, REPEAT, wait_until


def empty_bag(tmp_path, **header):
    """Write a bag with nothing but a header into the task `task`."""
    header = {'kind': EpisodeKind.TRIAL, 'task': 'task', 'grid': Grid(20, 20, 0.25),
              'parameters': Parameters(), **header}
    start_bag(TaskFolder(tmp_path / 'bags', 'task'), header['kind'],
              EpisodeHeader(**header).to_mapping()).close()


@pytest.mark.parametrize(('parameters', 'words'), [
    ({'task': '../elsewhere'}, ['task', "'../elsewhere'", 'letters']),
    ({'rows': 20}, ['rows', 'cols', 'leave both out']),
    ({'rows': 2001, 'cols': 2}, ['rows', '2000']),
    ({'origin_y': -1.0}, ['origin_y', 'leave the origin out']),
    ({'resolution': -1.0}, ['resolution', '0']),
    ({'resolution': 0.001}, ['resolution', '0.01', 'robot_radius']),
    ({'robot_radius': 0.0}, ['resolution', 'robot_radius']),
    ({'power': 99.0}, ['power', '0.5', '16']),
    ({'starts': 'anywhere'}, ['starts', 'anywhere', 'fixed, spread']),
    ({'start_poses': [1.0, 2.0]}, ['start_poses', '2 numbers']),
    ({'start_poses': [9.0, 1.0, 0.0], 'rows': 20, 'cols': 20},
     ['start_poses', '(9, 1)', 'outside']),
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
    with start(tmp_path, rows=20, cols=20) as process:
        assert process.wait() == 2, process.report()
    for word in [*words, '0001_trial']:
        assert word in process.stderr.splitlines()[-1]


@pytest.mark.parametrize(('parameters', 'words'), [
    ({'resolution': 0.3}, ['bags of cells of 0.25 m', 'resolution is 0.3 m', 'leave resolution']),
    ({'frame_id': 'map'}, ["frame is 'odom', must be 'map'", 'frame_id:=odom'])])
def test_bags_of_other_cells_than_are_set_are_refused(quiet_domain, tmp_path, parameters, words):
    demonstration_bag(tmp_path / 'bags', 200)
    with start(tmp_path, task='task1', **parameters) as process:
        assert process.wait() == 2, process.report()
    for word in [*words, 'bags/task1', 'begin another task']:
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


def test_without_bags_there_is_no_field(ros_domain, ros_node, tmp_path):
    fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
    with start(tmp_path, rows=7, cols=5) as process:
        wait_until(lambda: fields, node=ros_node, processes=[process], what='a field')
    [field] = map(field_from_cloud, fields)
    assert field.is_void
    assert (field.revision, field.grid.n_rows) == (0, 7)


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
