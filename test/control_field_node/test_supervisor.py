import dataclasses
import math

import numpy as np
import pytest

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import ControlField, Kind, Outcome
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from controller_bench import Bench, driving, DT, GOAL
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State


def test_a_trial_leads_to_the_goal_and_leaves_the_robot_standing_on_it():
    bench = Bench().start()
    status = bench.run()
    assert (status.state, status.outcome, status.reason) == (State.ENDED, Outcome.GOAL, '')
    assert (status.steps, status.decisions) == (6, 6)
    assert [row['kind'] for row in bench.rows] == [Kind.FIELD] * 6
    assert bench.velocity == STANDSTILL
    x, y = GRID.world_from_cell(*GOAL)
    assert math.hypot(bench.pose.x - x, bench.pose.y - y) < 0.03


def test_an_obstacle_is_avoided_and_says_so_in_its_rows():
    world = np.zeros(GRID.shape, np.int8)
    world[4:7, 6] = 100
    bench = Bench(world=world).start()
    assert bench.run().outcome is Outcome.GOAL
    kinds = {Kind(row['kind']) for row in bench.rows}
    assert Kind.BLOCKED in kinds
    assert bench.supervisor.status.reinforcements > 0


def test_two_equal_trials_are_equal():
    first, second = (Bench().start() for _ in range(2))
    assert first.run() == second.run()
    assert [row.tolist() for row in first.rows] == [row.tolist() for row in second.rows]


def test_outside_a_trial_nothing_is_sent():
    bench = Bench()
    for _ in range(50):
        bench.tick()
    bench.supervisor.check_inputs(bench.now + 10.0)
    assert all(answer.velocity is None for answer in bench.sent)


def test_starting_is_refused_in_words():
    bench = Bench(field=False)
    assert bench.supervisor.start(0.0) == 'there is no control field: show the way first'
    bench.supervisor.field.refuse('it is upside down')
    assert 'upside down' in bench.supervisor.start(0.0)
    bench.supervisor.accept_field(straight_field(GOAL))
    assert 'no odometry' in bench.supervisor.start(0.0)
    bench.tick(sees=False)
    assert 'no neighbourhood' in bench.supervisor.start(bench.now)
    bench.tick()
    assert 'no odometry' in bench.supervisor.start(bench.now + 1.0)
    bench.start()
    assert 'already running' in bench.supervisor.start(bench.now)


def test_starting_outside_the_workspace_is_refused():
    bench = Bench()
    bench.tick()
    bench.pose = dataclasses.replace(bench.pose, x=-3.0)
    bench.supervisor.on_pose(bench.pose, bench.now)
    assert 'outside the workspace' in bench.supervisor.start(bench.now)


def test_stopping_sends_one_standstill():
    bench = driving()
    assert bench.supervisor.stop().velocity == STANDSTILL
    assert bench.supervisor.stop().velocity is None
    assert bench.supervisor.status.outcome is Outcome.STOPPED


def test_stale_odometry_pauses_once_and_the_trial_goes_on_when_it_is_back():
    bench = driving()
    assert bench.take(bench.supervisor.check_inputs(bench.now + 0.4)).velocity is None
    assert bench.take(bench.supervisor.check_inputs(bench.now + 0.6)).velocity == STANDSTILL
    assert bench.take(bench.supervisor.check_inputs(bench.now + 0.7)).velocity is None
    assert bench.is_paused_by(StopReason.STALE_ODOMETRY)
    assert sum('pauses' in line for _, line in bench.lines) == 1
    assert bench.run().outcome is Outcome.GOAL


def test_stale_neighbourhoods_pause():
    bench = driving()
    for _ in range(12):
        bench.tick(sees=False)
    assert bench.is_paused_by(StopReason.STALE_NEIGHBOURHOOD)
    assert bench.velocity == STANDSTILL
    assert bench.run().outcome is Outcome.GOAL


