"""
What `ros2 run` starts: the nodes' `main`, with a quiet end while Python is still importing.

Importing rclpy and NumPy takes some tenths of a second, seconds on a busy robot. Who presses
Ctrl-C in that time, or stops a launch file, needs no message.
"""

import importlib
import os
import signal
from types import FrameType

from msgs_bridge.node.environment import ENDING_SIGNALS


def sim_node() -> None:
    """Run the simulated robot."""
    _run('sim_node.node')


def control_field_node() -> None:
    """Run the controller."""
    _run('control_field_node.node')


def learner_node() -> None:
    """Run the learner."""
    _run('learner_node.node')


def teleop_node() -> None:
    """Run the keyboard teleoperation."""
    _run('teleop_node.node')


def neighbourhood_node() -> None:
    """Run the local grid of a robot with a laser or a costmap."""
    _run('neighbourhood_node.node')


def localised_odometry_node() -> None:
    """Run the odometry of a robot that is localised in a map."""
    _run('localised_odometry_node.node')


def page_node() -> None:
    """Run the page to teach from."""
    _run('page_node.node')


def _run(module: str) -> None:
    """Import a node and run its `main`, which installs signal handlers of its own."""
    for number in ENDING_SIGNALS:
        # With nohup the end of the terminal is nobody's end.
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _leave)
    importlib.import_module(module).main()


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit at once: nothing is open yet, and an exception would print a traceback."""
    os._exit(0)
