"""What the controller says of itself: what is wrong is a warning, and names what mends it."""

import dataclasses

from diagnostic_msgs.msg import DiagnosticStatus

from control_field_node.diagnostics import diagnostic_from_supervisor
from control_field_node.driving.manual_control import UNMONITORED
from controller_bench import Bench, driving, DT, GOAL
from controller_helpers import GRID, straight_field


def diagnostic(bench):
    return diagnostic_from_supervisor(bench.supervisor, '/control_field_node')


def is_warning(bench):
    return diagnostic(bench).level == DiagnosticStatus.WARN


def elsewhere(bench):
    """Let odometry come in a robot's own frame."""
    bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT, frame_id='r2/odom')
    bench.take(bench.supervisor.on_pose(bench.pose, bench.now))
    bench.pose = dataclasses.replace(bench.pose, frame_id='odom')


def test_odometry_in_another_frame_is_a_warning_and_the_answer_to_a_start():
    bench = Bench()
    elsewhere(bench)
    remedy = '(set frame_id:=r2/odom of learner_node and neighbourhood_node)'
    assert is_warning(bench)
    assert remedy in diagnostic(bench).message
    assert remedy in bench.supervisor.start(bench.now)
    assert "frame is 'r2/odom', must be 'odom'" in bench.supervisor.start(bench.now)
    bench.tick()
    assert not is_warning(bench)
    assert bench.supervisor.start(bench.now) == ''


def test_odometry_that_is_no_place_is_one_too():
    bench = Bench()
    bench.tick()
    bench.supervisor.on_bad_odometry('odom: position is nan', bench.now)
    assert diagnostic(bench).message == 'odometry refused: odom: position is nan'
    assert 'position is nan' in bench.supervisor.start(bench.now)


def test_who_drives_where_nothing_was_ever_seen_is_told_that_only_the_limits_hold():
    bench = Bench()
    assert not is_warning(bench)
    for _ in range(3):
        assert bench.teleop((0.2, 0.0)).velocity[0] > 0.0
    assert is_warning(bench)
    assert diagnostic(bench).message == UNMONITORED
    assert bench.lines.count(('warning', UNMONITORED)) == 1
    bench.supervisor.manual.release()
    assert not is_warning(bench)
    bench.teleop((0.2, 0.0))
    bench.tick()
    bench.teleop((0.2, 0.0))
    assert not is_warning(bench)


def revisions(bench):
    return [text for _, text in bench.lines if text.startswith('control field revision')]


def test_a_field_is_a_line_when_it_is_another_one_and_no_trial_runs():
    bench = driving()
    for revision in range(2, 30):
        bench.supervisor.accept_field(straight_field(GOAL, revision=revision))
    assert revisions(bench) == ['control field revision 1']
    bench.supervisor.stop()
    for revision in (29, 30, 30):
        bench.supervisor.accept_field(straight_field(GOAL, revision=revision))
    assert revisions(bench) == ['control field revision 1', 'control field revision 30']


def test_a_field_that_is_refused_is_a_line_once_a_kind():
    bench = Bench()
    for n in range(5):
        bench.supervisor.field.refuse(f'control_field: version is {n}, must be 1')
        assert bench.supervisor.field.refusal.endswith(f'version is {n}, must be 1')
        bench.supervisor.accept_field(straight_field(GOAL, grid=GRID))
    assert sum('refused' in text for _, text in bench.lines) == 1
    assert bench.supervisor.refusals.counts['refused fields'] == 5
