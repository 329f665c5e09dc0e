"""What is published reliably is recorded, whatever the learner is busy with."""

import os
import time

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool

from bridge_helpers import GRID, random_decisions
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.topic_tables import decision_table, pose_table, statuses
from episode_store.task_folder import TaskFolder
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.serialized import message_from_cdr
from msgs_bridge.messages.tables import cloud_from_decisions
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
from ros_helpers import call, REPEAT, ROOT, spin_some, start_node, wait_until

PERIOD = 0.02


class Robot:
    """Publishes numbered messages at 50 Hz, on every reliable topic."""

    def __init__(self, node):
        self._node = node
        topics = {'odom': (Odometry, qos.RECORDING), 'cmd_vel': (Twist, qos.RECORDING),
                  'experience': (PointCloud2, qos.EXPERIENCE),
                  'trial': (DiagnosticStatus, qos.RECORDING_LATCHED)}
        self._topics = {name: node.create_publisher(kind, name, profile)
                        for name, (kind, profile) in topics.items()}
        self.n = 0
        self._next = time.monotonic()

    def go_on(self):
        """Publish what is due."""
        while time.monotonic() >= self._next:
            self._next += PERIOD
            self.n += 1
            self._publish()
        spin_some(self._node, 0.005)

    def _publish(self):
        seconds, twist = self.n * PERIOD, Twist()
        twist.linear.x = float(self.n)
        rows = random_decisions(GRID, 1, self.n, trial=7)
        rows['step'] = self.n
        messages = {
            'odom': odometry_from_pose(Pose(seconds, 0.1 + 0.05 * seconds, 0.4, 0.0)),
            'cmd_vel': twist, 'experience': cloud_from_decisions(rows, GRID),
            'trial': status_from_trial(TrialStatus(State.IDLE, stamp=seconds))}
        for name, message in messages.items():
            self._topics[name].publish(message)


def numbers_in(bag):
    """Return the numbers of the messages in a bag, by topic."""
    stamps = [status.stamp for _, status in statuses(bag.messages('/trial'))
              if status.state is State.IDLE]
    return {
        'odom': np.rint(pose_table(bag.messages('/odom'), 'odom').stamps / PERIOD).tolist(),
        'cmd_vel': [message_from_cdr(cdr, Twist).linear.x for cdr in bag.messages('/cmd_vel')],
        'experience': decision_table(bag.messages('/experience'), GRID)[0]['step'].tolist(),
        'trial': np.rint(np.array(stamps) / PERIOD).tolist()}


@pytest.mark.slow
def test_worker_and_executor_stand_still_for_5_s_and_nothing_is_lost(
    ros_domain, ros_node, tmp_path,
):
    robot = Robot(ros_node)
    with start_node('stalled_learner', tmp_path, {
            'bags': str(tmp_path / 'bags'), 'rows': GRID.n_rows, 'cols': GRID.n_cols,
            'resolution': GRID.resolution, 'origin_x': GRID.origin_x, 'origin_y': GRID.origin_y},
            env={'PYTHONPATH': os.pathsep.join((str(ROOT), str(ROOT / 'test')))}) as learner:
        def is_so(predicate):
            robot.go_on()
            return predicate()
        wait_until(lambda: is_so(lambda: call(
            ros_node, SetBool, 'learner_node/record_demonstration', SetBool.Request(data=True),
            again=REPEAT).success), processes=[learner], what='a recording')
        wait_until(lambda: is_so(lambda: 'stalls' in learner.stdout), processes=[learner],
                   what='the stall')
        first = robot.n
        # While it stands still the bag grows nevertheless: a kill would lose the last second.
        [episode] = TaskFolder(tmp_path / 'bags', 'task').episodes()
        wait_until(lambda: is_so(lambda: robot.n > first + 150), processes=[learner],
                   what='a bag that grows')
        so_far = len(BagReader(episode.bag).messages('/odom'))
        assert 'goes on' not in learner.stdout
        wait_until(lambda: is_so(lambda: 'goes on' in learner.stdout and robot.n > first + 300),
                   processes=[learner], what='the end of the stall')
        call(ros_node, SetBool, 'learner_node/record_demonstration', SetBool.Request(data=False))
    found = numbers_in(BagReader(episode.bag))
    for name, numbers in found.items():
        assert numbers == list(range(int(numbers[0]), int(numbers[-1]) + 1)), name
        assert numbers[0] <= first + 1, name
        assert numbers[-1] >= first + 250, name
    assert so_far > 50
