import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.grid import Grid
from control_field.records import Outcome
from control_field.robot.stop_rules import (
    is_lost, PoseMonitor, ProgressChecker, StopReason, StopRules, Timeout)
from control_field.robot.suspension import Suspension
from control_field_node.settings import Settings

GRID = Grid(20, 20, 0.25)
RULES = StopRules()
commands = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@pytest.mark.parametrize('reason', StopReason)
def test_every_reason_has_a_sentence_of_its_own(reason):
    assert reason.sentence[0].islower()
    assert not reason.sentence.endswith('.')
    assert sum(other.sentence == reason.sentence for other in StopReason) == 1


@pytest.mark.parametrize('reason', StopReason)
def test_no_reason_to_stop_is_a_success(reason):
    assert reason.outcome is not Outcome.GOAL


def test_what_never_came_is_stale():
    assert Timeout(0.5).is_stale(0.0)


@given(st.floats(0.05, 10.0), st.floats(0.0, 1e6), st.floats(0.0, 20.0))
def test_a_message_is_stale_after_its_timeout(seconds, arrived, age):
    timeout = Timeout(seconds)
    timeout.on_arrival(arrived)
    assert timeout.is_stale(arrived + age) == (arrived + age - arrived > seconds)


def pose_monitor(*, stamp=10.0, x=1.0, y=1.0):
    monitor = PoseMonitor(RULES)
    assert monitor.observe(stamp, x, y, GRID) is None
    return monitor


def test_a_clock_that_goes_back_is_told():
    assert pose_monitor().observe(9.0, 1.0, 1.0, GRID) is StopReason.CLOCK_JUMPED_BACK


def test_the_same_stamp_again_is_no_clock_that_goes_back():
    assert pose_monitor().observe(10.0, 1.0, 1.0, GRID) is None


def test_the_first_pose_is_not_taken_for_a_repeated_one():
    assert not PoseMonitor(RULES).is_repeated(1.0)


def test_after_a_clock_went_back_the_new_time_counts():
    monitor = pose_monitor()
    monitor.observe(2.0, 1.0, 1.0, GRID)
    assert monitor.observe(2.05, 1.0, 1.0, GRID) is None


def test_a_jump_is_told_and_driving_is_not():
    assert pose_monitor().observe(10.05, 1.0, 1.2, GRID) is StopReason.POSE_JUMPED
    assert pose_monitor().observe(10.05, 1.0, 1.011, GRID) is None
    assert pose_monitor().observe(20.0, 3.0, 1.0, GRID) is None


def test_a_heading_that_leaps_is_a_frame_that_turns():
    assert pose_monitor().observe(10.05, 1.0, 1.0, GRID, yaw=0.6) is StopReason.POSE_JUMPED
    assert pose_monitor().observe(10.05, 1.0, 1.0, GRID, yaw=-0.5) is None
    assert pose_monitor().observe(10.05, 1.0, 1.0, GRID, yaw=6.2) is None
    assert pose_monitor().observe(11.0, 1.0, 1.0, GRID, yaw=3.1) is None


def test_a_robot_that_turns_fast_may():
    assert Settings(w_max=20.0).rules.w_max == 20.0
    for rules, found in ((RULES, StopReason.POSE_JUMPED), (StopRules(w_max=20.0), None)):
        monitor = PoseMonitor(rules)
        monitor.observe(10.0, 1.0, 1.0, GRID)
        assert monitor.observe(10.05, 1.0, 1.0, GRID, yaw=1.0) is found


def test_who_is_placed_has_not_jumped_but_a_clock_set_back_is_told():
    monitor = pose_monitor()
    monitor.place_anew()
    assert monitor.observe(10.05, 3.0, 1.0, GRID) is None
    assert monitor.observe(10.1, 1.0, 1.0, GRID) is StopReason.POSE_JUMPED
    monitor.place_anew()
    assert monitor.observe(9.0, 1.0, 1.0, GRID) is StopReason.CLOCK_JUMPED_BACK


def test_outside_is_told():
    monitor = pose_monitor(x=4.99)
    assert monitor.observe(10.05, 5.0, 1.0, GRID) is StopReason.OUTSIDE_WORKSPACE


def test_where_odometry_is_mended_the_mended_place_counts():
    monitor = pose_monitor(x=4.99)
    assert monitor.observe(10.05, 5.0, 1.0, GRID, (4.9, 1.0)) is None
    assert monitor.observe(10.1, 5.0, 1.0, GRID, (5.1, 1.0)) is StopReason.OUTSIDE_WORKSPACE


@pytest.mark.parametrize(('stamp', 'repeated'), [
    (10.0, True), (9.9, True), (9.4, False), (10.05, False)])
def test_duplicates_and_late_ones_are_passed_over(stamp, repeated):
    monitor = pose_monitor()
    assert [monitor.is_repeated(stamp) for _ in range(2)] == [repeated] * 2


def told(monitor, stamps, place, n_steps=lambda t: 0, speed=0.0):
    """Return when which reason came first."""
    for t in stamps:
        reason = monitor.observe(t, *place(t), n_steps(t), speed)
        if reason is not None:
            return t, reason
    return None


def seconds(n, dt=0.5):
    return [dt * k for k in range(int(n / dt) + 1)]


def test_a_robot_that_only_turns_makes_no_progress():
    assert told(ProgressChecker(RULES), seconds(60), lambda t: (1.0, 1.0, t)) == (
        10.5, StopReason.NO_PROGRESS)


