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
    bench.supervisor.watch(bench.now + 10.0)
    assert all(answer.velocity is None for answer in bench.sent)


def test_starting_is_refused_in_words():
    bench = Bench(field=False)
    assert bench.supervisor.start(0.0) == 'there is no control field: show the way first'
    bench.supervisor.refuse_field('it is upside down')
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
    bench.supervisor.saw_pose(bench.pose, bench.now)
    assert 'outside the workspace' in bench.supervisor.start(bench.now)


def test_stopping_sends_one_standstill():
    bench = driving()
    assert bench.supervisor.stop().velocity == STANDSTILL
    assert bench.supervisor.stop().velocity is None
    assert bench.supervisor.status.outcome is Outcome.STOPPED


def paused_by(bench, reason):
    return (bench.supervisor.status.state is State.PAUSED
            and bench.supervisor.problem is reason
            and bench.supervisor.status.stop_reason is reason
            and bench.supervisor.status.reason.startswith(reason.sentence))


def test_stale_odometry_pauses_once_and_the_trial_goes_on_when_it_is_back():
    bench = driving()
    assert bench.take(bench.supervisor.watch(bench.now + 0.4)).velocity is None
    assert bench.take(bench.supervisor.watch(bench.now + 0.6)).velocity == STANDSTILL
    assert bench.take(bench.supervisor.watch(bench.now + 0.7)).velocity is None
    assert paused_by(bench, StopReason.STALE_ODOMETRY)
    assert sum('pauses' in line for _, line in bench.lines) == 1
    assert bench.run().outcome is Outcome.GOAL


def test_stale_neighbourhoods_pause():
    bench = driving()
    for _ in range(12):
        bench.tick(sees=False)
    assert paused_by(bench, StopReason.STALE_NEIGHBOURHOOD)
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
    assert paused_by(bench, StopReason.STALE_NEIGHBOURHOOD)
    assert 'unknown' in bench.supervisor.status.reason
    assert bench.velocity == STANDSTILL
    n_decisions = bench.supervisor.status.decisions
    bench.world = seen
    assert bench.run().outcome is Outcome.GOAL
    assert bench.supervisor.status.decisions < n_decisions + 12


def test_neighbourhoods_with_old_stamps_are_stale_however_often_they_come():
    bench = driving()
    old = bench.supervisor.neighbourhood
    for _ in range(12):
        bench.supervisor.saw_neighbourhood(old, bench.now)
        bench.tick(sees=False)
    assert paused_by(bench, StopReason.STALE_NEIGHBOURHOOD)


@pytest.mark.parametrize(('change', 'reason', 'outcome'), [
    ({'stamp': 0.1}, StopReason.CLOCK_JUMPED_BACK, Outcome.ABORTED),
    ({'x': 2.5}, StopReason.POSE_JUMPED, Outcome.ABORTED)])
def test_odometry_that_lies_ends_the_trial(change, reason, outcome):
    bench = driving()
    pose = dataclasses.replace(bench.pose, **({'stamp': bench.now + DT} | change))
    assert bench.take(bench.supervisor.saw_pose(pose, bench.now)).velocity == STANDSTILL
    status = bench.supervisor.status
    assert (status.outcome, status.reason) == (outcome, reason.sentence)
    assert bench.supervisor.ended_by is reason


@pytest.mark.parametrize('seconds', [1.0, 5.0, 50.0])
def test_a_clock_that_is_set_back_ends_the_trial_though_messages_look_late(seconds):
    bench = Bench()
    bench.pose = dataclasses.replace(bench.pose, stamp=100.0)
    bench.start().tick()
    clock = bench.now
    for _ in range(4):
        clock += DT
        pose = dataclasses.replace(bench.pose, stamp=clock - seconds)
        assert bench.supervisor.intake.is_late_pose(pose, clock)
    pose = dataclasses.replace(bench.pose, stamp=clock + DT - seconds)
    assert not bench.supervisor.intake.is_late_pose(pose, clock + DT)
    assert bench.take(bench.supervisor.saw_pose(pose, clock + DT)).velocity == STANDSTILL
    assert bench.supervisor.status.stop_reason is StopReason.CLOCK_JUMPED_BACK
    assert not any('clocks' in line for _, line in bench.lines)


def test_what_was_on_its_way_for_long_between_new_ones_sets_no_clock_back():
    bench = driving()
    late = dataclasses.replace(bench.pose, stamp=bench.now - 0.9)
    for i in range(20):
        old = dataclasses.replace(late, stamp=late.stamp + 0.01 * i)
        assert bench.supervisor.intake.is_late_pose(old, bench.now)
        if i % 3 == 0:
            bench.tick()
            assert not bench.supervisor.intake.is_late_pose(
                dataclasses.replace(bench.pose, stamp=bench.now + 1e-3), bench.now)
    assert bench.run().outcome is Outcome.GOAL


