"""Writing `cmd_vel`: one message is reused, and what comes back of our own is known."""

from collections.abc import Callable
import math
import struct
import time
from typing import Any, Final

from geometry_msgs.msg import Twist, TwistStamped

from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.takeover import OwnCommands
from control_field_node.commands.lockstep import key_of, TickBook
from control_field_node.settings import Settings
from msgs_bridge.messages.velocities import fill_twist

#: Layout of serialized messages: encapsulation, then a TwistStamped's stamp; a Twist at the end.
_ENCAPSULATION: Final = 4
_LITTLE_ENDIAN: Final = b'\x00\x01'
_STAMP: Final = struct.Struct('<iI')
_TWIST: Final = struct.Struct('<6d')
_TWIST_SIZE: Final = _TWIST.size


class CommandWriter:
    """
    Writes commands, in lock-step one a tick.

    Parameters
    ----------
    settings : Settings
        Which type, which frame, whether in lock-step.
    book : TickBook
        Which tick is open.
    now : callable
        Returns the Time to stamp a command with that answers nothing.

    Attributes
    ----------
    kind : type
        Twist or TwistStamped.
    publish : callable
        Publishes a message; set once there is a publisher.
    sent_at : float, [s]
        Steady time of the last one.

    """

    def __init__(self, settings: Settings, book: TickBook, now: Callable[[], Any]) -> None:
        """Prepare the message."""
        self.kind = TwistStamped if settings.is_stamped else Twist
        self.publish: Callable[[Any], None] = lambda _: None
        self._lockstep = settings.lockstep
        self._book = book
        self._now = now
        self._own = OwnCommands()
        self.sent_at = -math.inf
        self._msg = self.kind()
        if settings.is_stamped:
            self._msg.header.frame_id = settings.base_frame_id

    def send(self, velocity: Velocity, odometry: Any) -> None:
        """Send a command in answer to odometry; in lock-step not twice to the same."""
        if self._lockstep and odometry is not None:
            if self._book.is_answered(odometry):
                self._book.owes_stop = velocity == STANDSTILL
                return
            self._book.mark_answered(odometry)
        self.send_now(velocity, odometry)

    def send_now(self, velocity: Velocity, odometry: Any) -> None:
        """Send a command with the stamp of odometry, or of now where there is none."""
        fill_twist(self._msg, *velocity)
        if self.kind is TwistStamped:
            self._msg.header.stamp = self._now() if odometry is None else odometry.header.stamp
        self.sent_at = time.monotonic()
        self._own.sent(*_stamp_of(self._msg), *velocity)
        self.publish(self._msg)

    @property
    def odometry(self) -> Any:
        """Return the newest odometry; None before the first."""
        return self._book.odometry

    def acknowledge(self, msg: Any, velocity: Velocity) -> bool:
        """Take in a message; return whether it was sent here: each comes back once."""
        return self._acknowledge(*_stamp_of(msg), *velocity)

    def acknowledge_raw(self, message: bytes) -> bool:
        """Do the same with a message's bytes."""
        if len(message) < _TWIST_SIZE + _ENCAPSULATION or message[:2] != _LITTLE_ENDIAN:
            return False
        stamp = _STAMP.unpack_from(message, _ENCAPSULATION) if self.kind is TwistStamped else ()
        twist = _TWIST.unpack_from(message, len(message) - _TWIST_SIZE)
        return self._acknowledge(*stamp, twist[0], twist[5])

    def _acknowledge(self, *command: float) -> bool:
        is_own = self._own.is_own(*command)
        if is_own:
            self._own.forget(*command)
        return is_own


def _stamp_of(msg: Any) -> tuple[int, ...]:
    return key_of(msg) if hasattr(msg, 'header') else ()
