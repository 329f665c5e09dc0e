"""What a pause, its end and the end of a trial leave behind in the supervisor."""

import dataclasses

import pytest

from control_field.grid import Grid
from control_field.records import Outcome
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from control_field_node.driving.trial_run import NOTHING
from control_field_node.settings import Settings
from controller_bench import Bench, DT, GOAL
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State

VARIANCES = (1e-4, 1e-4, 1e-4)


def driving(**settings):
    bench = Bench(**settings).start()
    for _ in range(20):
        bench.tick()
    assert bench.velocity[0] > 0.1
    return bench


def test_after_a_pause_the_robot_speeds_up_from_a_standstill():
    bench = driving()
    bench.take(bench.supervisor.check_inputs(bench.now + 0.6))
    assert bench.supervisor.output.velocity == STANDSTILL
    bench.tick()
    assert bench.supervisor.status.state is State.RUNNING
    assert bench.supervisor.status.reason == ''
    assert 0.0 < bench.velocity[0] <= bench.supervisor.settings.limits.a_max * DT + 1e-9


def test_after_a_trial_the_robot_speeds_up_from_a_standstill():
    bench = driving()
    bench.take(bench.supervisor.stop())
    assert bench.supervisor.output.velocity == STANDSTILL
    assert bench.teleop((0.2, 0.0)).velocity[0] <= (
        bench.supervisor.settings.limits.a_max * DT + 1e-9)


def test_an_end_is_a_warning_but_at_the_goal():
    stopped, arrived = driving(), driving()
    stopped.supervisor.stop()
    arrived.run()
    assert [bench.lines[-1][0] for bench in (stopped, arrived)] == ['warning', 'info']


def test_time_alone_finds_a_stale_local_grid():
    bench = driving(neighbourhood_timeout=0.2)
    assert bench.take(bench.supervisor.check_inputs(bench.now + 0.3)).velocity == STANDSTILL
    assert bench.supervisor.trial.pause_reason is StopReason.STALE_NEIGHBOURHOOD
    assert bench.take(bench.supervisor.check_inputs(bench.now + 0.3)).velocity is None


def test_a_stale_local_grid_while_a_person_drives_is_the_persons_business():
    bench = driving(neighbourhood_timeout=0.2)
    bench.command((0.1, 0.0))
    assert bench.supervisor.check_inputs(bench.now + 0.3).velocity is None
    assert bench.supervisor.trial.pause_reason is StopReason.TAKEN_OVER


def test_a_person_still_drives_when_odometry_is_back():
    bench = driving()
    bench.command((0.1, 0.0), bench.now + 0.6)
    bench.take(bench.supervisor.check_inputs(bench.now + 0.6))
    assert bench.tick().velocity is None
    assert bench.supervisor.trial.pause_reason is StopReason.TAKEN_OVER


def test_the_field_goes_on_from_the_speed_that_the_person_drove():
    bench = driving()
    bench.command((0.05, 0.3))
    assert bench.supervisor.output.velocity == (0.05, 0.3)
    assert bench.supervisor.manual.release() is NOTHING  # that is for who drives outside a trial
    assert bench.supervisor.output.velocity == (0.05, 0.3)


def test_keys_take_a_trial_over():
    bench = driving()
    assert bench.take(bench.teleop((0.1, 0.0))).velocity[0] > 0.0
    assert bench.supervisor.trial.pause_reason is StopReason.TAKEN_OVER
    assert bench.tick().velocity is None


def test_what_the_monitor_changed_is_counted_and_so_are_fields_that_were_refused():
    bench = Bench().start()
    bench.run()
    counts = bench.supervisor.refusals.counts
    changed = [answer for answer in bench.sent if answer.requested is not None]
    assert sum(n for what, n in counts.items() if what.startswith('gate ')) == len(changed) > 0
    for _ in range(2):
        bench.supervisor.accept_field(straight_field((5, 5), grid=Grid(10, 10, 0.5)))
    assert counts['refused fields'] == 2


def test_a_person_has_let_go_when_the_timeout_is_over_that_holds_now():
    bench = driving()
    assert not bench.supervisor.manual.has_let_go(bench.now)
    bench.command((0.1, 0.0))
    assert not bench.supervisor.manual.has_let_go(bench.now + 0.4)
    assert bench.supervisor.manual.has_let_go(bench.now + 0.6)
    bench.supervisor.change_settings(Settings(takeover_timeout=2.0))
    assert not bench.supervisor.manual.has_let_go(bench.now + 0.6)