def test_where_all_is_unknown_and_that_is_blocked_the_robot_waits_until_it_sees():
    bench = Bench(parameters=Parameters(unknown_is_blocked=True), field=False)
    bench.supervisor.accept_field(dataclasses.replace(
        straight_field(GOAL), known=np.zeros(GRID.shape, np.int8)))
    bench.start()
    for _ in range(20):
        bench.tick()
    seen, bench.world = bench.world, np.full(GRID.shape, -1, np.int8)
    for _ in range(100):
        bench.tick()
    assert bench.is_paused_by(StopReason.STALE_NEIGHBOURHOOD)
    assert 'unknown' in bench.supervisor.status.reason
    assert bench.velocity == STANDSTILL
    n_decisions = bench.supervisor.status.decisions
    bench.world = seen
    assert bench.run().outcome is Outcome.GOAL
    assert bench.supervisor.status.decisions < n_decisions + 12


def test_neighbourhoods_with_old_stamps_are_stale_however_often_they_come():
    bench = driving()
    old = bench.supervisor.sensing.local_grids.newest
    for _ in range(12):
        bench.supervisor.on_neighbourhood(old, bench.now)
        bench.tick(sees=False)
    assert bench.is_paused_by(StopReason.STALE_NEIGHBOURHOOD)


@pytest.mark.parametrize(('change', 'reason', 'outcome'), [
    ({'stamp': 0.1}, StopReason.CLOCK_JUMPED_BACK, Outcome.ABORTED),
    ({'x': 2.5}, StopReason.POSE_JUMPED, Outcome.ABORTED)])
def test_odometry_that_lies_ends_the_trial(change, reason, outcome):
    bench = driving()
    pose = dataclasses.replace(bench.pose, **({'stamp': bench.now + DT} | change))
    assert bench.take(bench.supervisor.on_pose(pose, bench.now)).velocity == STANDSTILL
    status = bench.supervisor.status
    assert (status.outcome, status.reason) == (outcome, reason.sentence)
    assert bench.supervisor.trial.ended_by is reason


@pytest.mark.parametrize('seconds', [1.0, 5.0, 50.0])
def test_a_clock_that_is_set_back_ends_the_trial_though_messages_look_late(seconds):
    bench = Bench()
    bench.pose = dataclasses.replace(bench.pose, stamp=100.0)
    bench.start().tick()
    clock = bench.now
    for _ in range(4):
        clock += DT
        pose = dataclasses.replace(bench.pose, stamp=clock - seconds)
        assert bench.check(pose, clock)
    pose = dataclasses.replace(bench.pose, stamp=clock + DT - seconds)
    assert not bench.check(pose, clock + DT)
    assert bench.take(bench.supervisor.on_pose(pose, clock + DT)).velocity == STANDSTILL
    assert bench.supervisor.status.stop_reason is StopReason.CLOCK_JUMPED_BACK
    assert not any('clocks' in line for _, line in bench.lines)


def test_what_was_on_its_way_for_long_between_new_ones_sets_no_clock_back():
    bench = driving()
    late = dataclasses.replace(bench.pose, stamp=bench.now - 0.9)
    for i in range(20):
        old = dataclasses.replace(late, stamp=late.stamp + 0.01 * i)
        assert bench.check(old, bench.now)
        if i % 3 == 0:
            bench.tick()
            assert not bench.check(
                dataclasses.replace(bench.pose, stamp=bench.now + 1e-3), bench.now)
    assert bench.run().outcome is Outcome.GOAL


def test_bad_odometry_pauses_until_it_has_been_good_for_a_while():
    bench = driving()
    bench.take(bench.supervisor.on_bad_odometry('odom: x is nan', bench.now))
    assert bench.is_paused_by(StopReason.BAD_INPUT)
    assert bench.velocity == STANDSTILL
    bench.tick()
    assert bench.is_paused_by(StopReason.BAD_INPUT)
    assert bench.run().outcome is Outcome.GOAL


def test_odometry_in_another_frame_is_bad():
    bench = driving()
    bench.take(bench.supervisor.on_pose(
        dataclasses.replace(bench.pose, stamp=bench.now + DT, frame_id='map'), bench.now))
    assert bench.is_paused_by(StopReason.BAD_INPUT)
    assert any("'map'" in line for _, line in bench.lines)


