"""A person takes over, drives by hand, and lets go."""

import dataclasses

import numpy as np
import pytest

from control_field.records import Kind, Outcome
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from controller_bench import Bench, driving, DT
from controller_helpers import GRID


def test_a_person_takes_over_at_once_and_the_field_waits():
    bench = driving()
    assert bench.take(bench.command((0.0, 1.0))).velocity is None
    assert bench.is_paused_by(StopReason.TAKEN_OVER)
    n_sent = len([a for a in bench.sent if a.velocity is not None])
    for _ in range(30):
        bench.command((0.2, 0.0))
        bench.tick(velocity=(0.2, 0.0))
    assert len([a for a in bench.sent if a.velocity is not None]) == n_sent
    taught = [row for row in bench.rows if row['kind'] == Kind.TAUGHT]
    assert [(row['col'], row['next_col']) for row in taught] == [(4, 5)]
    assert bench.run().outcome is Outcome.GOAL


@pytest.mark.parametrize('told', [(-1e30, 1e30), (0.22, -2.84), (-0.1, 0.0)])
def test_after_a_person_the_robot_begins_from_how_it_moves_not_from_what_it_was_told(told):
    bench = driving()
    bench.take(bench.command(told))
    for _ in range(40):
        n = len(bench.sent)
        bench.tick(velocity=STANDSTILL)
        if any(answer.velocity for answer in bench.sent[n:]):
            break
    limits = bench.supervisor.settings.limits
    assert abs(bench.velocity[0]) <= limits.a_max * DT + 1e-9
    assert abs(bench.velocity[1]) <= limits.alpha_max * DT + 1e-9


def test_a_person_can_drive_to_the_goal():
    bench = driving()
    for _ in range(200):
        bench.command((0.2, 0.0))
        bench.tick(velocity=(0.2, 0.0))
    assert bench.supervisor.status.outcome is Outcome.GOAL
    assert bench.rows[-1]['kind'] == Kind.TAUGHT


def test_teleop_goes_through_the_collision_monitor():
    world = np.zeros(GRID.shape, np.int8)
    world[:, 5] = 100
    bench = Bench(world=world)
    for _ in range(200):
        bench.tick()
        bench.take(bench.teleop((1.0, 0.0)))
    assert bench.pose.x == pytest.approx(1.25 - 0.105, abs=0.02)
    assert bench.velocity == STANDSTILL


@pytest.mark.parametrize('tries', [False, True])
def test_who_drives_by_hand_is_stopped_until_the_keys_are_let_go(tries):
    bench = driving() if tries else Bench()
    bench.tick()
    for _ in range(4):
        bench.take(bench.teleop((0.2, 0.0)))
        bench.tick()
    assert bench.take(bench.supervisor.stop()).velocity == STANDSTILL
    for _ in range(20):
        assert bench.teleop((0.2, 0.0)).velocity == STANDSTILL
        bench.tick()
    bench.supervisor.manual.release()
    assert bench.teleop((0.2, 0.0)).velocity[0] > 0.0


def test_what_holds_a_person_back_is_said_until_it_is_over():
    world = np.zeros(GRID.shape, np.int8)
    world[5, 4] = 100
    bench = Bench(world=world)
    for _ in range(30):
        bench.tick()
        bench.take(bench.teleop((0.2, 0.0)))
    assert 'blocked or unseen' in bench.supervisor.output.held
    bench.take(bench.teleop((0.0, 1.0)))
    assert bench.supervisor.output.held == ''
    bench.take(bench.teleop((0.2, 0.0), bench.now + 1.0))
    assert bench.supervisor.output.held == (
        'nothing shows what is around it: no odometry has arrived for 1.0 s')
    bench.supervisor.manual.release()
    assert bench.supervisor.output.held == ''


