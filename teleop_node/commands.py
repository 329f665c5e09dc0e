"""The commands of the keys, on their way to controller or robot."""

from collections.abc import Callable
import math
import time
from typing import Any, Final

from geometry_msgs.msg import Twist, TwistStamped

from control_field.robot.limits import STANDSTILL, Velocity
from msgs_bridge.messages.velocities import fill_twist
from msgs_bridge.node import qos
from teleop_node.driving import Driving, Pace
from teleop_node.settings import Settings

#: Longest wait for the standstill to arrive before this process pauses or ends, [s].
_STANDSTILL_TIME: Final = 0.2


class Commands:
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
        self._pace = Pace(1.0 / settings.rate)
        self._stamp = stamp
        self._message = self.kind()
        if settings.is_stamped:
            self._message.header.frame_id = settings.base_frame_id
        self._publisher = node.create_publisher(self.kind, settings.topic, qos.COMMAND)

    def drive(self, now: float) -> None:
        """Send what is due."""
        command = self.driving.command(now)
        if self._pace.is_due(command, now) and command is not None:
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

    def stand_still(self, patience: Callable[[float], Any]) -> None:
        """
        Stop the robot and see that it gets to know, before this process pauses or ends.

        Parameters
        ----------
        patience : callable
            Makes the middleware's duration of a time, [s].

        """
        speaks = self.driving.command(time.monotonic()) is not None
        self.driving.stop(-math.inf)
        if speaks:
            self._send(STANDSTILL)
            self._publisher.wait_for_all_acked(patience(_STANDSTILL_TIME))