def test_contact_is_a_collision():
    bench = driving()
    assert bench.take(bench.supervisor.trial.halt(StopReason.CONTACT)).velocity == STANDSTILL
    assert bench.supervisor.status.outcome is Outcome.COLLISION


def test_wheels_that_spin_on_the_spot_are_a_collision():
    bench = driving()
    for _ in range(100):
        if bench.supervisor.trial.run is not None:
            bench.tick(velocity=STANDSTILL)
    assert bench.supervisor.status.outcome is Outcome.COLLISION
    assert bench.supervisor.trial.ended_by is StopReason.STALLED


def test_the_step_limit_gives_up():
    bench = Bench(parameters=Parameters(step_limit=2)).start()
    assert bench.run().outcome is Outcome.GAVE_UP
    assert bench.supervisor.trial.ended_by is StopReason.STEP_LIMIT


def test_a_robot_walled_in_gives_up():
    world = np.zeros(GRID.shape, np.int8)
    world[4:7, 2:5] = 100
    bench = Bench(world=world).start()
    assert bench.run().outcome is Outcome.GAVE_UP
    assert bench.supervisor.trial.ended_by is StopReason.NO_WAY


def test_a_field_that_says_nothing_stops():
    bench = Bench(field=False)
    field = straight_field(GOAL)
    bench.supervisor.accept_field(dataclasses.replace(
        field, q=np.zeros_like(field.q), coherence=np.zeros_like(field.coherence),
        flags=np.zeros_like(field.flags)))
    assert bench.start().run().outcome is Outcome.STOPPED
    assert bench.supervisor.trial.ended_by is StopReason.LOW_COHERENCE


def test_another_controller_ends_the_trial():
    bench = driving()
    answer = bench.take(bench.supervisor.trial.halt(
        StopReason.OTHER_PUBLISHER, '/control_field_node publishes cmd_vel, too'))
    assert answer.velocity == STANDSTILL
    assert bench.supervisor.trial.ended_by is StopReason.OTHER_PUBLISHER
    assert 'control_field_node' in bench.supervisor.status.reason


def test_a_refreshed_field_is_driven_on_without_a_jump():
    bench = driving()
    before = bench.velocity
    bench.supervisor.accept_field(straight_field((10, 9), revision=2))
    revisions, jumps = set(), []
    while bench.supervisor.trial.run is not None:
        revisions.add(bench.supervisor.status.revision)
        velocity = bench.tick().velocity
        if bench.supervisor.trial.run is not None:
            jumps.append(abs(velocity[0] - before[0]) <= 2.5 * DT + 1e-9
                         and abs(velocity[1] - before[1]) <= 3.2 * DT + 1e-9)
        before = velocity
    assert all(jumps)
    assert revisions == {1, 2}
    assert bench.supervisor.status.outcome is Outcome.GOAL
    assert GRID.cell_from_world(bench.pose.x, bench.pose.y) == (10, 9)


def test_a_field_of_another_grid_is_refused_and_the_old_one_kept():
    bench = driving()
    other = Grid(10, 10, 0.5)
    for _ in range(3):
        assert not bench.supervisor.accept_field(straight_field((5, 5), grid=other))
    assert sum('refused' in line for _, line in bench.lines) == 1
    assert bench.run().outcome is Outcome.GOAL
    assert bench.supervisor.status.revision == 1


@pytest.mark.parametrize(('stamp', 'late'), [(0.0, True), (-0.2, True), (DT, False)])
def test_late_and_repeated_odometry_is_passed_over(stamp, late):
    bench = driving()
    pose = dataclasses.replace(bench.pose, stamp=bench.now + stamp)
    assert bool(bench.check(pose, bench.now)) == late
    assert bench.supervisor.refusals.counts['late odometry'] == late