def test_who_leads_the_robot_away_from_the_goal_has_not_ended_the_trial():
    bench = Bench().start()
    x, _ = GRID.world_from_cell(*GOAL)
    while bench.pose.x < x - 0.06:
        bench.tick()
    assert bench.supervisor.trial.run is not None
    for _ in range(30):
        bench.command((0.2, 0.0))
        bench.tick(velocity=(0.2, 0.0))
    assert GRID.cell_from_world(bench.pose.x, bench.pose.y) == (GOAL[0], GOAL[1] + 1)
    bench.tick(velocity=STANDSTILL)
    assert bench.run().outcome is Outcome.GOAL
    assert GRID.cell_from_world(bench.pose.x, bench.pose.y) == GOAL


def test_the_status_tells_the_revision_and_forgets_the_last_trial_with_a_new_field():
    bench = Bench(field=False)
    assert bench.supervisor.status.revision == -1
    bench.supervisor.accept_field(straight_field(GOAL))
    bench.start().supervisor.stop()
    assert bench.supervisor.status.state is State.ENDED
    bench.supervisor.accept_field(straight_field(GOAL, revision=2))
    assert bench.supervisor.status.state is State.IDLE
    assert bench.supervisor.status.outcome is not Outcome.STOPPED
    assert bench.supervisor.status.revision == 2


@pytest.mark.parametrize('settings', [{}, {'lockstep': True}])
def test_nothing_starts_before_odometry_and_local_grid_have_come(settings):
    bench = Bench(**settings)
    assert 'no odometry' in bench.supervisor.start(bench.now)
    bench.tick(sees=False)
    assert 'no neighbourhood' in bench.supervisor.start(bench.now)
    bench.tick()
    assert bench.supervisor.start(bench.now) == ''


def test_a_late_neighbourhood_is_passed_over_and_counted():
    bench = driving()
    newest = bench.supervisor.sensing.local_grids.newest
    late = dataclasses.replace(newest, stamp=newest.stamp - 0.1)
    bench.supervisor.on_neighbourhood(late, bench.now)
    assert bench.supervisor.sensing.local_grids.newest is newest
    assert bench.supervisor.refusals.counts['late neighbourhoods'] == 1


def test_a_localisations_pose_in_another_frame_is_refused_and_a_useless_one_counted():
    bench = Bench(pose_topic='amcl_pose')
    bench.tick()
    supervisor = bench.supervisor
    there = Pose(bench.now, 2.0, 1.4, 0.0, frame_id='moon')
    supervisor.sensing.on_localised_pose(there, VARIANCES, bench.now)
    assert supervisor.refusals.counts['refused messages'] == 1
    assert "does not count: amcl_pose: frame is 'moon'" in supervisor.start(bench.now)
    there = dataclasses.replace(there, frame_id='/map')
    for _ in range(3):  # the later ones say nothing new
        supervisor.sensing.on_localised_pose(there, VARIANCES, bench.now)
    assert supervisor.refusals.counts['poses not used'] == 2
    assert supervisor.refusals.counts['refused messages'] == 1
    assert supervisor.start(bench.now) == ''


def test_a_robot_that_was_placed_before_its_trial_has_not_leapt():
    bench = Bench()
    bench.tick()
    bench.pose = dataclasses.replace(bench.pose, x=bench.pose.x + 1.0)
    assert bench.supervisor.start(bench.now) == ''
    bench.tick()
    assert bench.supervisor.trial.run is not None
    bench.pose = dataclasses.replace(bench.pose, x=bench.pose.x - 1.0)
    bench.tick()
    assert bench.supervisor.trial.run is None
    assert bench.supervisor.trial.ended.outcome is Outcome.ABORTED


def test_a_start_is_ramped_and_what_was_asked_for_is_told():
    bench = Bench().start()
    bench.tick()
    first = next(answer for answer in bench.sent if answer.velocity not in (None, (0.0, 0.0)))
    assert first.requested is not None
    assert first.requested[0] > first.velocity[0] > 0.0


def test_what_passes_the_monitor_as_it_is_is_not_told_twice():
    bench = Bench().start()
    bench.run()
    passed = [answer for answer in bench.sent if answer.velocity and answer.requested is None]
    clipped = [answer for answer in bench.sent if answer.requested is not None]
    assert len(passed) > len(clipped) > 0
    assert all(answer.requested != answer.velocity for answer in clipped)
