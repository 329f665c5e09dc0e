"""The commands of the keys, on their way to controller or robot."""

from collections.abc import Callable
import math
import time
from typing import Any

from geometry_msgs.msg import Twist, TwistStamped

from control_field.robot.limits import STANDSTILL, Velocity
from msgs_bridge.messages.velocities import fill_twist
from msgs_bridge.node import qos
from teleop_node.driving import Driving, RateLimiter
from teleop_node.settings import Settings


class VelocityCommands:
    """
    Publishes what the keys ask for, and the standstill after it.

    Parameters
    ----------
    node : Node
        Whose publisher it is.
    settings : Settings
    stamp : callable
        Returns the stamp of a command.

    """

    def __init__(self, node: Any, settings: Settings, stamp: Callable[[], Any]) -> None:
        """Start silent."""
        self.kind = TwistStamped if settings.is_stamped else Twist
        self.driving = Driving(settings.speeds, settings.hold_time)
        self._rate_limiter = RateLimiter(1.0 / settings.rate)
        self._stamp = stamp
        self._message = self.kind()
        if settings.is_stamped:
            self._message.header.frame_id = settings.base_frame_id
        self._publisher = node.create_publisher(self.kind, settings.topic, qos.COMMAND)

    def drive(self, now: float) -> None:
        """Send what is due."""
        command = self._rate_limiter.limit(self.driving.command(now), now)
        if command is not None:
            self._send(command)

    def _send(self, velocity: Velocity) -> None:
        fill_twist(self._message, *velocity)
        if self.kind is TwistStamped:
            self._message.header.stamp = self._stamp()
        self._publisher.publish(self._message)

    def halt(self) -> None:
        """Let go of whatever is held, and tell the robot so."""
        self.driving.stop(time.monotonic())

    def let_go(self) -> None:
        """Stop driving; who does not drive stays silent, and takes no trial over."""
        if self.driving.command(time.monotonic()) is not None:
            self.halt()

    def stand_still(self, patience: Any) -> None:
        """
        Stop the robot and see that it gets to know, before this process pauses or ends.

        Parameters
        ----------
        patience : Duration
            Longest wait for that.

        """
        speaks = self.driving.command(time.monotonic()) is not None
        self.driving.stop(-math.inf)
        if speaks:
            self._send(STANDSTILL)
            self._publisher.wait_for_all_acked(patience)
