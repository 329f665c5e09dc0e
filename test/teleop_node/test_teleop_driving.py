"""Hold to move: the robot stands 0.3 s after the last key, whatever was pressed before."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.robot.limits import STANDSTILL
from teleop_node.driving import changed_speeds, Driving, LINGER, MOVES, RateLimiter, SLOWEST

SPEEDS = (0.2, 1.0)
HOLD = 0.3

moves = st.sampled_from(sorted(MOVES))
gaps = st.floats(0.0, 1.0)


def driving():
    return Driving(SPEEDS, HOLD)


@pytest.mark.parametrize(('key', 'velocity'), [
    ('i', (0.2, 0.0)), (',', (-0.2, 0.0)), ('j', (0.0, 1.0)), ('l', (0.0, -1.0)),
    ('u', (0.2, 1.0)), ('o', (0.2, -1.0)), ('m', (-0.2, -1.0)), ('.', (-0.2, 1.0)),
    ('k', (0.0, 0.0))])
def test_the_letters_of_teleop_twist_keyboard(key, velocity):
    drive = driving()
    drive.press(key, 7.0)
    assert drive.velocity(7.0) == velocity


def test_silent_before_the_first_key():
    assert driving().command(0.0) is None
    assert driving().velocity(1e9) == STANDSTILL


@given(st.lists(st.tuples(moves, gaps), min_size=1), st.floats(0.0, 5.0))
def test_it_stands_when_the_last_key_is_old(pressed, later):
    drive, now = driving(), 100.0
    for key, gap in pressed:
        now += gap
        drive.press(key, now)
    shares = MOVES[pressed[-1][0]]
    held = (shares[0] * SPEEDS[0], shares[1] * SPEEDS[1])
    age = now + later - now  # as the arithmetic has it
    assert drive.velocity(now + later) == (held if age < HOLD else STANDSTILL)
    command = drive.command(now + later)
    assert command == (None if age >= HOLD + LINGER else drive.velocity(now + later))


@given(st.lists(moves), gaps)
def test_stop_stops_at_once_and_says_so_for_a_while(keys, later):
    drive = driving()
    for key in keys:
        drive.press(key, 3.0)
    drive.stop(3.0)
    assert drive.velocity(3.0 + later) == STANDSTILL
    assert drive.command(3.0) == STANDSTILL
    assert drive.command(3.0 + LINGER + 0.01) is None


def test_the_repeats_of_a_terminal_keep_it_going():
    drive = driving()
    drive.press('i', 0.0)
    for k in range(30):  # first repeat after 0.25 s, then 30 a second
        drive.press('i', 0.25 + k / 30)
        assert drive.velocity(0.25 + k / 30 + 0.03) == (0.2, 0.0)


@given(st.lists(st.sampled_from('qzwxec')))
def test_speeds_stay_within_what_is_allowed(keys):
    speeds, greatest = SPEEDS, (0.22, 2.84)
    for key in keys:
        speeds = changed_speeds(key, speeds, greatest)
    for speed, least, most in zip(speeds, SLOWEST, greatest, strict=True):
        assert least <= speed <= most


@pytest.mark.parametrize(('key', 'factors'), [
    ('q', (1.1, 1.1)), ('z', (0.9, 0.9)), ('w', (1.1, 1)), ('x', (0.9, 1)), ('e', (1, 1.1)),
    ('c', (1, 0.9))])
def test_faster_and_slower(key, factors):
    assert changed_speeds(key, (0.1, 1.0), (1.0, 2.0)) == pytest.approx(
        (0.1 * factors[0], 1.0 * factors[1]))


class TestRateLimiter:
    def test_a_change_goes_out_at_once_and_the_rest_at_the_rate(self):
        limiter, sent = RateLimiter(0.05), []
        for k in range(100):  # looked at every 20 ms: moves for 1 s, stands for 0.5 s, is silent
            now = 0.02 * k
            command = (0.2, 0.0) if k < 50 else STANDSTILL if k < 75 else None
            if limiter.limit(command, now) is not None:
                sent.append((now, command))
        assert sent[0] == (0.0, (0.2, 0.0))
        assert (1.0, STANDSTILL) in sent
        moving = [time for time, command in sent if command == (0.2, 0.0)]
        assert len(moving) == pytest.approx(20, abs=1)
        assert sent[-1][0] < 1.5

    def test_after_a_pause_there_is_no_rush(self):
        limiter = RateLimiter(0.05)
        assert limiter.limit(STANDSTILL, 0.0) == STANDSTILL
        assert limiter.limit(STANDSTILL, 5.0)
        assert limiter.limit(STANDSTILL, 5.01)  # at most one that was missed
        assert limiter.limit(STANDSTILL, 5.02) is None
