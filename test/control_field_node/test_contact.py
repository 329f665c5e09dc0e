"""What runs into a standing robot is no collision of the trial; what a robot runs into is."""

import pytest

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from controller_bench import driving, DT
from moving_things import clear, remembering, waiting


@pytest.fixture(params=[False, True], ids=['live', 'lockstep'])
def standing(request):
    """Return a bench whose robot stands in a trial."""
    bench = waiting(remembering(lockstep=request.param))
    for _ in range(10):
        bench.tick()
    return bench


def touch(bench, touches=True):
    return bench.take(bench.supervisor.on_contact(touches, bench.now))


def test_what_a_robot_runs_into_ends_the_trial():
    bench = driving()
    touch(bench)
    assert bench.supervisor.status.outcome is Outcome.COLLISION
    assert bench.velocity == (0.0, 0.0)


def test_what_runs_into_a_standing_robot_pauses_the_trial_until_it_is_gone(standing):
    bench = standing
    n_rows = len(bench.rows)
    touch(bench)
    clear(bench)
    for _ in range(40):  # 2 s
        bench.tick()
        assert bench.is_paused_by(StopReason.TOUCHED)
        assert bench.velocity == (0.0, 0.0)
    touch(bench, False)
    bench.tick()
    assert bench.is_paused_by(StopReason.TOUCHED)  # it may come again
    assert bench.run().outcome is Outcome.GOAL
    assert {int(row['reward']) for row in bench.rows[n_rows:]} == {0}


def test_it_may_not_last_for_ever(standing):
    began = standing.now
    touch(standing)
    status = standing.run()
    assert status.outcome is Outcome.COLLISION
    assert standing.now - began == pytest.approx(30.0, abs=2.5 * DT)


def test_it_may_come_again(standing):
    for _ in range(3):
        touch(standing)
        standing.tick()
        touch(standing, False)
        standing.tick()
        assert standing.is_paused_by(StopReason.TOUCHED)
    clear(standing)
    assert standing.run().outcome is Outcome.GOAL


def test_where_no_contact_is_allowed_each_is_a_collision():
    bench = waiting(remembering(contact_timeout=0.0))
    for _ in range(10):
        bench.tick()
    touch(bench)
    assert bench.supervisor.status.outcome is Outcome.COLLISION


def test_a_robot_that_brakes_still_drives():
    bench = driving()
    bench.supervisor.output.velocity = (0.0, 0.0)
    touch(bench)
    assert bench.supervisor.status.outcome is Outcome.COLLISION


def test_nothing_is_said_of_contacts_outside_trials():
    bench = driving()
    bench.supervisor.stop()
    touch(bench)
    assert bench.supervisor.status.outcome is Outcome.STOPPED
    bench.start()
    bench.tick()
    assert bench.supervisor.trial.pause is None
