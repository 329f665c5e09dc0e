"""The demo's own node, between others that may send anything."""

from functools import partial
from itertools import cycle
import time
from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
import pytest
from rclpy.task import Future

from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.path_follower import Driver
from experience_cli.errors import UserError
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos


def test_what_makes_no_sense_is_passed_over_and_said_once(ros_domain, ros_node, capsys):
    broken, sound = Odometry(), odometry_from_pose(Pose(1.0, 1.0, 1.0, 0.0))
    broken.pose.pose.position.x = float('nan')
    odometry = ros_node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
    trials = ros_node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
    lines = []

    def publish(pose, status):
        odometry.publish(pose)
        trials.publish(status)
        lines.extend(capsys.readouterr().err.splitlines())

    with DemoNode(ros_domain, lambda: None) as node:
        def refused():
            publish(broken, DiagnosticStatus(name='x'))
            return len(lines) >= 2

        def heard():
            publish(sound, status_from_trial(TrialStatus(State.RUNNING, 7), 'task'))
            return node.odometry is not None and node.status is not None

        node.wait_until(refused, 'two refusals', 10.0)
        assert node.odometry is None
        assert node.status is None
        node.wait_until(heard, 'what makes sense', 10.0)
        # The robot is at the end of the line: the drive ends by the odometry that makes sense.
        poses = cycle([broken, sound])
        node._check = lambda: odometry.publish(next(poses))
        node.drive(Driver([(0.0, 1.0), (1.0, 1.0)]), lambda share: None)
    assert capsys.readouterr().err == ''
    assert len(lines) == 2
    assert all('is passed over' in line for line in lines)


class Client:
    """A learner that loses requests or answers, told by what happens to each request in turn."""

    def __init__(self, node, fates):
        self.node, self.fates, self.n_asked = node, list(fates), 0

    def service_is_ready(self):
        return True

    def call_async(self, request):
        fate = self.fates[min(self.n_asked, len(self.fates) - 1)]
        self.n_asked += 1
        future = Future()
        if fate in ('done', 'silent') and self.node.learner['phase'] == 'idle':
            self.node.learner = {'phase': 'demonstration'}
            if fate == 'done':
                future.set_result(SimpleNamespace(success=True, message='recording'))
        elif fate in ('done', 'refused'):
            future.set_result(SimpleNamespace(success=False, message='no odometry'))
        return future


@pytest.mark.parametrize(('fates', 'said', 'n_asked'), [
    (['done'], 'recording', 1), (['lost', 'done'], 'recording', 2),
    (['lost', 'lost', 'silent'], '', 3), (['silent'], '', 1),
    (['refused'], 'no odometry', 1), (['lost', 'refused'], 'no odometry', 2)])
def test_a_request_that_gets_lost_is_made_again_and_what_is_done_counts(
        monkeypatch, fates, said, n_asked):
    monkeypatch.setattr('experience_cli.demo.client_node._UNHEARD', 0.05)
    node = object.__new__(DemoNode)
    node.learner, client = {'phase': 'idle'}, Client(node, fates)
    node._check = lambda: None
    node._executor = SimpleNamespace(spin_once=lambda seconds: time.sleep(0.01))
    node._node = SimpleNamespace(create_client=lambda *_: client, destroy_client=lambda _: None)
    node.wait_until = partial(node.wait_until, patience=2.0)
    if 'refused' in fates:
        with pytest.raises(UserError, match=said):
            node.ask('learner_node/record_demonstration', True)
    else:
        assert node.ask('learner_node/record_demonstration', True) == said
        assert client.n_asked == n_asked
