import math

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from control_field.robot.limits import Limits, STANDSTILL, within_acceleration
from control_field.robot.steering import approach_speed, Segment, steer, wrapped

BURGER = Limits()
TURTLEBOT4 = Limits(v_max=0.31, w_max=1.9, a_max=0.9, alpha_max=3.0, radius=0.17)
SMALL = Limits(v_max=0.1, w_max=2.0, a_max=1.0, alpha_max=5.0, radius=0.05)

coordinates = st.floats(-5.0, 5.0)
angles = st.floats(-10.0, 10.0)


def drive(x, y, yaw, segment, limits, *, delay=1, dt=0.05, reach=0.0125, seconds=20.0):
    """Drive a segment in closed loop; return its duration and the greatest cross-track error."""
    velocity, way, off, t = (0.0, 0.0), [(0.0, 0.0)] * delay, 0.0, 0.0
    while segment.remaining(x, y) > reach:
        assert t < seconds, f'at ({x}, {y}) after {t} s'
        velocity = within_acceleration(steer(x, y, yaw, segment, limits), velocity, dt, limits)
        way.append(velocity)
        v, w = way.pop(0)
        x, y = x + v * dt * math.cos(yaw + 0.5 * w * dt), y + v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw, t = yaw + w * dt, t + dt
        off = max(off, abs(segment.lateral(x, y)))
    return t, off, (x, y)


@pytest.mark.parametrize('limits', [BURGER, TURTLEBOT4, SMALL])
@pytest.mark.parametrize('delay', [0, 1, 2])
@pytest.mark.parametrize('eighths', range(-4, 5))
def test_an_exact_segment_is_kept_to_a_centimetre_from_every_heading(limits, delay, eighths):
    for cell in (0.15, 0.25, 1.0):
        segment = Segment(1.0, 2.0, 1.0 + cell, 2.0, True)
        _, off, _ = drive(1.0, 2.0, eighths * math.pi / 4, segment, limits, delay=delay)
        assert off < 0.01


@pytest.mark.parametrize('limits', [BURGER, TURTLEBOT4, SMALL])
@pytest.mark.parametrize('eighths', range(-4, 5))
def test_an_open_segment_arrives_at_its_end(limits, eighths):
    segment = Segment(0.0, 0.0, 0.25, 0.25, False)
    _, _, (x, y) = drive(0.0, 0.0, eighths * math.pi / 4, segment, limits, reach=0.05)
    assert math.hypot(x - 0.25, y - 0.25) < 0.12


def test_a_robot_off_the_line_comes_back_to_it():
    segment = Segment(0.0, 0.0, 1.5, 0.0, True)
    _, _, (_, y) = drive(0.0, 0.05, 0.0, segment, BURGER)
    assert abs(y) < 0.002


def test_a_straight_is_driven_at_nearly_full_speed():
    seconds, _, _ = drive(0.0, 0.0, 0.0, Segment(0.0, 0.0, 2.0, 0.0, True), BURGER)
    assert 2.0 / seconds > 0.2


@given(coordinates, coordinates, angles, coordinates, coordinates, st.booleans())
def test_never_backwards_and_never_too_fast(x, y, yaw, bx, by, exact):
    v, w = steer(x, y, yaw, Segment(0.0, 0.0, bx, by, exact), BURGER)
    assert 0.0 <= v <= BURGER.v_max
    assert abs(w) <= BURGER.w_max


@given(coordinates, coordinates, angles, coordinates, coordinates, angles, st.booleans())
def test_turning_the_world_changes_nothing(x, y, yaw, bx, by, turn, exact):
    def turned(px, py):
        return (px * math.cos(turn) - py * math.sin(turn),
                px * math.sin(turn) + py * math.cos(turn))

    # Neither a segment of no length nor the way to where one stands has a direction.
    assume(math.hypot(bx, by) > 1e-3 and math.hypot(x - bx, y - by) > 1e-3)
    segment = Segment(0.0, 0.0, bx, by, exact)
    first = steer(x, y, yaw, segment, BURGER)
    second = steer(*turned(x, y), yaw + turn, Segment(0.0, 0.0, *turned(bx, by), exact), BURGER)
    # Straight behind, left and right are a rounding error apart.
    if first[1] == pytest.approx(second[1], abs=1e-6):
        assert first[0] == pytest.approx(second[0], abs=1e-6)
    else:
        assert abs(first[1]) == pytest.approx(abs(second[1]), abs=1e-6)