def test_bad_odometry_pauses_until_it_has_been_good_for_a_while():
    bench = driving()
    bench.take(bench.supervisor.saw_bad_input('odom: x is nan', bench.now))
    assert paused_by(bench, StopReason.BAD_INPUT)
    assert bench.velocity == STANDSTILL
    bench.tick()
    assert paused_by(bench, StopReason.BAD_INPUT)
    assert bench.run().outcome is Outcome.GOAL


def test_odometry_in_another_frame_is_bad():
    bench = driving()
    bench.take(bench.supervisor.saw_pose(
        dataclasses.replace(bench.pose, stamp=bench.now + DT, frame_id='map'), bench.now))
    assert paused_by(bench, StopReason.BAD_INPUT)
    assert any("'map'" in line for _, line in bench.lines)


def test_contact_is_a_collision():
    bench = driving()
    assert bench.take(bench.supervisor.saw_contact()).velocity == STANDSTILL
    assert bench.supervisor.status.outcome is Outcome.COLLISION


def test_wheels_that_spin_on_the_spot_are_a_collision():
    bench = driving()
    for _ in range(100):
        if bench.supervisor.run is not None:
            bench.tick(velocity=STANDSTILL)
    assert bench.supervisor.status.outcome is Outcome.COLLISION
    assert bench.supervisor.ended_by is StopReason.STALLED


def test_the_step_limit_gives_up():
    bench = Bench(parameters=Parameters(step_limit=2)).start()
    assert bench.run().outcome is Outcome.GAVE_UP
    assert bench.supervisor.ended_by is StopReason.STEP_LIMIT


def test_a_robot_walled_in_gives_up():
    world = np.zeros(GRID.shape, np.int8)
    world[4:7, 2:5] = 100
    bench = Bench(world=world).start()
    assert bench.run().outcome is Outcome.GAVE_UP
    assert bench.supervisor.ended_by is StopReason.NO_WAY


def test_a_field_that_says_nothing_stops():
    bench = Bench(field=False)
    field = straight_field(GOAL)
    bench.supervisor.accept_field(dataclasses.replace(
        field, q=np.zeros_like(field.q), coherence=np.zeros_like(field.coherence),
        flags=np.zeros_like(field.flags)))
    assert bench.start().run().outcome is Outcome.STOPPED
    assert bench.supervisor.ended_by is StopReason.LOW_COHERENCE


def test_a_person_takes_over_at_once_and_the_field_waits():
    bench = driving()
    assert bench.take(bench.supervisor.saw_external((0.0, 1.0), bench.now)).velocity is None
    assert paused_by(bench, StopReason.TAKEN_OVER)
    n_sent = len([a for a in bench.sent if a.velocity is not None])
    for _ in range(30):
        bench.supervisor.saw_external((0.2, 0.0), bench.now)
        bench.tick(velocity=(0.2, 0.0))
    assert len([a for a in bench.sent if a.velocity is not None]) == n_sent
    taught = [row for row in bench.rows if row['kind'] == Kind.TAUGHT]
    assert [(row['col'], row['next_col']) for row in taught] == [(4, 5)]
    assert bench.run().outcome is Outcome.GOAL


@pytest.mark.parametrize('told', [(-1e30, 1e30), (0.22, -2.84), (-0.1, 0.0)])
def test_after_a_person_the_robot_begins_from_how_it_moves_not_from_what_it_was_told(told):
    bench = driving()
    bench.take(bench.supervisor.saw_external(told, bench.now))
    for _ in range(40):
        n = len(bench.sent)
        bench.tick(velocity=STANDSTILL)
        if any(answer.velocity for answer in bench.sent[n:]):
            break
    limits = bench.supervisor.limits
    assert abs(bench.velocity[0]) <= limits.a_max * DT + 1e-9
    assert abs(bench.velocity[1]) <= limits.alpha_max * DT + 1e-9


def test_a_person_can_drive_to_the_goal():
    bench = driving()
    for _ in range(200):
        bench.supervisor.saw_external((0.2, 0.0), bench.now)
        bench.tick(velocity=(0.2, 0.0))
    assert bench.supervisor.status.outcome is Outcome.GOAL
    assert bench.rows[-1]['kind'] == Kind.TAUGHT


def test_another_controller_ends_the_trial():
    bench = driving()
    assert bench.take(bench.supervisor.saw_rival('/control_field_node')).velocity == STANDSTILL
    assert bench.supervisor.ended_by is StopReason.OTHER_PUBLISHER
    assert 'control_field_node' in bench.supervisor.status.reason


