"""A robot behind a link: late, irregular, lost. None may make it touch anything."""

import math

import numpy as np
import pytest

from benchmarks import late_poses
from benchmarks.late_poses import cluttered, LateBench, learnt, Link, straight_to
from control_field.grid import Grid
from control_field.robot.sent_commands import moved
from control_field.robot.stop_rules import StopReason
from control_field_node.diagnostics import diagnostic_from_supervisor
from world_maps.clearance import Clearance
from world_maps.world import World

CALM, WORSE = Link(), Link(delay=0.3)


def bench(link, seed=1, **settings):
    return LateBench(*cluttered(seed), link, seed, settings=settings)


@pytest.mark.parametrize('link', [
    Link(delay=0.2), Link(delay=0.3), Link(0.15, 0.0, 0.0, 0.15),
    Link(delay=0.1, jitter=0.2, loss=0.3), Link(delay=0.1, jitter=0.2, loss=0.3, overtakes=True),
    Link(delay=0.2, clock_offset=1e6), Link(delay=0.2, clock_offset=0.15),
    Link(delay=0.2, clock_offset=-0.15)])
def test_up_to_300_ms_late_every_trial_succeeds_and_nothing_is_touched(link):
    rides = [bench(link, seed).run() for seed in (1, 3, 5)]
    assert all(ride.is_success for ride in rides), rides


@pytest.mark.parametrize('link', [
    Link(delay=0.45), Link(0.4, 0.0, 0.0, 0.4), Link(0.3, 1.0, 0.5, 0.3, 1.0, 0.5, True),
    Link(0.0, 0.0, 0.5, 0.0, 0.0, 0.5), Link(delay=0.4, command_delay=0.4, good_for=3.0),
    Link(outage=0.6), Link(delay=1.0)])
def test_however_bad_a_link_is_nothing_is_touched(link):
    assert not any(bench(link, seed).run().n_collisions for seed in (1, 3, 7))


#: Bases that stop soon or late after their last command.
SOON, LATE = {'cmd_vel_timeout': 0.5}, {'cmd_vel_timeout': 1.0}
#: Commands alone that turn bad under way, with runs that touched something before that was seen.
TURNS_BAD = [
    (SOON, Link(command_delay=0.7, good_for=4.0), (6, 25)),
    (SOON, Link(command_delay=1.0, good_for=4.0), (54,)),
    (SOON, Link(command_delay=2.0, good_for=4.0), (67, 9)),
    (SOON, Link(1.0, 0.0, 0.0, 1.0, good_for=4.0), (67,)),
    (SOON, Link(command_jitter=0.5), (29,)), (SOON, Link(command_loss=0.8), (11,)),
    (SOON, Link(command_outage=2.0), (3,)),
    (LATE, Link(command_delay=1.0, good_for=4.0), (9, 25, 61))]


