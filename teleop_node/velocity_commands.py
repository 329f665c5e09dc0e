"""The commands of the keys, on their way to controller or robot."""

from collections.abc import Callable
import math
import time
from typing import Any

from msgs_bridge.teaching.velocity_publisher import VelocityPublisher
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
        self.driving = Driving(settings.speeds, settings.hold_time)
        self._rate_limiter = RateLimiter(1.0 / settings.rate)
        self._publisher = VelocityPublisher(
            node, settings.topic, stamp if settings.is_stamped else None, settings.base_frame_id)
        self.kind = self._publisher.kind

    def drive(self, now: float) -> None:
        """Send what is due."""
        command = self._rate_limiter.limit(self.driving.command(now), now)
        if command is not None:
            self._publisher.send(command)

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
            self._publisher.stand_still(patience)
