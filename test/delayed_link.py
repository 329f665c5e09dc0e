"""A link to the robot that delays: what is said on `<topic>_there` comes late on `<topic>`."""

from contextlib import suppress
import heapq
import itertools
import sys
import time

from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
import rclpy
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from msgs_bridge.node import qos

#: Type, topic it is heard on, topic it is said on, whether it goes to the robot.
WAYS = ((Odometry, 'odom_there', 'odom', False),
        (OccupancyGrid, 'neighbourhood_there', 'neighbourhood', False),
        (Twist, 'cmd_vel', 'cmd_vel_there', True))


class DelayedLink(Node):
    """Passes everything on, `up` seconds late from the robot and `down` seconds late to it."""

    def __init__(self, up: float, down: float) -> None:
        super().__init__('delayed_link')
        self._waiting, self._number = [], itertools.count()
        for kind, heard, said, to_robot in WAYS:
            publisher = self.create_publisher(kind, said, qos.COMMAND if to_robot else 10)
            self.create_subscription(
                kind, heard, lambda msg, publisher=publisher, to_robot=to_robot: heapq.heappush(
                    self._waiting, (time.monotonic() + (down if to_robot else up),
                                    next(self._number), publisher, msg)), qos.SENSOR)
        self.create_timer(0.005, self._pass_on, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _pass_on(self) -> None:
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, publisher, msg = heapq.heappop(self._waiting)
            publisher.publish(msg)


def main() -> None:
    """Relay until the end."""
    # ROS's own handler may end the context in the moment in which this does.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    with suppress(KeyboardInterrupt):
        rclpy.spin(DelayedLink(*map(float, sys.argv[1:3])))
    rclpy.shutdown()


if __name__ == '__main__':
    main()