def test_a_long_robot_turns_as_far_as_its_corners_touch_nothing_and_it_is_said():
    world = np.zeros(GRID.shape, np.int8)
    world[[4, 6]] = 100
    bench = Bench(world=world, footprint='[[0.2, 0.08], [-0.2, 0.08], [-0.2, -0.08], '
                  '[0.2, -0.08]]')
    for _ in range(30):
        bench.tick()
        bench.take(bench.teleop((0.0, 1.0)))
    assert 0.05 < bench.pose.yaw < 0.4
    assert bench.velocity == STANDSTILL
    assert 'blocked or unseen' in bench.supervisor.output.held
    for _ in range(70):  # until nothing that was sent can still be under way
        bench.tick()
        bench.take(bench.teleop(STANDSTILL))
    bench.take(bench.teleop((0.0, -1.0)))
    assert bench.velocity[1] < 0.0
    assert bench.supervisor.output.held == ''


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
                    bench.take(bench.supervisor.on_pose(bench.pose, bench.now))
            bench.take(bench.teleop((0.2, 0.0)))
        assert bench.pose.x <= 1.75 - bench.supervisor.settings.limits.radius
        assert bench.pose.x > 1.75 - bench.supervisor.settings.limits.radius - 0.1


def test_teleop_outside_trials_can_be_turned_off():
    bench = Bench(teleop_outside_trials=False)
    bench.tick()
    assert bench.teleop((0.1, 0.0)).velocity is None


def test_teleop_without_any_local_grid_keeps_to_the_limits():
    bench = Bench(field=False)
    answer = bench.supervisor.manual.on_teleop_command((1.0, 9.0), 0.0, 0.1)
    assert answer.velocity == pytest.approx((0.22, 0.32))


@pytest.mark.parametrize('topic', ['cmd_vel', 'cmd_vel_teleop'])
def test_standstill_of_somebody_who_has_not_moved_the_robot_takes_nothing_over(topic):
    bench = driving()
    bench.supervisor.manual.publishers_on = lambda name: ['/idle_teleop']
    for _ in range(60):
        if topic == 'cmd_vel':
            answer = bench.command(STANDSTILL)
        else:
            answer = bench.teleop(STANDSTILL)
        assert answer.velocity is None
        bench.tick()
        assert bench.supervisor.trial.pause_reason is None
        if bench.supervisor.trial.run is None:
            break
    assert bench.run().outcome is Outcome.GOAL
    said = [text for _, text in bench.lines if '/idle_teleop on cmd_vel: standstill' in text]
    assert len(said) == (topic == 'cmd_vel')


@pytest.mark.parametrize('topic', ['cmd_vel', 'cmd_vel_teleop'])
def test_who_has_moved_the_robot_holds_it_with_standstill_and_is_named(topic):
    bench = driving()
    bench.supervisor.manual.publishers_on = lambda name: [f'/someone_on_{name}', '/b']

    def command(velocity):
        if topic == 'cmd_vel':
            bench.command(velocity)
        else:
            bench.teleop(velocity)

    command((0.1, 0.0))
    for _ in range(40):
        bench.tick(velocity=STANDSTILL)
        command(STANDSTILL)
    assert bench.is_paused_by(StopReason.TAKEN_OVER)
    reason = f'a person is driving: one of /someone_on_{topic}, /b on {topic}'
    assert bench.supervisor.status.reason == reason
    assert ('warning', f'trial 1 pauses: {reason}') in bench.lines
    assert bench.run().outcome is Outcome.GOAL


def test_standstill_that_went_on_while_the_trial_was_asked_for_does_not_stop_it():
    bench = Bench()
    bench.tick()
    bench.teleop((0.1, 0.0))
    bench.teleop(STANDSTILL)
    bench.supervisor.stop()
    bench.start()
    for _ in range(20):
        assert bench.teleop(STANDSTILL).velocity is None
        bench.tick()
    assert bench.velocity[0] > 0.1


def test_keys_are_let_go_too_where_standstill_is_sent_for_ever():
    bench = Bench()
    bench.tick()
    bench.teleop((0.2, 0.0))
    assert bench.take(bench.supervisor.stop()).velocity == STANDSTILL
    for _ in range(12):
        bench.tick()
        bench.teleop(STANDSTILL)
    assert bench.teleop((0.2, 0.0)).velocity[0] > 0.0


def test_standstill_of_another_does_not_free_who_is_stopped_and_holds_the_key():
    bench = Bench()
    bench.tick()
    bench.teleop((0.2, 0.0))
    bench.take(bench.supervisor.stop())
    for _ in range(40):
        bench.tick()
        bench.teleop(STANDSTILL)
        assert bench.teleop((0.2, 0.0)).velocity == STANDSTILL
