"""A controller that sees farther than one cell: it remembers that, and decides by the nine."""

import numpy as np
import pytest

from control_field.records import Outcome
from control_field_node.inputs.localisation import Localisation
from control_field_node.settings import Settings
from controller_bench import Bench, GOAL
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State

REACH = 3


class FarSighted(Bench):
    """A bench whose neighbourhoods show seven cells a side."""

    def look(self):
        row, col = GRID.cell_from_world(self.pose.x, self.pose.y)
        world = np.pad(self.world, REACH, constant_values=100)
        self.supervisor.on_neighbourhood(Neighbourhood(
            self.now, row, col, world[row:row + 2 * REACH + 1, col:col + 2 * REACH + 1].copy()),
            self.now)


def started(world=None):
    bench = FarSighted(world=world)
    bench.tick()
    assert not bench.supervisor.start(bench.now)
    for _ in range(3):
        bench.tick()
    return bench


def test_what_is_seen_far_away_is_remembered_at_once():
    world = np.zeros(GRID.shape, np.int8)
    world[7, 5] = 100
    bench = started(world)
    known = bench.supervisor.trial.run.policy.state.ground.known
    assert known[7, 5] == 100
    assert (known[2:9, 0:7] >= 0).all()
    assert known[5, 8] == -1


def test_a_trial_takes_the_same_steps_where_nothing_is_in_the_way():
    steps = []
    for kind in (Bench, FarSighted):
        bench = kind()
        bench.tick()
        assert not bench.supervisor.start(bench.now)
        while bench.supervisor.status.state is State.RUNNING:
            bench.tick()
        assert bench.supervisor.status.outcome is Outcome.GOAL
        steps.append([(row['row'], row['col'], row['action'], row['kind']) for row in bench.rows])
    assert steps[0] == steps[1]


def test_a_wall_across_the_way_is_left_before_the_robot_stands_at_it():
    world = np.zeros(GRID.shape, np.int8)
    world[3:8, 7] = 100
    rows = {}
    for kind in (Bench, FarSighted):
        bench = kind(world=world)
        bench.tick()
        assert not bench.supervisor.start(bench.now)
        while bench.supervisor.status.state is State.RUNNING:
            bench.tick()
        assert bench.supervisor.status.outcome is Outcome.GOAL
        rows[kind] = bench.rows
    assert len(rows[FarSighted]) < len(rows[Bench])
    turns = {kind: next(row['col'] for row in rows[kind] if row['kind']) for kind in rows}
    assert turns[Bench] == 6
    assert turns[FarSighted] < 6


@pytest.mark.parametrize(('seconds', 'outcome'), [(8.0, Outcome.GOAL), (60.0, Outcome.GAVE_UP)])
def test_who_stands_in_the_only_way_far_away_is_waited_for_a_while(seconds, outcome):
    world = np.full(GRID.shape, 100, np.int8)
    world[5] = 0
    bench = started(world)
    world[5, 6] = 100
    end = bench.now + seconds
    while bench.supervisor.status.state is State.RUNNING and bench.now < end:
        bench.tick()
    world[5, 6] = 0
    assert bench.run().outcome is outcome


@pytest.mark.parametrize('x', [0.875, 0.9])
def test_of_a_neighbourhood_that_had_to_be_moved_the_nine_are_left(x):
    where = Localisation(Settings(anchoring=True), 0)
    where.take_field(straight_field(GOAL))
    where.place(Pose(1.0, x, 1.375, 0.0), None)
    wide = Neighbourhood(1.0, 5, 3, np.zeros((7, 7), np.int8))
    assert where.moved(wide) is wide
    moved = where.moved(Neighbourhood(1.0, 5, 4, np.zeros((7, 7), np.int8)))
    assert (moved.row, moved.col, moved.cells.shape) == (5, 3, (3, 3))
