"""No trial of a series begins on the local grid of another place, however late its own comes."""

from contextlib import ExitStack
import time

from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
import pytest
from std_srvs.srv import SetBool, Trigger

from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.node import qos
from ros_helpers import call, REPEAT, start_node, wait_until

PERIOD = 0.14
N_TRIALS = 3


class Robot:
    """The simulated one with a slow local grid, and a person who drives it."""

    def __init__(self, node):
        self.pose, self._passed = None, 0.0
        self.local_grids = node.create_publisher(OccupancyGrid, 'neighbourhood', qos.SENSOR)
        self.commands = node.create_publisher(Twist, 'cmd_vel_teleop', 10)
        node.create_subscription(OccupancyGrid, 'every_sight', self._pass_on, qos.SENSOR)
        node.create_subscription(Odometry, 'odom', self._look, qos.SENSOR)

    def _look(self, msg):
        self.pose = pose_from_odometry(msg)

    def _pass_on(self, msg):
        if time.monotonic() - self._passed > PERIOD:
            self._passed = time.monotonic()
            self.local_grids.publish(msg)

    def drive(self, speed):
        command = Twist()
        command.linear.x = speed
        self.commands.publish(command)


@pytest.mark.slow
def test_a_trial_begins_when_the_local_grid_is_of_its_start(ros_node, tmp_path):
    with ExitStack() as stack:
        processes = [stack.enter_context(start_node(*arguments, **options)) for *arguments, options
                     in (('sim_node.node', tmp_path, {'speed_factor': 3.0},
                          {'remappings': {'neighbourhood': 'every_sight'}}),
                         ('control_field_node.node', tmp_path, {}),
                         ('learner_node.node', tmp_path, {
                             'bags': str(tmp_path), 'simulation': True,
                             'auto_trials': N_TRIALS}, {}))]
        robot = Robot(ros_node)

        def wait(predicate, what):
            return wait_until(predicate, node=ros_node, processes=processes, what=what)

        def record(on):
            return call(ros_node, SetBool, 'learner_node/record_demonstration',
                        SetBool.Request(data=on), again=REPEAT if on else None).success
        wait(lambda: robot.pose is not None and record(True), 'a demonstration')
        wait(lambda: robot.drive(0.2) or robot.pose.x > 2.0, 'the goal')
        wait(lambda: robot.drive(0.0) or robot.pose.v < 1e-6, 'the standstill')
        assert record(False)
        assert call(ros_node, Trigger, 'learner_node/run_trials').success
        wait(lambda: f'trial {N_TRIALS} reached the goal' in processes[1].stderr, 'the trials')
        assert 'its middle is cell' not in processes[1].stderr
