"""Arrows for a page, a process of its own: ``python -m benchmarks.page_arrows``."""

from dataclasses import replace
from itertools import count
from typing import Any, Final

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from experience_evaluation.teachers import demonstration_from_path
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.node import qos

#: Rows and columns, and how often they come, [1/s].
_SIDE: Final = 20
_RATE: Final = 20.0


def arrows() -> None:
    """Publish a field again and again, each time a new one."""
    parameters = Parameters()
    learner = Learner(Grid(_SIDE, _SIDE, 0.25), parameters)
    learner.add_demonstration(demonstration_from_path(
        GridWorld(np.zeros((_SIDE, _SIDE), np.int8), parameters),
        [(n, n) for n in range(_SIDE)], 1))
    field = learner.trial_field(exploring=False)
    rclpy.init(args=[])
    node: Any = Node('page_arrows')
    publisher = node.create_publisher(PointCloud2, 'control_field', qos.LATCHED)
    revisions = count()
    node.create_timer(1.0 / _RATE, lambda: publisher.publish(
        cloud_from_field(replace(field, revision=next(revisions)))))
    rclpy.spin(node)


if __name__ == '__main__':
    arrows()
