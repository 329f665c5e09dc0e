"""A peer of the controller as a process: what robot and learner are to it."""

import math
import time

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from controller_helpers import GRID, straight_field
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_field, decisions_from_cloud
from msgs_bridge.messages.trial_status import trial_from_status
from msgs_bridge.node import qos
import ros_helpers

GOAL = (3, 8)
#: A goal behind the obstacle of the world `task1`.
BEHIND = (3, 14)
START = {'start_x': 0.625, 'start_y': 0.875}
#: How many times as fast as time stamps run at most: much faster, every hitch looks like a link
#: that is late by a second.
PACE = 4.0
LOCKSTEP = {'lockstep': True, 'enable_stamped_cmd_vel': True}


class Peer:
    """The robot's and the learner's end of a controller's topics, in this process."""

    def __init__(self, node, *, stamped=False, namespace=''):
        self.node, self.prefix = node, namespace
        self.commands = self.collect(TwistStamped if stamped else Twist, 'cmd_vel', 50)
        self.statuses = self.collect(DiagnosticStatus, 'trial', qos.LATCHED)
        self.experience = self.collect(PointCloud2, 'experience', qos.EXPERIENCE)
        self.odom = node.create_publisher(Odometry, f'{namespace}odom', qos.ODOMETRY_PUB)
        self.local_grid = node.create_publisher(
            OccupancyGrid, f'{namespace}neighbourhood', qos.ODOMETRY_PUB)
        self.field = node.create_publisher(
            PointCloud2, f'{namespace}control_field', qos.LATCHED)
        self.pose = Pose(1.0, *GRID.world_from_cell(3, 2), 0.0)
        self._due = 0.0

    def collect(self, kind, topic, profile):
        return ros_helpers.collect(self.node, kind, f'{self.prefix}{topic}', profile)

    @property
    def status(self):
        return trial_from_status(self.statuses[-1]) if self.statuses else None

    @property
    def rows(self):
        return [row for cloud in self.experience for row in decisions_from_cloud(cloud)]

    def wait(self, predicate, what, deadline=ros_helpers.DEADLINE):
        return ros_helpers.wait_until(predicate, deadline, node=self.node, what=what)

    def meet(self):
        """Wait until the controller hears and is heard."""
        self.wait(lambda: all(p.get_subscription_count() for p in (
            self.odom, self.local_grid, self.field)) and self.statuses, 'the controller')
        return self

    def push(self, field=None):
        field = field or straight_field(GOAL)
        self.field.publish(cloud_from_field(field))
        return self

    def tick(self, *, order='local grid first', **change):
        """Publish the next tick, the robot having driven for 0.05 s what it was last told."""
        time.sleep(max(self._due - time.monotonic(), 0.0))
        self._due = time.monotonic() + 0.05 / PACE
        v, w = velocity_of(self.commands[-1]) if self.commands else (0.0, 0.0)
        middle = self.pose.yaw + 0.025 * w
        values = {'stamp': round(self.pose.stamp + 0.05, 9),
                  'x': self.pose.x + 0.05 * v * math.cos(middle),
                  'y': self.pose.y + 0.05 * v * math.sin(middle), 'yaw': self.pose.yaw + 0.05 * w}
        pose = Pose(**{**values, 'v': v, 'w': w, **change})
        if not change:
            self.pose = pose
        messages = [(self.local_grid, grid_from_neighbourhood(Neighbourhood(
            pose.stamp, *GRID.cell_from_world(self.pose.x, self.pose.y),
            np.zeros((3, 3), np.int8)), GRID)), (self.odom, odometry_from_pose(pose))]
        for publisher, msg in messages if order == 'local grid first' else reversed(messages):
            publisher.publish(msg)

    def call(self, name, **options):
        return ros_helpers.call(
            self.node, Trigger, f'{self.prefix}control_field_node/{name}', **options)

    def accepts_start(self):
        """Call; a request on the heels of discovery may be lost, and is repeated then."""
        try:
            answer = self.call('start_trial', deadline=3.0)
        except AssertionError:
            return False
        return answer.success or 'already running' in answer.message

    def start(self):
        """Publish ticks until the controller accepts a start."""
        def accepted():
            self.tick()
            return self.accepts_start()

        self.wait(accepted, 'a start')
        return self

    def drive(self):
        """Publish ticks until the robot drives at speed."""
        def fast():
            self.tick()
            return self.commands and velocity_of(self.commands[-1])[0] > 0.15

        self.start().wait(fast, 'a fast command')
        return self

    def has_stopped(self):
        return velocity_of(self.commands[-1]) == (0.0, 0.0)


def velocity_of(msg):
    twist = getattr(msg, 'twist', msg)
    return twist.linear.x, twist.angular.z


def controller(folder, parameters=None, **options):
    return ros_helpers.start_node('control_field_node.node', folder, parameters, **options)


def simulator(folder, parameters=None, **options):
    return ros_helpers.start_node(
        'sim_node.node', folder, {**START, 'world': 'task1', **(parameters or {})}, **options)