@pytest.mark.parametrize(('age', 'late'), [(0.1, False), (2.0, True), (1e9, False), (-5.0, False)])
def test_odometry_that_was_long_on_its_way_is_passed_over_unless_its_clock_is_another(age, late):
    bench = driving()
    pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
    assert bool(bench.check(pose, pose.stamp + age)) == late
    assert any('age is' in line for _, line in bench.lines) == late


def test_a_refused_message_is_said_once_and_counted():
    bench = Bench()
    for value in range(5):
        bench.supervisor.refusals.refuse(f'odom: position is ({value}, nan), must be finite')
    assert sum('refused' in line for _, line in bench.lines) == 1
    assert bench.supervisor.refusals.counts['refused messages'] == 5


def test_a_goal_clicked_elsewhere_is_answered_in_words():
    bench = Bench()
    bench.supervisor.field.on_goal(*GRID.world_from_cell(*GOAL), 'odom')
    assert bench.lines[-1] == (
        'info', 'goal_pose: the control field leads there; ~/start_trial starts')
    bench.supervisor.field.on_goal(0.1, 0.1, 'odom')
    assert 'leads to' in bench.lines[-1][1]
    bench.supervisor.field.on_goal(*GRID.world_from_cell(*GOAL), 'map')
    assert "goal_pose: frame is 'map', must be 'odom'" in bench.lines[-1][1]
    assert [level for level, _ in bench.lines[-2:]] == ['warning'] * 2


def test_a_trial_keeps_to_the_unknown_it_was_started_with():
    world = np.full(GRID.shape, -1, np.int8)
    bench = Bench(world=world).start()
    bench.supervisor.trial.parameters = Parameters(unknown_is_blocked=True)
    assert bench.run().outcome is Outcome.GOAL
    bench.pose = Pose(bench.now, *GRID.world_from_cell(5, 3), 0.0)
    bench.start().run(1.0)
    assert bench.is_paused_by(StopReason.STALE_NEIGHBOURHOOD)


class TestVoidField:

    def test_there_is_nothing_to_drive_on(self):
        bench = Bench(field=False)
        assert bench.supervisor.status.stop_reason is StopReason.NO_FIELD
        bench.tick()
        assert bench.supervisor.accept_field(ControlField.void(GRID))
        assert 'no control field' in bench.supervisor.start(bench.now)
        assert bench.supervisor.status.revision == 0
        assert bench.supervisor.status.reason == StopReason.NO_FIELD.sentence
        assert bench.supervisor.accept_field(straight_field(GOAL))
        assert bench.supervisor.status.stop_reason is None
        bench.tick()
        assert bench.supervisor.start(bench.now) == ''

    def test_ends_a_trial_that_runs(self):
        bench = Bench()
        bench.tick()
        assert bench.supervisor.start(bench.now) == ''
        bench.supervisor.accept_field(ControlField.void(GRID))
        for _ in range(400):
            bench.tick()
        assert bench.supervisor.trial.run is None
        assert bench.velocity == STANDSTILL

    def test_where_its_goal_would_be_no_goal_is_reached(self):
        bench = Bench()
        bench.pose = Pose(1.0, *GRID.world_from_cell(*ControlField.void(GRID).goal), 0.0)
        bench.tick()
        assert bench.supervisor.start(bench.now) == ''
        bench.supervisor.accept_field(ControlField.void(GRID))
        status = bench.run()
        assert status.outcome is Outcome.STOPPED
        assert status.reason == StopReason.NO_FIELD.sentence

    def test_one_of_another_workspace_gives_way(self):
        bench = Bench(field=False)
        bench.supervisor.accept_field(ControlField.void(Grid(3, 4, 1.0)))
        assert bench.supervisor.accept_field(straight_field(GOAL))


@pytest.mark.parametrize('revision', [5, 2])
def test_the_newest_field_is_in_force_whatever_its_number(revision):
    bench = Bench()
    bench.supervisor.accept_field(dataclasses.replace(straight_field(GOAL), revision=5))
    newer = dataclasses.replace(straight_field((5, 8)), revision=revision)
    assert bench.supervisor.accept_field(newer)
    assert bench.supervisor.field.current is newer
    assert bench.supervisor.status.revision == revision
