"""A pause has one honest reason, said once, however long its cause lasts and comes back."""

import dataclasses

import numpy as np
import pytest

from control_field.records import Outcome
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from control_field_node.inputs.input_monitor import PoseFilter
from controller_bench import Bench, driving, DT
from controller_helpers import GRID
from msgs_bridge.messages.neighbourhoods import Neighbourhood


def reasons(bench):
    return [text.partition(': ')[2] for level, text in bench.lines if 'pauses' in text]


def test_bad_odometry_all_the_time_is_said_once():
    bench = driving()
    for _ in range(100):
        bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
        bench.look()
        bench.take(bench.supervisor.on_bad_odometry('odom: position is nan', bench.now))
        bench.take(bench.supervisor.check_inputs(bench.now))
    assert bench.velocity == STANDSTILL
    assert reasons(bench) == ['odom: position is nan']
    assert sum('position is nan' in text for _, text in bench.lines) == 1
    assert 'position is nan' in bench.supervisor.status.reason
    assert bench.run().outcome is Outcome.GOAL


def test_bad_odometry_now_and_then_changes_the_reason_once():
    bench = driving()
    for i in range(200):
        bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
        bench.look()
        if i % 20 == 0:
            bench.take(bench.supervisor.on_bad_odometry('odom: position is nan', bench.now))
        bench.take(bench.supervisor.check_inputs(bench.now))
    assert reasons(bench) == [
        'odom: position is nan', 'odometry arrives but does not count: odom: position is nan']


@pytest.mark.parametrize('sees', [True, False])
def test_what_comes_too_rarely_is_said_once_and_the_robot_stands(sees):
    bench = driving()
    for i in range(400):
        rare = i % 20 == 19
        bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
        if sees or rare:
            bench.look()
        if rare or not sees:
            bench.take(bench.supervisor.on_pose(bench.pose, bench.now))
        bench.take(bench.supervisor.check_inputs(bench.now))
    assert len(reasons(bench)) == 1
    assert not any('goes on' in text for _, text in bench.lines)
    assert bench.velocity == STANDSTILL
    assert bench.run().outcome is Outcome.GOAL


def test_a_person_who_drives_is_not_stopped_by_what_does_not_come():
    bench = driving()
    for _ in range(60):
        bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
        bench.take(bench.command((0.1, 0.0)))
        bench.take(bench.supervisor.on_bad_odometry('odom: position is nan', bench.now))
        assert bench.take(bench.supervisor.check_inputs(bench.now)).velocity is None
    assert reasons(bench) == [StopReason.TAKEN_OVER.sentence]
    answer = bench.supervisor.check_inputs(bench.now + 10.0)
    assert answer.velocity == STANDSTILL
    assert bench.supervisor.trial.pause_reason is StopReason.STALE_ODOMETRY


def test_a_local_grid_of_somewhere_else_is_not_to_be_trusted():
    bench = driving()
    row, col = GRID.cell_from_world(bench.pose.x, bench.pose.y)
    for _ in range(60):
        bench.pose = dataclasses.replace(bench.pose, stamp=bench.now + DT)
        bench.supervisor.on_neighbourhood(
            Neighbourhood(bench.now, row + 5, col, np.zeros((3, 3), np.int8)), bench.now)
        bench.take(bench.supervisor.on_pose(bench.pose, bench.now))
    assert bench.velocity == STANDSTILL
    assert bench.supervisor.trial.pause_reason is StopReason.BAD_INPUT
    [text] = reasons(bench)
    x, y = GRID.world_from_cell(row + 5, col)
    assert f'it shows the place around ({x:g}, {y:g}) m' in text
    assert bench.run().outcome is Outcome.GOAL


def test_a_trial_continues_because_nobody_drives_any_more():
    bench = driving()
    bench.take(bench.command((0.1, 0.0)))
    bench.run()
    assert 'trial 1 continues: nobody is driving any more' in [text for _, text in bench.lines]