@given(st.floats(-1.0, 10.0), st.floats(0.01, 3.0), st.floats(0.1, 5.0), st.floats(1.0, 8.0))
def test_what_remains_is_enough_to_brake(remaining, top, acceleration, gain):
    speed = approach_speed(remaining, top, acceleration, gain)
    assert 0.0 <= speed <= top
    assert speed ** 2 / (2.0 * acceleration) <= max(remaining, 0.0) + 1e-12


@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_farther_is_never_slower(first, second):
    near, far = sorted((first, second))
    assert approach_speed(near, 0.22, 2.0, 6.0) <= approach_speed(far, 0.22, 2.0, 6.0)


def test_near_the_end_speed_is_in_proportion_and_further_away_it_brakes_at_a_constant_rate():
    assert approach_speed(0.01, 9.0, 2.0, 6.0) == pytest.approx(0.06)
    speeds = [approach_speed(remaining, 9.0, 2.0, 6.0) for remaining in (0.3, 0.5)]
    assert speeds[1] ** 2 - speeds[0] ** 2 == pytest.approx(2.0 * 2.0 * 0.2)
    knee = 2.0 / 36.0
    assert approach_speed(knee + 1e-9, 9.0, 2.0, 6.0) == pytest.approx(6.0 * knee)


@given(coordinates, coordinates)
def test_on_an_open_segment_the_robot_looks_to_its_end_wherever_it_is(x, y):
    assume(math.hypot(x - 1.0, y - 2.0) > 0.01)
    way = math.atan2(2.0 - y, 1.0 - x)
    assert steer(x, y, way, Segment(0.0, 0.0, 1.0, 2.0, False), BURGER)[1] == pytest.approx(
        0.0, abs=1e-9)


@pytest.mark.parametrize('exact', [True, False])
def test_who_looks_the_other_way_turns_on_the_spot(exact):
    v, w = steer(0.0, 0.0, 2.0, Segment(0.0, 0.0, 1.0, 0.0, exact), BURGER)
    assert v == 0.0
    assert w < 0.0


def test_a_standstill_is_one():
    assert STANDSTILL == (0.0, 0.0)


@given(st.floats(-100.0, 100.0))
def test_a_wrapped_angle_is_the_same_angle(angle):
    assert -math.pi <= wrapped(angle) <= math.pi
    assert math.cos(wrapped(angle)) == pytest.approx(math.cos(angle), abs=1e-9)


def test_a_segment_of_no_length_is_over():
    segment = Segment(1.0, 1.0, 1.0, 1.0, True)
    assert segment.remaining(5.0, 5.0) == segment.lateral(5.0, 5.0) == 0.0
    assert steer(1.0, 1.0, 0.3, segment, BURGER)[0] == 0.0


@given(coordinates, coordinates)
def test_remaining_and_lateral_are_coordinates_along_a_segment(x, y):
    segment = Segment(1.0, 2.0, 1.3, 2.4, False)
    remaining, lateral, heading = segment.remaining(x, y), segment.lateral(x, y), segment.heading()
    along = 0.5 - remaining
    assert 1.0 + along * math.cos(heading) - lateral * math.sin(heading) == pytest.approx(x)
    assert 2.0 + along * math.sin(heading) + lateral * math.cos(heading) == pytest.approx(y)


@pytest.mark.parametrize(('name', 'value'), [
    ('v_max', 0.0), ('w_max', -1.0), ('a_max', math.nan), ('alpha_max', math.inf),
    ('radius', -0.1)])
def test_limits_that_are_none_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        Limits(**{name: value})
