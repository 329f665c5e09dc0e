"""What comes into the way is waited for; nothing is decided meanwhile, nothing learnt."""

from dataclasses import replace

import pytest

from control_field.parameters import Parameters
from control_field.records import Kind, Outcome
from control_field.robot.stop_rules import StopReason
from control_field_node.diagnostics import diagnostic_from_supervisor
from control_field_node.driving.trial_run import WAITING
from controller_bench import Bench, DT, GOAL
from controller_helpers import GRID, straight_field
from moving_things import block, clear, is_waiting, remembering, wait_until, waiting
from msgs_bridge.messages.trial_status import State


def kinds(bench):
    return {int(row['kind']) for row in bench.rows}


@pytest.mark.parametrize('lockstep', [False, True])
def test_what_goes_again_was_never_decided_on(lockstep):
    bench = remembering(lockstep=lockstep)
    waiting(bench)
    n_rows = len(bench.rows)
    for _ in range(20):  # a second
        bench.tick()
        assert bench.velocity[0] == 0.0
    assert len(bench.rows) == n_rows
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL
    assert kinds(bench) == {Kind.FIELD}
    assert bench.supervisor.status.reinforcements == 0


def test_what_stays_is_gone_around_as_ever():
    bench = waiting()
    began = bench.now
    wait_until(bench, lambda: not is_waiting(bench))
    assert 2.0 - DT <= bench.now - began <= 2.0 + 2 * DT
    assert bench.run().outcome is Outcome.GOAL
    assert Kind.BLOCKED in kinds(bench)


def test_a_step_is_waited_for_in_its_middle():
    bench = remembering()
    wait_until(bench, lambda: bench.supervisor.trial.run.policy.n_steps == 2)
    row, col = GRID.cell_from_world(bench.pose.x, bench.pose.y)
    block(bench, (row, col + 1))
    n_rows = len(bench.rows)
    bench.tick()
    assert is_waiting(bench)
    clear(bench)
    wait_until(bench, lambda: len(bench.rows) > n_rows)
    assert GRID.cell_from_world(bench.pose.x, bench.pose.y) == (row, col + 1)
    assert bench.run().outcome is Outcome.GOAL


def test_without_patience_nothing_is_waited_for():
    bench = remembering(patience=0.0)
    block(bench, (5, 5))
    while bench.supervisor.trial.run is not None:
        bench.tick()
        assert bench.supervisor.trial.run is None or not is_waiting(bench)
    assert Kind.BLOCKED in kinds(bench)


def test_a_wall_that_was_never_seen_free_is_not_waited_for():
    bench = Bench().start()
    block(bench, (5, 5))
    n_waits = 0
    while bench.supervisor.trial.run is not None:
        bench.tick()
        n_waits += bench.supervisor.trial.run is not None and is_waiting(bench)
    assert n_waits == 0
    assert Kind.BLOCKED in kinds(bench)


def test_it_is_waited_for_once():
    bench = waiting()
    wait_until(bench, lambda: not is_waiting(bench))
    bench.supervisor.trial.run.interrupt()  # and the trial goes on at the same place
    while bench.supervisor.trial.run is not None:
        assert not is_waiting(bench)
        bench.tick()


def test_no_rule_counts_the_time():
    bench = remembering(patience=60.0, progress_time=3.0, time_limit=20.0)
    waiting(bench)
    for _ in range(1000):  # 50 s
        bench.tick()
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL


def test_it_says_what_it_does():
    bench = waiting()
    status = bench.supervisor.status
    assert (status.state, status.reason) == (State.RUNNING, WAITING)
    assert status.sentence.endswith(WAITING)
    said = {item.key: item.value for item in
            diagnostic_from_supervisor(bench.supervisor, 'controller').values}
    assert said['held'] == WAITING
    clear(bench)
    bench.tick()
    assert not bench.supervisor.status.reason
    assert not bench.supervisor.output.held


def test_a_clock_that_is_set_is_no_time_waited():
    bench = waiting(remembering(neighbourhood_timeout=60.0))
    bench.pose = replace(bench.pose, stamp=bench.pose.stamp + 30.0)
    bench.tick()
    assert is_waiting(bench)


def test_whoever_steps_onto_the_goal_is_waited_for():
    bench = waiting(cell=GOAL)
    for _ in range(20):
        bench.tick()
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL
    assert kinds(bench) == {Kind.FIELD}


def test_the_paper_waits_as_well():
    bench = waiting(remembering(parameters=Parameters(profile='paper')))
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL
    assert not any(row['reward'] for row in bench.rows)


@pytest.mark.parametrize('backs_off', [False, True])
def test_from_what_comes_it_backs_off_if_it_is_to(backs_off):
    bench = remembering(backs_off=backs_off)
    wait_until(bench, lambda: bench.pose.x > 1.1)
    x = waiting(bench).pose.x
    for _ in range(20):
        bench.tick()
    assert (bench.pose.x < x - 0.01) == backs_off
    assert bench.pose.x > x - 0.25
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL


def seal_off(bench, cell, reach):
    """Close a cell in on all sides."""
    row, col = cell
    block(bench, *[(r, c) for r in range(row - reach, row + reach + 1)
                   for c in range(col - reach, col + reach + 1)
                   if max(abs(r - row), abs(c - col)) == reach])


def test_before_it_gives_up_it_waits_and_looks_whether_what_came_has_gone():
    bench = remembering()
    seal_off(bench, GOAL, 2)
    wait_until(bench, lambda: bench.supervisor.trial.run.policy.doubt, 120.0)
    clear(bench)
    assert bench.run().outcome is Outcome.GOAL


@pytest.mark.parametrize(('patience', 'longest'), [(0.0, 1.0), (2.0, 15.0)])
def test_what_stays_closed_is_given_up(patience, longest):
    bench = remembering(patience=patience)
    began = bench.now
    seal_off(bench, (5, 3), 1)
    assert bench.run().stop_reason is StopReason.NO_WAY
    assert bench.now - began < longest


@pytest.mark.parametrize('something_moves', [True, False])
def test_where_things_move_all_that_was_seen_closed_is_looked_at_once_more(something_moves):
    bench = Bench(field=False)
    bench.supervisor.accept_field(straight_field(GOAL))
    bench.start()
    row, col = GRID.cell_from_world(bench.pose.x, bench.pose.y)
    block(bench, (row + 1, col))
    bench.tick()
    if something_moves:
        clear(bench)
        bench.tick()
    # What now shuts it in was never seen free: nothing has come there.
    seal_off(bench, (row, col), 1)
    end = bench.now + 20.0
    while bench.supervisor.trial.run is not None and bench.now < end:
        bench.tick()
    clear(bench)
    assert (bench.run().outcome is Outcome.GOAL) == something_moves
