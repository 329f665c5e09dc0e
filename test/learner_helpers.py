"""A learner as a process, and a robot whose odometry a test publishes."""

from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool

from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import TaskFolder
from learner_node.recording.recorder import stamp_of
from learner_node.session.phases import Phase, WORDS
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.node import qos
from ros_helpers import call, DEADLINE, REPEAT, start_node, wait_until

LEARNER = 'learner_node.node'
#: What is learnt first waits for kernels, which a new tree compiles, [s].
COMPILING = 5 * DEADLINE
#: Odometry that is published between two looks at what has come of it.
STEPS_A_LOOK = 5


def start(tmp_path, **parameters):
    return start_node(LEARNER, tmp_path, {'bags': str(tmp_path / 'bags'), **parameters})


def recorded(task, topic):
    """Return what the newest bag of a task holds of a topic so far, which may be open."""
    return [cdr for channel, *_, cdr in BagReader(task.episodes()[-1].bag).records()
            if channel.topic == topic]


class Robot:
    """Publishes odometry when it is told to."""

    def __init__(self, node):
        self.node = node
        # Deep: it publishes faster than a busy machine may take.
        self.publisher = node.create_publisher(Odometry, 'odom', qos.RECORDING)
        self.stamp = self.began = 0.0

    @property
    def time(self):
        """Seconds since the recording began, however long the learner took to meet."""
        return self.stamp - self.began

    def drive(self, x):
        self.stamp += 0.1
        self.publisher.publish(odometry_from_pose(Pose(self.stamp, x, 0.875, 0.0)))
        return True

    def meet(self, process):
        """Publish until the learner has heard it and begins to record."""
        def is_recording():
            self.drive(0.6)
            answer = self._ask(True)
            return answer.success or WORDS[Phase.DEMONSTRATION] in answer.message
        wait_until(is_recording, node=self.node, processes=[process], what='a recording')
        self.began = self.stamp

    def cross(self, process, until):
        """Drive along x, from where it stood as the recording began, until something is so."""
        def is_done():
            for _ in range(STEPS_A_LOOK):
                self.drive(0.6 + (self.time * 0.05) % 3.0)
            return until()
        wait_until(is_done, node=self.node, processes=[process], what='the end of the drive')

    def keep(self, process, bags):
        """Keep the drive once all of it was heard; return the answer."""
        task = TaskFolder(bags, 'task')

        def is_heard():
            return any(abs(stamp_of(cdr) * 1e-9 - self.stamp) < 0.01
                       for cdr in recorded(task, '/odom'))

        wait_until(is_heard, node=self.node, processes=[process], what='the end in the bag')
        return self._ask(False, COMPILING)

    def _ask(self, data, deadline=DEADLINE):
        return call(self.node, SetBool, 'learner_node/record_demonstration',
                    SetBool.Request(data=data), deadline, REPEAT)
