"""The controller in lock-step: with the simulator, and tick by tick."""

import math

from nav_msgs.msg import OccupancyGrid, Odometry
import pytest
from std_srvs.srv import Trigger

from control_field.records import Outcome
from controller_helpers import straight_field
from controller_peer import BEHIND, controller, LOCKSTEP, Peer, simulator
from msgs_bridge.messages.poses import odometry_from_pose, Pose, seconds_from_stamp
from msgs_bridge.messages.trial_status import State
from msgs_bridge.node import qos
import ros_helpers


@pytest.fixture
def stepped(ros_node, tmp_path):
    with controller(tmp_path, LOCKSTEP):
        yield Peer(ros_node, stamped=True).meet()


@pytest.mark.parametrize('order', ['local grid first', 'odometry first'])
def test_lockstep_answers_each_stamp_exactly_once(stepped, order):
    stepped.push().start()
    stepped.wait(lambda: stepped.commands, 'the first answer')
    for _ in range(20):
        n = len(stepped.commands)
        stepped.tick(order=order)
        stepped.wait(lambda: len(stepped.commands) > n, 'an answer')  # noqa: B023
        stamp = seconds_from_stamp(stepped.commands[-1].header.stamp)
        assert stamp == pytest.approx(stepped.pose.stamp)
    stamps = [seconds_from_stamp(msg.header.stamp) for msg in stepped.commands]
    assert len(set(stamps)) == len(stamps)


def test_lockstep_does_not_answer_half_a_tick_nor_a_repeated_one(stepped):
    stepped.push().start()
    stepped.wait(lambda: stepped.commands, 'the first answer')
    n = len(stepped.commands)
    again = odometry_from_pose(stepped.pose)
    for _ in range(5):
        stepped.odom.publish(again)
        stepped.odom.publish(odometry_from_pose(Pose(
            stepped.pose.stamp + 0.05, stepped.pose.x, stepped.pose.y, stepped.pose.yaw)))
        ros_helpers.spin_some(stepped.node)
    assert len(stepped.commands) == n


def run_trials(node, folder, n_trials, namespace='', *, wheels=None, settings=None):
    """Run trials in lock-step with the simulator; return their ends, rows and command stamps."""
    names = {'namespace': f'/{namespace.strip("/")}'} if namespace else {}
    with simulator(folder, {**LOCKSTEP, **(wheels or {})}, **names), controller(
            folder, {**LOCKSTEP, **(settings or {})}, **names):
        peer = Peer(node, stamped=True, namespace=namespace)
        peer.push(straight_field(BEHIND))
        ends = []
        for trial in range(1, n_trials + 1):
            assert ros_helpers.call(node, Trigger, f'{namespace}sim_node/reset',
                                    again=ros_helpers.REPEAT).success
            peer.wait(peer.accepts_start, 'a start')
            peer.wait(lambda: peer.status.trial == trial  # noqa: B023
                      and peer.status.state is State.ENDED, 'the end of the trial', 60.0)
            ends.append(peer.status)
            # The end and the last decision come on topics of their own, in any order.
            peer.wait(lambda: len(peer.rows) >= sum(end.decisions for end in ends),
                      'all decisions')
        return ends, peer.rows, [seconds_from_stamp(msg.header.stamp) for msg in peer.commands]


def test_with_the_simulator_in_lockstep_trials_reach_the_goal_and_are_repeatable(
        ros_node, tmp_path):
    ends, rows, stamps = run_trials(ros_node, tmp_path, 2)
    assert [end.outcome for end in ends] == [Outcome.GOAL] * 2
    assert ends[0].steps == ends[1].steps
    assert len(rows) == sum(end.decisions for end in ends)
    assert len(set(stamps)) == len(stamps)
    paths = [[(r['row'], r['col'], r['action'], r['kind']) for r in rows if r['trial'] == t]
             for t in (1, 2)]
    assert paths[0] == paths[1]


def test_malformed_messages_between_the_ticks_of_a_lockstep_hold_nothing_up(ros_node, tmp_path):
    odometry = Odometry()
    odometry.pose.pose.position.x = math.nan
    elsewhere = odometry_from_pose(Pose(0.0, 1.0, 1.0, 0.0, frame_id='map'))
    odoms = ros_node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
    local_grids = ros_node.create_publisher(OccupancyGrid, 'neighbourhood', qos.ODOMETRY_PUB)
    with simulator(tmp_path, LOCKSTEP), controller(tmp_path, LOCKSTEP):
        peer = Peer(ros_node, stamped=True)
        peer.push(straight_field(BEHIND))
        peer.wait(peer.accepts_start, 'a start')

        def has_ended():
            odoms.publish(odometry)
            local_grids.publish(OccupancyGrid())
            odoms.publish(elsewhere)
            return peer.status.state is State.ENDED

        peer.wait(has_ended, 'the end of the trial')
    assert peer.status.outcome is Outcome.GOAL


def test_with_slip_and_anchoring_trials_in_lockstep_reach_the_goal(ros_node, tmp_path):
    ends, rows, stamps = run_trials(
        ros_node, tmp_path, 2, wheels={'slip': 0.05, 'heading_drift': 0.01745, 'seed': 3},
        settings={'anchoring': True})
    assert [end.outcome for end in ends] == [Outcome.GOAL] * 2
    assert len(rows) == sum(end.decisions for end in ends)
    assert len(set(stamps)) == len(stamps)


def test_two_suites_in_two_namespaces_do_not_disturb_each_other(ros_node, tmp_path):
    names = [{'namespace': f'/{name}'} for name in ('left', 'right')]
    with simulator(tmp_path, LOCKSTEP, **names[0]), controller(tmp_path, LOCKSTEP, **names[0]), \
            simulator(tmp_path, LOCKSTEP, **names[1]), controller(tmp_path, LOCKSTEP, **names[1]):
        left, right = (Peer(ros_node, stamped=True, namespace=f'/{name}/')
                       for name in ('left', 'right'))
        left.push(straight_field(BEHIND))
        right.push(straight_field((9, 2)))
        left.wait(left.accepts_start, 'a start')
        left.wait(lambda: left.status.state is State.ENDED, 'the end of the left trial')
        assert left.status.outcome is Outcome.GOAL
        assert right.commands == []
        right.wait(lambda: right.statuses, 'word of the right controller')
        assert right.status.state is State.IDLE
        right.wait(right.accepts_start, 'a start')
        right.wait(lambda: right.status.state is State.ENDED, 'the end of the right trial')
        assert right.status.outcome is Outcome.GOAL
        assert {int(row['trial']) for row in left.rows} == {1}
        assert right.rows[-1]['col'] < 5
