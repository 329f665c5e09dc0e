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
#: More messages a topic than the session sees while a drive that is kept settles.
BURST = 1900


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

    def hurry(self, n):
        """Publish so many at once, as a simulation that runs as fast as it can."""
        for _ in range(n):
            self.n += 1
            self._publish()

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


class Recording:
    """A robot that goes on while a learner, which records it, stands still."""

    def __init__(self, node, learner, folder):
        self.robot, self.node, self.learner = Robot(node), node, learner
        self.wait(lambda: call(
            node, SetBool, 'learner_node/record_demonstration', SetBool.Request(data=True),
            again=REPEAT).success, 'a recording')
        self.wait(lambda: 'stalls' in learner.stdout, 'the stall')
        self.first = self.robot.n
        [self.episode] = TaskFolder(folder, 'task').episodes()

    def wait(self, predicate, what):
        def is_so():
            self.robot.go_on()
            return predicate()
        wait_until(is_so, processes=[self.learner], what=what)

    def wait_for(self, n):
        """Wait until so many messages were published on every topic since it stands still."""
        self.wait(lambda: self.robot.n > self.first + n, f'{n} messages')

    def keep(self):
        call(self.node, SetBool, 'learner_node/record_demonstration', SetBool.Request(data=False))

    def check(self, at_least):
        """Fail unless every topic has all numbers from the stall on, and so many of them."""
        for name, numbers in numbers_in(BagReader(self.episode.bag)).items():
            assert numbers == list(range(int(numbers[0]), int(numbers[-1]) + 1)), name
            assert numbers[0] <= self.first + 1, name
            assert numbers[-1] >= self.first + at_least, name


@pytest.fixture
def recording(ros_domain, ros_node, tmp_path):
    bags = tmp_path / 'bags'
    with start_node('stalled_learner', tmp_path, {
            'bags': str(bags), 'rows': GRID.n_rows, 'cols': GRID.n_cols,
            'resolution': GRID.resolution, 'origin_x': GRID.origin_x, 'origin_y': GRID.origin_y},
            env={'PYTHONPATH': os.pathsep.join((str(ROOT), str(ROOT / 'test')))}) as learner:
        yield Recording(ros_node, learner, bags)


@pytest.mark.slow
def test_worker_and_executor_stand_still_for_5_s_and_nothing_is_lost(recording):
    # While it stands still the bag grows nevertheless: a kill would lose the last second.
    recording.wait_for(150)
    so_far = len(BagReader(recording.episode.bag).messages('/odom'))
    assert 'goes on' not in recording.learner.stdout
    recording.wait_for(300)
    recording.wait(lambda: 'goes on' in recording.learner.stdout, 'the end of the stall')
    recording.keep()
    recording.check(at_least=250)
    assert so_far > 50


@pytest.mark.slow
def test_a_drive_that_is_kept_while_the_learner_stands_still_keeps_its_end(recording):
    recording.robot.hurry(BURST)
    # All of it has arrived, and waits for the session.
    wait_until(lambda: len(BagReader(recording.episode.bag).messages('/odom')) >= BURST,
               processes=[recording.learner], what='all messages')
    recording.keep()
    recording.check(at_least=BURST)


@pytest.mark.slow
def test_what_the_middleware_has_when_a_drive_is_kept_belongs_to_it(recording):
    recording.wait(lambda: 'goes on' in recording.learner.stdout, 'the end of the stall')
    # From here on the thread that records takes nothing.
    recording.robot.hurry(200)
    n = recording.robot.n
    recording.keep()
    recording.check(at_least=n - recording.first)