def scene_of(seed):
    return cluttered(seed) if seed % 2 else learnt(('task1', 'task2')[seed % 4 // 2])


@pytest.mark.parametrize(('base', 'link', 'seeds'), TURNS_BAD)
def test_commands_that_turn_bad_under_way_let_nothing_be_touched(base, link, seeds, monkeypatch):
    monkeypatch.setattr(late_poses, 'LONGEST', 20.0)
    for seed in seeds:
        ride = LateBench(*scene_of(seed), link, seed, base, base).run()
        assert ride.n_collisions == 0, (seed, ride)


@pytest.mark.parametrize('base', [SOON, LATE])
@pytest.mark.parametrize('link', [CALM, Link(command_delay=0.15)])
def test_what_was_sent_last_may_be_the_last_that_arrives(base, link):
    """When the link falls silent the base goes on until it stops by itself, and hits nothing."""
    late = LateBench(*cluttered(7), link, 7, base, base)
    clearance = Clearance(late.simulation.world, 0.105)
    while late.now < 103.0:
        late.step()
    assert late.supervisor.start(late.now) == ''
    while late.supervisor.trial.run is not None:
        late.step()
        if late.n_steps % 3 == 0:
            assert silent_way(late, base['cmd_vel_timeout'], clearance) >= 0.0, late.now


def silent_way(late, timeout, clearance):
    """Return the least room on the way of a robot that hears nothing more, [m]."""
    place, least = tuple(late.simulation.robot.truth), math.inf
    _, (v, w) = late.commands[-1] if late.commands else (0.0, (0.0, 0.0))
    for _ in range(round(timeout / 0.02)):
        place = moved(place, (v, w, 0.02))
        least = min(least, clearance.at(*place[:2]))
    return least


def test_commands_that_are_late_from_some_time_on_are_the_reason():
    late = bench(Link(command_delay=1.0, good_for=4.0), 9)
    while late.now < 140.0 and late.supervisor.trial.pause_reason is None:
        late.step()
        if late.now > 103.0 and late.supervisor.trial.run is None:
            assert late.supervisor.start(late.now) == ''
    assert late.supervisor.trial.pause_reason is StopReason.LATE_COMMANDS
    assert 'does not do in time' in late.supervisor.status.reason
    assert late.supervisor.output.velocity == (0.0, 0.0)


@pytest.mark.parametrize('robot', [
    {'a_max': 1.0, 'alpha_max': 3.2}, {'noise_std': 0.05}, {'v_max': 0.18}])
def test_a_robot_that_is_inert_coarse_or_slow_is_not_taken_for_late(robot):
    for seed in (1, 3):
        late = LateBench(*cluttered(seed), CALM, seed, robot=robot)
        late.run()
        assert not any('in time' in line for line in late.lines)


def test_a_good_link_costs_no_time():
    """What may be driven blind is a part of what a local grid shows in the open."""
    world = World(Grid(20, 20, 0.25), np.zeros((20, 20), np.int8))
    field = straight_to((10, 16), world.grid)
    ride = LateBench(world, field, CALM, 1).run()
    assert ride.is_success
    start = LateBench(world, field, CALM, 1).simulation.robot.truth
    x, y = world.grid.world_from_cell(10, 16)
    assert ride.seconds < 1.25 * (abs(x - start.x) + abs(y - start.y)) / 0.22 + 3.0


def test_the_latency_is_told_and_slows_the_robot():
    late = bench(WORSE)
    late.run()
    values = {pair.key: pair.value for pair in diagnostic_from_supervisor(
        late.supervisor, '/controller').values}
    assert float(values['odom_age']) == pytest.approx(0.3, abs=0.02)
    assert float(values['latency']) == pytest.approx(0.3, abs=0.1)
    assert 0.4 < float(values['speed_share']) < 0.9
    assert values['clocks_differ'] == 'false'


def test_odometry_that_is_too_old_is_the_reason_and_says_how_old():
    late = bench(Link(delay=0.7, good_for=2.0))
    while late.supervisor.trial.pause_reason is not StopReason.LATE_POSES:
        late.step()
        if late.now > 103.0 and late.supervisor.trial.run is None:
            assert late.supervisor.start(late.now) == ''
        assert late.now < 120.0
    assert '0.70 s old' in late.supervisor.status.reason
    assert late.supervisor.output.velocity == (0.0, 0.0)


def test_a_start_is_refused_with_the_age():
    ride = bench(Link(delay=0.7)).run()
    assert ride.outcome == 'refused'
    assert '0.70 s old' in ride.reason


def test_where_messages_get_lost_a_standstill_is_said_again_until_the_base_has_stopped():
    late = bench(Link(0.0, 0.0, 0.3, 0.0, 0.0, 0.3))
    late.run()
    ends = [velocity for _, velocity in late.commands[-10:]]
    assert ends == [(0.0, 0.0)] * 10
    n = len(late.commands)
    for _ in range(300):
        late.step()
    assert len(late.commands) == n


def test_a_person_behind_a_late_link_touches_nothing_either():
    late = bench(Link(0.3, 0.0, 0.0, 0.3))
    while late.now < 140.0:
        late.step()
        if late.now > 102.0 and late.n_steps % 10 == 0:
            late._take(late.supervisor.manual.on_teleop_command((0.22, 0.4), late.now, 0.1))
    assert late.simulation.n_collisions == 0
    assert late.simulation.robot._distance > 0.1
