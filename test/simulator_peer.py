"""The other side of a simulator that runs as a process: hears everything, commands, waits."""

from contextlib import contextmanager

from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.serialization import deserialize_message
from std_msgs.msg import Bool

from msgs_bridge.messages.poses import initialpose_from_pose, Pose
from msgs_bridge.node import qos
import ros_helpers

START = Pose(0.0, 0.625, 0.875, 0.0)


class Peer:
    """The simulator's other side: hears everything, commands, waits with a deadline."""

    def __init__(self, node, process, stamped=True, prefix='', listen=True):
        self.node, self.process = node, process
        self.events = []
        self.command_type = TwistStamped if stamped else Twist
        self.commands = node.create_publisher(
            self.command_type, f'{prefix}cmd_vel', qos.COMMAND)
        self.places = node.create_publisher(
            PoseWithCovarianceStamped, f'{prefix}initialpose', qos.POSE)
        if listen:
            for kind, topic, profile in (
                    (OccupancyGrid, f'{prefix}neighbourhood', qos.SENSOR),
                    (Odometry, f'{prefix}odom', qos.SENSOR),
                    (Bool, f'{prefix}contact', qos.LATCHED)):
                self._hear(kind, topic, profile)
        self.wait(lambda: self.commands.get_subscription_count()
                  and self.places.get_subscription_count(), 'the simulator')

    def _hear(self, kind, topic, profile):
        def keep(data):
            self.events.append((kind, data))
        self.node.create_subscription(kind, topic, keep, profile, raw=True)

    def of(self, kind):
        return [deserialize_message(data, kind) for k, data in list(self.events) if k is kind]

    def wait(self, predicate, what):
        return ros_helpers.wait_until(
            predicate, node=self.node, processes=[self.process], what=what)

    def odometry(self):
        """Return the next odometry to come."""
        n = len(self.of(Odometry))
        self.wait(lambda: len(self.of(Odometry)) > n, 'odometry')
        return self.of(Odometry)[-1]

    def command(self, v, w, stamp=None):
        msg = self.command_type()
        twist = msg.twist if self.command_type is TwistStamped else msg
        twist.linear.x, twist.angular.z = v, w
        if stamp is not None:
            msg.header.stamp = stamp
        self.commands.publish(msg)

    def place(self, pose=START):
        self.places.publish(initialpose_from_pose(pose))

    def first_tick(self, pose=START):
        """Hear the tick that stands (it is repeated for us), place the robot, hear the next."""
        self.wait(lambda: self.of(Odometry), 'the standing tick')
        standing = self.of(Odometry)[-1].header.stamp
        self.events.clear()
        self.place(pose)
        self.wait(lambda: any(o.header.stamp != standing for o in self.of(Odometry)), 'a tick')
        return self.of(Odometry)[-1]

    def drive(self, commands):
        """Answer tick after tick; return the odometry after the last one."""
        last = self.of(Odometry)[-1]
        for v, w in commands:
            self.command(v, w, last.header.stamp)
            self.wait(lambda s=last.header.stamp: self.of(Odometry)[-1].header.stamp != s,
                      'the next tick')
            last = self.of(Odometry)[-1]
        return last


@contextmanager
def simulator(node, folder, stamped=True, prefix='', listen=True, **parameters):
    with ros_helpers.start_node('sim_node.node', folder, parameters) as process:
        yield Peer(node, process, stamped, prefix, listen)
