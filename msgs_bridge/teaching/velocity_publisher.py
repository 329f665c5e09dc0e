"""A person's commands, on their way to controller or robot."""

from collections.abc import Callable
from typing import Any, Protocol

from geometry_msgs.msg import Twist, TwistStamped

from control_field.robot.limits import STANDSTILL, Velocity
from msgs_bridge.messages.velocities import fill_twist
from msgs_bridge.node import qos


class Commands(Protocol):
    """What a person holds, keys or pad, and how it is let go of."""

    def halt(self) -> None:
        """Let go of whatever is held, and tell the robot so."""

    def let_go(self) -> None:
        """Stop driving; who does not drive stays silent, and takes no trial over."""


class VelocityPublisher:
    """
    Publishes velocities as Twist or TwistStamped.

    Parameters
    ----------
    node : Node
        Whose publisher it is.
    topic : str
    stamp : callable or None
        Returns the stamp of a command; None to publish Twist.
    base_frame_id : str
        Frame written into stamped commands.

    """

    def __init__(
        self, node: Any, topic: str, stamp: Callable[[], Any] | None, base_frame_id: str,
    ) -> None:
        """Send nothing yet."""
        self.kind = Twist if stamp is None else TwistStamped
        self._stamp = stamp
        self._message = self.kind()
        if stamp is not None:
            self._message.header.frame_id = base_frame_id
        self._publisher = node.create_publisher(self.kind, topic, qos.COMMAND)

    def send(self, velocity: Velocity) -> None:
        """Publish a velocity, [m/s] and [rad/s]."""
        fill_twist(self._message, *velocity)
        if self._stamp is not None:
            self._message.header.stamp = self._stamp()
        self._publisher.publish(self._message)

    def stand_still(self, patience: Any) -> None:
        """
        Stop the robot and see that it gets to know, before this process pauses or ends.

        Parameters
        ----------
        patience : Duration
            Longest wait for that.

        """
        self.send(STANDSTILL)
        self._publisher.wait_for_all_acked(patience)
