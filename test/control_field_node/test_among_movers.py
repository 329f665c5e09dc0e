"""A robot, its controller and its learner among things that move."""

from dataclasses import replace

import pytest

from benchmarks.movers import Bench, conditions


def rides(kind, fine=1, seed=0, n_trials=3, settings=()):
    found = next(c for c in conditions(fine, tuple(settings)) if c.kind == kind)
    few = replace(found, n_trials=n_trials, n_after=1)
    return list(Bench(few.tasks[0], few, seed).run_among_movers())


@pytest.mark.parametrize('fine', [1, 5])
def test_among_wandering_discs_it_gets_to_the_goal_and_runs_into_none(fine):
    made = rides('wander', fine)
    assert [ride.outcome for ride in made] == ['goal'] * 4
    assert not any(ride.robot_contacts for ride in made)
    assert made[-1].fidelity == 1.0


def test_a_run_is_the_same_every_time():
    assert rides('any', n_trials=1) == rides('any', n_trials=1)


def test_a_monitor_that_leaves_out_the_own_cell_runs_into_them():
    blind = {'own_cell': False, 'mover_speed': 0.0, 'patience': 0.0}.items()
    assert any(ride.robot_contacts for ride in rides('any', seed=1, n_trials=4, settings=blind))
    assert not any(ride.robot_contacts for ride in rides('any', seed=1, n_trials=4))