def test_teleop_goes_through_the_gate():
    world = np.zeros(GRID.shape, np.int8)
    world[:, 5] = 100
    bench = Bench(world=world)
    for _ in range(200):
        bench.tick()
        bench.take(bench.supervisor.teleop((1.0, 0.0), bench.now, DT))
    assert bench.pose.x == pytest.approx(1.25 - 0.105, abs=0.02)
    assert bench.velocity == STANDSTILL


@pytest.mark.parametrize('tries', [False, True])
def test_who_drives_by_hand_is_stopped_until_the_keys_are_let_go(tries):
    bench = driving() if tries else Bench()
    bench.tick()
    for _ in range(4):
        bench.take(bench.supervisor.teleop((0.2, 0.0), bench.now, DT))
        bench.tick()
    assert bench.take(bench.supervisor.stop()).velocity == STANDSTILL
    for _ in range(20):
        assert bench.supervisor.teleop((0.2, 0.0), bench.now, DT).velocity == STANDSTILL
        bench.tick()
    bench.supervisor.let_go()
    assert bench.supervisor.teleop((0.2, 0.0), bench.now, DT).velocity[0] > 0.0


def test_what_holds_a_person_back_is_said_until_it_is_over():
    world = np.zeros(GRID.shape, np.int8)
    world[5, 4] = 100
    bench = Bench(world=world)
    for _ in range(30):
        bench.tick()
        bench.take(bench.supervisor.teleop((0.2, 0.0), bench.now, DT))
    assert 'blocked or unseen' in bench.supervisor.held
    bench.take(bench.supervisor.teleop((0.0, 1.0), bench.now, DT))
    assert bench.supervisor.held == ''
    bench.take(bench.supervisor.teleop((0.2, 0.0), bench.now + 1.0, DT))
    assert bench.supervisor.held == (
        'nothing shows what is around it: no odometry has arrived for 1.0 s')
    bench.supervisor.let_go()
    assert bench.supervisor.held == ''


@pytest.mark.parametrize(('factor', 'n_poses'), [(5, 1), (1, 1), (1, 4)])
def test_a_person_gets_no_nearer_with_rare_poses_or_fast_simulated_time(factor, n_poses):
    """A command a DT of the steady clock; time is simulated `factor` times as fast."""
    world = np.zeros(GRID.shape, np.int8)
    world[:, 7] = 100
    for offset in range(10):
        bench = Bench(world=world)
        bench.tick()
        for i in range(200):
            for j in range(factor):
                v = bench.velocity[0]
                bench.pose = dataclasses.replace(
                    bench.pose, stamp=bench.now + DT, x=bench.pose.x + v * DT)
                if j == offset % factor and i % n_poses == offset % n_poses:
                    bench.look()
                    bench.take(bench.supervisor.saw_pose(bench.pose, bench.now))
            bench.take(bench.supervisor.teleop((0.2, 0.0), bench.now, DT))
        assert bench.pose.x <= 1.75 - bench.supervisor.limits.radius
        assert bench.pose.x > 1.75 - bench.supervisor.limits.radius - 0.1


def test_teleop_outside_trials_can_be_turned_off():
    bench = Bench(teleop_outside_trials=False)
    bench.tick()
    assert bench.supervisor.teleop((0.1, 0.0), bench.now, DT).velocity is None


def test_teleop_without_any_local_grid_keeps_to_the_limits():
    bench = Bench(field=False)
    assert bench.supervisor.teleop((1.0, 9.0), 0.0, 0.1).velocity == pytest.approx((0.22, 0.32))


def test_a_refreshed_field_is_driven_on_without_a_jump():
    bench = driving()
    before = bench.velocity
    bench.supervisor.accept_field(straight_field((10, 9), revision=2))
    revisions, jumps = set(), []
    while bench.supervisor.run is not None:
        revisions.add(bench.supervisor.status.revision)
        velocity = bench.tick().velocity
        if bench.supervisor.run is not None:
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
    assert bench.supervisor.intake.is_late_pose(pose, bench.now) == late
    assert bench.supervisor.intake.counts['late odometry'] == late


@pytest.mark.parametrize(('age', 'late'), [(0.1, False), (2.0, True), (1e9, False), (-5.0, False)])
def test_odometry_that_was_long_on_its_way_is_passed_over_unless_its_clock_is_another(age, late):
    bench = driving()
    pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
    assert bench.supervisor.intake.is_late_pose(pose, pose.stamp + age) == late
    assert any('age is' in line for _, line in bench.lines) == late


def test_a_refused_message_is_said_once_and_counted():
    bench = Bench()
    for value in range(5):
        bench.supervisor.intake.refuse(f'odom: position is ({value}, nan), must be finite')
    assert sum('refused' in line for _, line in bench.lines) == 1
    assert bench.supervisor.intake.counts['refused messages'] == 5


