"""Velocity commands, stamped or not."""

import math

from geometry_msgs.msg import Twist, TwistStamped
from hypothesis import given
from hypothesis import strategies as st
import pytest

from msgs_bridge.messages.poses import stamp_from_seconds
from msgs_bridge.messages.velocities import (
    fill_twist, twist_from_velocity, twist_stamped_from_velocity, velocity_from_twist)

speeds = st.floats(-10, 10)


@given(speeds, speeds)
def test_round_trip(v, w):
    assert velocity_from_twist(twist_from_velocity(v, w)) == (v, w)
    stamped = twist_stamped_from_velocity(v, w, stamp_from_seconds(1.25), 'base_link')
    assert stamped.header.frame_id == 'base_link'
    assert velocity_from_twist(stamped) == (v, w)
    assert (stamped.header.stamp.sec, stamped.header.stamp.nanosec) == (1, 250_000_000)


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('make', [Twist, TwistStamped])
def test_what_is_not_finite_is_neither_read_nor_written(make, bad):
    msg = make()
    fill_twist(msg, 0.1, 0.2)
    for velocity in ((bad, 0.0), (0.0, bad)):
        with pytest.raises(ValueError, match=r'cmd_vel: velocity is .* must be finite'):
            fill_twist(msg, *velocity)
    assert velocity_from_twist(msg) == (0.1, 0.2)
    getattr(msg, 'twist', msg).linear.y = bad
    with pytest.raises(ValueError, match='must be finite'):
        velocity_from_twist(msg)
