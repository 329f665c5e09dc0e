"""Velocity commands: Twist and TwistStamped."""

import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist, TwistStamped


def velocity_from_twist(msg: Any) -> tuple[float, float]:
    """
    Read a Twist or TwistStamped message.

    Parameters
    ----------
    msg : Twist or TwistStamped
        What arrived; a differential drive has no use for the other four components.

    Returns
    -------
    v, w : float, [m/s, rad/s]
        Forward and turning speed.

    Raises
    ------
    ValueError
        If one of the six components is not finite.

    """
    twist = getattr(msg, 'twist', msg)
    linear, angular = twist.linear, twist.angular
    components = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    if not all(map(math.isfinite, components)):
        raise ValueError(f'cmd_vel: velocity is {components}, must be finite')
    return linear.x, angular.z


def fill_twist(msg: Any, v: float, w: float) -> None:
    """
    Write a velocity into a Twist or TwistStamped message that is used again and again.

    Raises
    ------
    ValueError
        If it is not finite; the message is left as it was.

    """
    if not (math.isfinite(v) and math.isfinite(w)):
        raise ValueError(f'cmd_vel: velocity is ({v}, {w}), must be finite')
    twist = getattr(msg, 'twist', msg)
    twist.linear.x = float(v)
    twist.angular.z = float(w)


def twist_from_velocity(v: float, w: float) -> Twist:
    """Return a new Twist message."""
    msg = Twist()
    fill_twist(msg, v, w)
    return msg


def twist_stamped_from_velocity(
    v: float, w: float, stamp: Time, frame_id: str = 'base_footprint',
) -> TwistStamped:
    """Return a new TwistStamped message; ``stamp`` is copied as it is."""
    msg = TwistStamped()
    msg.header.stamp = stamp
    msg.header.frame_id = frame_id
    fill_twist(msg, v, w)
    return msg
