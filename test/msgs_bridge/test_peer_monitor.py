"""Whom a node meets: twins that live, and those that were started anew."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import pytest
from rclpy.parameter import Parameter

from control_field.grid import Grid
from msgs_bridge.messages.serialized import cdr_from_message
from msgs_bridge.node.node_info import (
    NodeInfo, Operation, values_from_node_info, workspace_from_grid)
from msgs_bridge.node.peer_monitor import PeerMonitor, PeerTable
import ros_helpers


def said(name='/learner_node', number=1):
    return NodeInfo(name, 'learner', f'host-{number}-ab')


def test_two_that_live_are_met_and_one_that_was_started_anew_is_not():
    peers = PeerTable('/teleop_node')
    for now in range(5):
        peers.update(said(number=1), float(now))
    peers.update(said(number=2), 5.0)
    assert peers.conflicts(5.0) == []
    peers.update(said(number=1), 5.5)
    [problem] = peers.conflicts(5.5)
    assert '2 learners' in problem.text
    for now in range(6, 12):
        peers.update(said(number=2), float(now))
    assert peers.conflicts(11.0) == []


def test_a_node_with_a_role_meets_its_own_twin_but_not_itself():
    peers = PeerTable('/learner_node', 'learner')
    peers.update(peers.own, 0.0)
    assert peers.conflicts(0.0) == []
    peers.update(said(), 0.0)
    assert len(peers.conflicts(0.0)) == 1


def test_other_namespaces_are_other_suites():
    peers = PeerTable('/left/learner_node', 'learner')
    for name in ('/learner_node', '/right/learner_node', '/left/more/learner_node'):
        peers.update(said(name), 0.0)
    assert peers.conflicts(0.0) == []


def test_who_has_gone_silent_counts_no_more():
    peers = PeerTable('/sim_node', 'robot')
    peers.own = NodeInfo(peers.own.name, 'robot', peers.own.instance,
                            workspace_from_grid(Grid(20, 20, 1.0)))
    peers.update(NodeInfo('/learner_node', 'learner', 'a', workspace_from_grid(
        Grid(20, 20, 0.25))), 0.0)
    assert len(peers.conflicts(3.0)) == 1
    assert peers.conflicts(5.0) == []


def test_how_large_the_cells_around_are_is_told_by_who_has_some():
    peers = PeerTable('/learner_node', 'learner')
    peers.update(said('/other', 2), 0.0)
    assert peers.cells(('sight', 'robot'), 0.0) is None
    peers.update(NodeInfo('/neighbourhood_node', 'sight', 'a', workspace_from_grid(
        Grid(1, 1, 0.5), is_fitted=True)), 0.0)
    peers.update(NodeInfo('/sim_node', 'robot', 'b', workspace_from_grid(
        Grid(20, 20, 0.25, -1.1))), 0.0)
    assert peers.cells(('sight', 'robot'), 1.0) == Grid(1, 1, 0.5)
    assert peers.cells(('learner', 'robot'), 1.0) == Grid(1, 1, 0.25, -0.1)
    assert peers.cells(('learner',), 1.0) is None
    assert peers.cells(('sight', 'robot'), 9.0) is None


def test_ever_new_processes_do_not_fill_the_memory():
    peers = PeerTable('/teleop_node')
    for number in range(1000):
        peers.update(said(number=number), 0.0)
    assert len(peers._peers) == 64


def test_while_a_demonstration_is_recorded_nothing_drives_by_itself(ros_node):
    watch = PeerMonitor(ros_node, 'controller')

    def says(phase, number=1):
        status = DiagnosticStatus(name='learner_node: learner', values=[
            KeyValue(key='phase', value=phase),
            *(KeyValue(key=key, value=value)
              for key, value in values_from_node_info(said(number=number)).items())])
        watch._on_diagnostics(cdr_from_message(DiagnosticArray(status=[status])))

    says('idle')
    assert watch.why_not(Operation.DRIVE) == ''
    says('demonstration')
    assert 'learner_node records a demonstration' in watch.why_not(Operation.DRIVE)
    assert watch.why_not(Operation.TEACH) == watch.why_not(Operation.CHANGE) == ''
    assert watch.problems == []
    says('settling')
    assert watch.why_not(Operation.DRIVE) == ''
    says('demonstration')
    says('idle', number=2)  # it was killed, and started anew
    assert watch.why_not(Operation.DRIVE) == ''


def test_odometry_that_is_in_another_namespace_is_named_with_what_to_set(ros_node):
    said = []
    watch = PeerMonitor(ros_node, 'controller', said.append)
    there = ros_node.create_publisher(Odometry, '/r1/odom', 1)
    ros_node.create_publisher(PoseStamped, '/r2/odom', 1)
    ros_node.create_subscription(Odometry, '/r3/odom', lambda _: None, 1)
    for _ in range(5):
        watch.look()
    assert said == []
    for _ in range(10):
        watch.look()
    [line] = said
    assert line == (
        'nobody publishes /odom, but there is /r1/odom: if that is this robot, start this node '
        'with -r __ns:=/r1, or with -r odom:=/r1/odom')
    said.clear()
    ros_node.create_publisher(Odometry, 'odom', 1)
    other = PeerMonitor(ros_node, 'controller', said.append)
    for _ in range(15):
        other.look()
    assert said == []
    ros_node.destroy_publisher(there)


@pytest.mark.parametrize('is_simulated', [True, False])
def test_a_time_that_never_comes_is_named_once(ros_domain, is_simulated):
    said = []
    with ros_helpers.own_node(ros_domain, 'lonely', parameter_overrides=[
            Parameter('use_sim_time', value=is_simulated)]) as node:
        watch = PeerMonitor(node, 'learner', said.append)
        for _ in range(3):
            watch.look()
        assert said == []
        for _ in range(5):
            watch.look()
    assert len(said) == is_simulated
    assert all('/clock' in text and 'leave use_sim_time out' in text for text in said)


def test_what_comes_as_another_type_is_named_and_not_just_absent(ros_node):
    said = []
    watch = PeerMonitor(ros_node, 'controller', said.append)
    wrong = [ros_node.create_publisher(PoseStamped, topic, 1)
             for topic in ('odom', 'neighbourhood')]
    watch.look()
    watch.look()
    assert said == [
        f'nothing of use can arrive on /{topic}: /test_node publishes it as '
        f'geometry_msgs/msg/PoseStamped, must be nav_msgs/msg/{kind.__name__}; remap it (-r), or '
        f'start what publishes that' for topic, kind in (
            ('odom', Odometry), ('neighbourhood', OccupancyGrid))]
    assert watch.why_not(Operation.DRIVE) == watch.why_not(Operation.TEACH) == said[0]
    ros_node.destroy_publisher(wrong[0])
    watch.look()
    assert watch.why_not(Operation.DRIVE) == said[1]
    assert not watch.why_not(Operation.TEACH)
    ros_node.destroy_publisher(wrong[1])
    watch.look()
    assert not watch.problems
