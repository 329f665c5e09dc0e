"""The learner as a process that records: what is kept, refused, dropped; a full disk."""

from itertools import pairwise
import shutil
import sys

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger

from bridge_helpers import content_of
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.task_folder import TaskFolder
from learner_helpers import COMPILING, LEARNER, recorded, Robot, start
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import call, client_of, collect, node_command, Process, REPEAT, wait_until


def test_a_signal_during_a_demonstration_closes_the_bag(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        task = TaskFolder(tmp_path / 'bags', 'task')
        robot.cross(process, lambda: robot.time > 5.0)
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
            bumper.publish(Bool(data=robot.time > 1.0))
            return any(cdr[4] for cdr in recorded(task, '/contact'))

        robot.cross(process, touches)
        process.stop()
    [episode] = task.episodes()
    said = [cdr[4] for cdr in Episode(episode).messages('contact')]
    assert said[-1] == 1
    assert all(a != b for a, b in pairwise(said)), said


def test_a_kept_demonstration_is_answered_with_what_it_taught(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.cross(process, lambda: robot.time > 30.0)
        answer = robot.keep(process, tmp_path / 'bags')
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
        # A demonstration is recorded; this may be asked for twice, and later not.
        assert not call(ros_node, Trigger, 'learner_node/drop_last', again=REPEAT).success
        robot.cross(process, lambda: robot.time > 30.0)
        kept = robot.keep(process, tmp_path / 'bags')
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


def test_a_drop_during_a_keep_leaves_no_request_without_an_answer(
    ros_domain, ros_node, tmp_path,
):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.cross(process, lambda: robot.time > 30.0)
        # Both have been heard once: only a client's first request may be lost.
        assert not call(ros_node, Trigger, 'learner_node/drop_last', again=REPEAT).success
        keeps = client_of(ros_node, SetBool, 'learner_node/record_demonstration')
        drops = client_of(ros_node, Trigger, 'learner_node/drop_last')
        keep = keeps.call_async(SetBool.Request(data=False))
        drop = drops.call_async(Trigger.Request())
        wait_until(lambda: keep.done() and drop.done(), COMPILING, node=ros_node,
                   processes=[process], what='both answers')
    assert keep.result().success, keep.result().message
    assert drop.result().message


def test_a_demonstration_in_another_frame_is_not_even_begun(ros_domain, ros_node, tmp_path):
    with start(tmp_path, frame_id='r2/odom') as process:
        robot, answers = Robot(ros_node), []

        def is_heard():
            robot.drive(0.6)
            answers.append(call(ros_node, SetBool, 'learner_node/record_demonstration',
                                SetBool.Request(data=True), again=REPEAT))
            return not answers[-1].message.endswith(': learning') and (
                'no odometry' not in answers[-1].message)

        wait_until(is_heard, node=ros_node, processes=[process], what='an odometry')
    assert not answers[-1].success
    assert "must be 'r2/odom'" in answers[-1].message
    assert answers[-1].message.endswith('start learner_node with frame_id:=odom')
    assert not list((tmp_path / 'bags' / 'task').glob('0*'))


def test_a_drive_that_teaches_nothing_is_said(ros_domain, ros_node, tmp_path):
    with start(tmp_path) as process:
        robot = Robot(ros_node)
        robot.meet(process)
        robot.drive(0.6)
        answer = robot.keep(process, tmp_path / 'bags')
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
            robot.cross(process, lambda robot=robot: robot.time > 30.0)
            turn = robot.time
            wait_until(lambda robot=robot, turn=turn: robot.drive(
                0.6 + max(0.0, 0.05 * turn - 0.5 * (robot.time - turn))) and (
                    robot.time > turn + 5.0), node=ros_node)
            answer = robot.keep(process, tmp_path / 'bags')
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
        robot.cross(process, lambda: robot.time > 20.0)
        wait_until(lambda: robot.drive(4.4 + 0.01 * (robot.time - 20.0)) and robot.time > 30.0,
                   node=ros_node)
        answer = robot.keep(process, tmp_path / 'bags')
    assert not answer.success
    assert answer.message.startswith('Drive 0001 is not learnt: this is not one drive of')
    assert 'the pose leaps by' in answer.message
    assert '[WARN]' in next(
        line for line in process.stderr.splitlines() if 'Drive 0001 is not learnt' in line)
    with start(tmp_path) as process:
        wait_until(lambda: 'the pose leaps by' in process.stderr, processes=[process],
                   what='the same sentence')


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

        robot.cross(process, said)
        wait_until(lambda: robot.drive(1.0) and robot.time > 20.0, node=ros_node)
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
        robot.cross(process, said)
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