def test_circling_in_a_small_place_is_no_progress():
    def place(t):
        return 1.0 + 0.2 * math.cos(t), 1.0 + 0.2 * math.sin(t), t

    assert told(ProgressChecker(RULES), seconds(60), place, speed=0.2) == (
        10.5, StopReason.NO_PROGRESS)


def test_slow_but_far_enough_is_progress():
    assert told(ProgressChecker(RULES), seconds(60), lambda t: (0.06 * t, 1.0, 0.0)) is None


def test_a_step_is_progress():
    assert told(ProgressChecker(RULES), seconds(60), lambda t: (1.0, 1.0, t),
                n_steps=lambda t: int(t / 9)) is None


def test_told_to_drive_and_not_moving_is_a_stall():
    assert told(ProgressChecker(RULES), seconds(60), lambda t: (1.0, 1.0, 0.0), speed=0.1) == (
        2.5, StopReason.STALLED)


def test_which_way_it_looks_does_not_hide_a_stall():
    assert told(ProgressChecker(RULES), seconds(60), lambda t: (1.0, 1.0, 2.0), speed=0.1) == (
        2.5, StopReason.STALLED)


def test_who_corrects_its_heading_against_an_obstacle_is_stalled_all_the_same():
    assert told(ProgressChecker(RULES), seconds(60), speed=0.1, place=lambda t: (
        1.0, 1.0, 0.08 * math.sin(3.0 * t))) == (2.5, StopReason.STALLED)


def test_who_is_told_to_stand_is_not_stalled():
    assert told(ProgressChecker(RULES), seconds(5), lambda t: (1.0, 1.0, 0.0)) is None


def test_the_time_limit_counts_from_the_first_pose():
    monitor = ProgressChecker(StopRules(time_limit=4.0))
    assert told(monitor, [100.0 + t for t in seconds(9)], lambda t: (1.0, 1.0, t)) == (
        104.5, StopReason.TIME_LIMIT)


@pytest.mark.parametrize('leap', [3.0, 500.0, 1e9])
def test_a_clock_that_is_set_forward_stops_nobody(leap):
    stamps = [t + (leap if t > 3.0 else 0.0) for t in seconds(6)]

    def place(t):
        return 0.2 * (t if t <= 3.0 else t - leap), 1.0, 0.0

    assert told(ProgressChecker(RULES), stamps, place, speed=0.2) is None


def test_a_robot_that_stands_is_found_after_a_clock_was_set_forward():
    stamps = [t + (500.0 if t > 1.0 else 0.0) for t in seconds(6)]
    stamp, reason = told(ProgressChecker(RULES), stamps, lambda t: (1.0, 1.0, 0.0), speed=0.1)
    assert reason is StopReason.STALLED
    assert 503.0 < stamp < 504.5


def test_turning_is_no_stall():
    assert told(ProgressChecker(RULES), seconds(5), lambda t: (1.0, 1.0, t), speed=0.1) is None


def test_a_pause_starts_progress_anew_but_not_the_time_limit():
    monitor = ProgressChecker(StopRules(time_limit=20.0))
    assert told(monitor, seconds(9), lambda t: (1.0, 1.0, t)) is None
    monitor.restart()
    assert told(monitor, [9.0 + t for t in seconds(10)], lambda t: (1.0, 1.0, t)) is None
    monitor.restart()
    assert told(monitor, [19.0 + t for t in seconds(10)], lambda t: (1.0, 1.0, t)) == (
        20.5, StopReason.TIME_LIMIT)


@pytest.mark.parametrize(('coherence', 'supported', 'q', 'lost'), [
    (0.01, False, 0.0, True), (0.01, True, 0.0, False), (0.01, False, -0.5, False),
    (0.5, False, 0.0, False)])
def test_the_field_is_lost_only_where_nothing_speaks_for_it(coherence, supported, q, lost):
    assert is_lost(coherence, supported, abs(q), 0.05) == lost


def test_what_arrives_and_does_not_count_is_not_called_absent():
    timeout = Timeout(0.5)
    assert timeout.absence(5.0, 'odometry') == 'no odometry has arrived yet'
    timeout.pass_over(5.0, 'it is upside down')
    assert timeout.absence(5.1, 'odometry') == (
        'odometry arrives but does not count: it is upside down')
    assert timeout.absence(9.0, 'odometry') == 'no odometry has arrived for 4.0 s'
    timeout.on_arrival(9.5)
    assert not timeout.is_ignored(9.5)
    assert timeout.absence(11.0, 'odometry') == 'no odometry has arrived for 1.5 s'


@pytest.mark.parametrize(('arrived', 'said'), [
    (2.0, 'read for 10.0 s, of which this program itself stood still for 8.0 s'),
    (6.0, 'read for 6.0 s, of which this program itself stood still for 5.0 s')])
def test_what_this_program_itself_slept_through_is_not_called_absent(arrived, said):
    suspension = Suspension()
    timeout = Timeout(0.5, suspension)
    suspension.look(3.0)
    timeout.on_arrival(arrived)
    assert suspension.look(11.0) == 8.0
    suspension.look(11.5)
    assert timeout.absence(12.0, 'odometry') == f'no odometry has been {said}'
    timeout.on_arrival(10.5)
    assert timeout.absence(12.0, 'odometry') == 'no odometry has arrived for 1.5 s'