class TestHeartbeat:
    def watched(self, beats):
        """PathTracker for 3 s in a trial that needs a heartbeat; return the bench."""
        bench = Bench(heartbeat=True)
        bench.tick()
        bench.supervisor.heartbeat.on_heartbeat()
        assert bench.supervisor.start(bench.now) == ''
        for i in range(60):
            bench.tick()
            if beats and i % 10 == 0:
                bench.supervisor.heartbeat.on_heartbeat()
            bench.take(bench.supervisor.check_inputs(bench.now))
        return bench

    def test_without_one_no_trial_starts(self):
        bench = Bench(heartbeat=True)
        bench.tick()
        assert 'start teleop_node, or set heartbeat:=false' in bench.supervisor.start(bench.now)
        assert Bench().start().supervisor.trial.run is not None

    def test_a_trial_runs_while_it_comes(self):
        assert self.watched(beats=True).supervisor.trial.run is not None

    def test_a_trial_ends_when_it_does_not(self):
        bench = self.watched(beats=False)
        assert bench.supervisor.status.stop_reason is StopReason.NO_HEARTBEAT
        assert bench.supervisor.status.outcome is Outcome.STOPPED
        assert bench.velocity == STANDSTILL

    def test_a_controller_that_was_held_up_finds_what_came_meanwhile(self):
        bench = self.watched(beats=True)
        bench.supervisor.heartbeat.update(bench.now + 30.0)
        assert not bench.supervisor.heartbeat.is_missing


def frozen(bench):
    """Let odometry arrive whose stamps stand still, and fresh local grid, for a second."""
    inputs = bench.supervisor.sensing.inputs
    for k in range(20):
        now = bench.now + DT * k
        bench.supervisor.on_neighbourhood(bench.supervisor.sensing.local_grids.newest, now)
        problem = inputs.poses.check(bench.pose, bench.now)
        assert problem
        inputs.odometry.pass_over(now, problem)
        bench.take(bench.supervisor.check_inputs(now))
    return bench.now + 0.95


def test_odometry_whose_stamps_stand_still_is_not_said_to_be_absent():
    bench = driving()
    now = frozen(bench)
    said = (f'odometry arrives but does not count: its stamps do not advance (last '
            f'{bench.now:.2f} s)')
    assert reasons(bench) == [said]
    assert bench.supervisor.status.reason.endswith(said)
    bench.supervisor.stop()
    assert bench.supervisor.start(now) == said
    bench.teleop((0.2, 0.0), now)
    bench.teleop((0.2, 0.0), now)
    assert said in bench.supervisor.output.held


def test_stamps_that_stood_before_anybody_listened_are_not_called_a_slow_link():
    bench = driving()
    bench.supervisor.stop()
    old = dataclasses.replace(bench.pose, stamp=bench.now - 30.0)
    poses = PoseFilter(bench.supervisor.settings, bench.supervisor.refusals)
    said = [poses.check(old, bench.now + k) for k in range(3)]
    assert 'is the link that slow' in said[0]  # nobody can know better yet
    assert said[1:] == [f'its stamps do not advance (last {old.stamp:.2f} s)'] * 2


@pytest.mark.parametrize(('spoil', 'said'), [
    (lambda inputs, now: inputs.local_grid.pass_over(
        now, 'neighbourhood: resolution is 1 m'),
     'neighbourhood arrives but does not count: neighbourhood: resolution is 1 m'),
    (lambda inputs, now: None, 'no neighbourhood has arrived for 2.0 s')])
def test_a_neighbourhood_that_was_refused_is_not_said_to_be_absent(spoil, said):
    bench = driving()
    bench.supervisor.stop()
    now = bench.now + 2.0
    bench.supervisor.sensing.inputs.odometry.on_arrival(now)
    spoil(bench.supervisor.sensing.inputs, now)
    assert bench.supervisor.start(now) == said


@pytest.mark.parametrize('look', ['check_inputs', 'guard'])
def test_a_controller_that_was_suspended_pauses_and_says_that_it_slept(look):
    bench = driving()
    supervisor = bench.supervisor
    supervisor.check_inputs(bench.now)
    getattr(supervisor, look)(bench.now + 30.0)
    supervisor.check_inputs(bench.now + 30.0)
    [reason] = reasons(bench)
    assert 'no odometry has been read for 30.0 s, of which this program itself stood' in reason


def test_a_neighbourhood_of_another_time_is_named_with_how_far_it_is_off():
    bench = driving()
    bench.supervisor.on_neighbourhood(dataclasses.replace(
        bench.supervisor.sensing.local_grids.newest, stamp=bench.now + 3.0), bench.now)
    bench.tick(sees=False)
    [reason] = reasons(bench)
    assert 'the stamp of the neighbourhood is 2.95 s ahead of that of odometry' in reason
