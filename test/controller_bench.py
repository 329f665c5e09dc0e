"""A controller without ROS, and a robot that does what it is told."""

import math

import numpy as np

from control_field.local_grid import crop_neighbourhood
from control_field.parameters import Parameters
from control_field.robot.limits import STANDSTILL
from control_field_node.settings import Settings
from control_field_node.supervisor import Supervisor
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State

DT = 0.05
GOAL = (5, 9)


class Bench:
    """A supervisor and a robot that does what it is told, in a world of cells."""

    def __init__(self, *, field=True, world=None, parameters=None, **settings):
        self.lines = []
        self.supervisor = Supervisor(
            Settings(**settings), parameters or Parameters(),
            lambda level, text: self.lines.append((level, text)))
        self.world = np.zeros(GRID.shape, np.int8) if world is None else world
        self.pose = Pose(1.0, *GRID.world_from_cell(5, 3), 0.0)
        self.rows, self.sent = [], []
        if field:
            self.supervisor.accept_field(straight_field(GOAL))

    @property
    def now(self):
        return self.pose.stamp

    @property
    def velocity(self):
        return next((answer.velocity for answer in reversed(self.sent)
                     if answer.velocity is not None), STANDSTILL)

    def take(self, answer):
        self.sent.append(answer)
        self.rows += [row for table in answer.rows for row in table]
        return answer

    def look(self):
        cell = GRID.cell_from_world(self.pose.x, self.pose.y)
        self.supervisor.on_neighbourhood(
            Neighbourhood(self.now, *cell, crop_neighbourhood(self.world, *cell)), self.now)

    def tick(self, *, sees=True, velocity=None):
        """Let a tick pass in which the robot drives what it was told, or `velocity`."""
        v, w = self.velocity if velocity is None else velocity
        pose = self.pose
        middle = pose.yaw + 0.5 * w * DT
        self.pose = Pose(pose.stamp + DT, pose.x + v * DT * math.cos(middle),
                         pose.y + v * DT * math.sin(middle), pose.yaw + w * DT, v, w)
        if sees:
            self.look()
        return self.take(self.supervisor.on_pose(self.pose, self.now))

    def teleop(self, wanted, now=None):
        """Let a person command a velocity; return the answer without taking it."""
        return self.supervisor.manual.on_teleop_command(
            wanted, self.now if now is None else now, DT)

    def command(self, velocity, now=None):
        """Let somebody publish a velocity on `cmd_vel`."""
        return self.supervisor.manual.on_external_command(
            velocity, self.now if now is None else now)

    def check(self, pose, clock):
        """Return why a pose is passed over; empty if it counts."""
        return self.supervisor.sensing.inputs.poses.check(pose, clock)

    def is_paused_by(self, reason):
        supervisor, status = self.supervisor, self.supervisor.status
        return (status.state is State.PAUSED and supervisor.trial.pause_reason is reason
                and status.stop_reason is reason and status.reason.startswith(reason.sentence))

    def start(self):
        self.tick()
        assert self.supervisor.start(self.now) == ''
        return self

    def run(self, seconds=60.0):
        end = self.now + seconds
        while self.supervisor.trial.run is not None and self.now < end:
            self.tick()
        return self.supervisor.status


def driving():
    """Return a bench whose robot drives."""
    bench = Bench().start()
    for _ in range(20):
        bench.tick()
    assert bench.velocity[0] > 0.1
    return bench
