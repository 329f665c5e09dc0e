"""The demo's own node, between others that may send anything."""

from itertools import cycle

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry

from experience_cli.driver import Driver
from experience_cli.node import DemoNode
from msgs_bridge import qos
from msgs_bridge.poses import odometry_from_pose, Pose
from msgs_bridge.trial_status import State, status_from_trial, TrialStatus


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
