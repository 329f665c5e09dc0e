"""A learner as a process, and a robot whose odometry a test publishes."""


from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool

from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.node import qos
from ros_helpers import call, REPEAT, start_node, wait_until

LEARNER = 'learner_node.node'
#: Odometry that is published between two looks at what has come of it.
STEPS_A_LOOK = 5


def start(tmp_path, **parameters):
    return start_node(LEARNER, tmp_path, {'bags': str(tmp_path / 'bags'), **parameters})


class Robot:
    """Publishes odometry when it is told to."""

    def __init__(self, node):
        self.node = node
        self.publisher = node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
        self.stamp = 0.0

    def drive(self, x):
        self.stamp += 0.1
        self.publisher.publish(odometry_from_pose(Pose(self.stamp, x, 0.875, 0.0)))
        return True

    def meet(self, process):
        """Publish until the learner has heard it and begins to record."""
        def is_recording():
            self.drive(0.6)
            return call(self.node, SetBool, 'learner_node/record_demonstration',
                        SetBool.Request(data=True), again=REPEAT).success
        wait_until(is_recording, node=self.node, processes=[process], what='a recording')

    def cross(self, process, bag, until):
        """Drive along x until something is so."""
        def is_done():
            for _ in range(STEPS_A_LOOK):
                self.drive(0.6 + (self.stamp * 0.05) % 3.0)
            return until()
        wait_until(is_done, node=self.node, processes=[process], what='the end of the drive')