def test_a_goal_clicked_elsewhere_is_answered_in_words():
    bench = Bench()
    bench.supervisor.saw_goal(*GRID.world_from_cell(*GOAL), 'odom')
    assert bench.lines[-1] == (
        'info', 'goal_pose: the control field leads there; ~/start_trial starts')
    bench.supervisor.saw_goal(0.1, 0.1, 'odom')
    assert 'leads to' in bench.lines[-1][1]
    bench.supervisor.saw_goal(*GRID.world_from_cell(*GOAL), 'map')
    assert "goal_pose: frame is 'map', must be 'odom'" in bench.lines[-1][1]
    assert [level for level, _ in bench.lines[-2:]] == ['warning'] * 2


def test_a_trial_keeps_to_the_unknown_it_was_started_with():
    world = np.full(GRID.shape, -1, np.int8)
    bench = Bench(world=world).start()
    bench.supervisor.parameters = Parameters(unknown_is_blocked=True)
    assert bench.run().outcome is Outcome.GOAL
    bench.pose = Pose(bench.now, *GRID.world_from_cell(5, 3), 0.0)
    bench.start().run(1.0)
    assert paused_by(bench, StopReason.STALE_NEIGHBOURHOOD)


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
        assert bench.supervisor.run is None
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
    assert bench.supervisor.field is newer
    assert bench.supervisor.status.revision == revision


@pytest.mark.parametrize('topic', ['cmd_vel', 'cmd_vel_teleop'])
def test_standstill_of_somebody_who_has_not_moved_the_robot_takes_nothing_over(topic):
    bench = driving()
    bench.supervisor.who = lambda name: ['/idle_teleop']
    for _ in range(60):
        if topic == 'cmd_vel':
            answer = bench.supervisor.saw_external(STANDSTILL, bench.now)
        else:
            answer = bench.supervisor.teleop(STANDSTILL, bench.now, DT)
        assert answer.velocity is None
        bench.tick()
        assert bench.supervisor.problem is None
        if bench.supervisor.run is None:
            break
    assert bench.run().outcome is Outcome.GOAL
    said = [text for _, text in bench.lines if '/idle_teleop on cmd_vel: standstill' in text]
    assert len(said) == (topic == 'cmd_vel')


@pytest.mark.parametrize('topic', ['cmd_vel', 'cmd_vel_teleop'])
def test_who_has_moved_the_robot_holds_it_with_standstill_and_is_named(topic):
    bench = driving()
    bench.supervisor.who = lambda name: [f'/someone_on_{name}', '/b']

    def command(velocity):
        if topic == 'cmd_vel':
            bench.supervisor.saw_external(velocity, bench.now)
        else:
            bench.supervisor.teleop(velocity, bench.now, DT)

    command((0.1, 0.0))
    for _ in range(40):
        bench.tick(velocity=STANDSTILL)
        command(STANDSTILL)
    assert paused_by(bench, StopReason.TAKEN_OVER)
    reason = f'a person is driving: one of /someone_on_{topic}, /b on {topic}'
    assert bench.supervisor.status.reason == reason
    assert ('warning', f'trial 1 pauses: {reason}') in bench.lines
    assert bench.run().outcome is Outcome.GOAL


def test_standstill_that_went_on_while_the_trial_was_asked_for_does_not_stop_it():
    bench = Bench()
    bench.tick()
    bench.supervisor.teleop((0.1, 0.0), bench.now, DT)
    bench.supervisor.teleop(STANDSTILL, bench.now, DT)
    bench.supervisor.stop()
    bench.start()
    for _ in range(20):
        assert bench.supervisor.teleop(STANDSTILL, bench.now, DT).velocity is None
        bench.tick()
    assert bench.velocity[0] > 0.1


def test_keys_are_let_go_too_where_standstill_is_sent_for_ever():
    bench = Bench()
    bench.tick()
    bench.supervisor.teleop((0.2, 0.0), bench.now, DT)
    assert bench.take(bench.supervisor.stop()).velocity == STANDSTILL
    for _ in range(12):
        bench.tick()
        bench.supervisor.teleop(STANDSTILL, bench.now, DT)
    assert bench.supervisor.teleop((0.2, 0.0), bench.now, DT).velocity[0] > 0.0


def test_standstill_of_another_does_not_free_who_is_stopped_and_holds_the_key():
    bench = Bench()
    bench.tick()
    bench.supervisor.teleop((0.2, 0.0), bench.now, DT)
    bench.take(bench.supervisor.stop())
    for _ in range(40):
        bench.tick()
        bench.supervisor.teleop(STANDSTILL, bench.now, DT)
        assert bench.supervisor.teleop((0.2, 0.0), bench.now, DT).velocity == STANDSTILL
