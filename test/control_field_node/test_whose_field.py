"""The controller says by whose field it drives, and drives no trial on by another task's."""

from dataclasses import replace

import pytest

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from controller_bench import Bench, GOAL
from controller_helpers import straight_field
from msgs_bridge.messages.trial_status import State

OWN, NEWER, OTHER = 'kitchen:0123456789abcdef', 'kitchen:00000000000000aa', 'hall:fedcba9876543210'


def field(memory, goal=GOAL, revision=1):
    return replace(straight_field(goal, revision=revision), memory=memory)


@pytest.fixture
def bench():
    """Return a controller with a field, ready to start."""
    bench = Bench(field=False)
    bench.supervisor.accept_field(field(OWN))
    bench.tick()
    return bench


def finish(bench):
    """Drive to the end; return the status of the end, and whose fields were driven by."""
    assert bench.supervisor.start(bench.now) == ''
    memories = [bench.supervisor.status.memory]
    for _ in range(20):
        bench.tick()
    yield
    while bench.supervisor.trial.run is not None:
        memories.append(bench.supervisor.status.memory)
        bench.tick()
    yield bench.supervisor.status, list(dict.fromkeys(memories))


def test_it_says_by_whose_field_it_drives_from_start_to_end(bench):
    assert (bench.supervisor.status.state, bench.supervisor.status.memory) == (State.IDLE, OWN)
    assert ('info', 'control field revision 1 of task kitchen') in bench.lines
    drive = finish(bench)
    next(drive)
    status, memories = next(drive)
    assert (status.state, status.outcome, status.memory) == (State.ENDED, Outcome.GOAL, OWN)
    assert memories == [OWN]


def test_a_newer_field_of_its_task_is_driven_on_by(bench):
    drive = finish(bench)
    next(drive)
    bench.supervisor.accept_field(field(NEWER, (10, 9), 2))
    status, memories = next(drive)
    assert (status.outcome, memories) == (Outcome.GOAL, [OWN, NEWER])


def test_a_field_of_another_task_ends_the_trial_and_is_there_for_the_next(bench):
    drive = finish(bench)
    next(drive)
    bench.supervisor.accept_field(field(OTHER, (10, 9)))
    status, memories = next(drive)
    assert (status.outcome, status.stop_reason) == (Outcome.STOPPED, StopReason.WRONG_FIELD)
    assert 'task hall' in status.reason
    assert (status.memory, memories) == (OWN, [OWN])
    assert bench.supervisor.field.current.memory == OTHER
    assert bench.supervisor.start(bench.now) == ''
    assert bench.supervisor.status.memory == OTHER


def test_fields_that_do_not_say_whose_they_are_are_driven_on_by(bench):
    drive = finish(bench)
    next(drive)
    bench.supervisor.accept_field(field('', (10, 9), 2))
    assert next(drive)[0].outcome is Outcome.GOAL
