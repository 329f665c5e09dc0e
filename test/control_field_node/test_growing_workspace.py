"""A controller whose field comes in another rectangle of the same cells."""

import dataclasses
import itertools

import numpy as np
import pytest

from control_field.grid import CellBox, Grid
from control_field.local_grid import crop_neighbourhood
from control_field.records import ControlField, Outcome
from control_field.robot.limits import STANDSTILL
from control_field.robot.stop_rules import StopReason
from controller_bench import Bench, DT
from controller_helpers import GRID, straight_field
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose

#: The workspace of the others, and one with more cells on every side.
LARGER = GRID.window(CellBox(-7, -5, 22, 29))


class GrowingBench(Bench):
    """A bench whose sight has no bounds: the world is free around what is drawn."""

    def look(self):
        row, col = GRID.cell_from_world(self.pose.x, self.pose.y)
        cells = crop_neighbourhood(np.pad(self.world, 50), row + 50, col + 50)
        grid = self.supervisor.grid or GRID
        self.supervisor.on_neighbourhood(Neighbourhood(
            self.now, *grid.cell_from_world(self.pose.x, self.pose.y), cells), self.now, grid)

    def cells(self):
        """Return the places of the decisions, as cells of `GRID`."""
        return [GRID.cell_from_world(*place) for place in self.places]

    def take(self, answer):
        grid = self.supervisor.trial.grid
        for table in answer.rows:
            self.places += [grid.world_from_cell(int(row['row']), int(row['col']))
                            for row in table]
        return super().take(answer)

    places = ()

    def start(self):
        self.places = []
        return super().start()


def shifted(goal):
    """Return a cell of `GRID` as one of `LARGER`."""
    return goal[0] + 7, goal[1] + 5


def larger_field(goal, **values):
    return straight_field(shifted(goal), revision=2, grid=LARGER, **values)


def test_in_a_trial_a_field_of_a_larger_workspace_is_driven_on_where_the_robot_is():
    world = np.zeros(GRID.shape, np.int8)
    world[5, 6] = 100
    bench = GrowingBench(world=world).start()
    while len(bench.places) < 5:
        bench.tick()
    seen = bench.supervisor.trial.run.policy.state.ground.known == 100
    assert seen[5, 6]
    assert bench.supervisor.accept_field(larger_field((5, 15)))
    status = bench.run()
    assert (status.outcome, status.revision) == (Outcome.GOAL, 2)
    assert GRID.cell_from_world(bench.pose.x, bench.pose.y) == (5, 15)
    cells = bench.cells()
    assert all(max(abs(a - c), abs(b - d)) <= 1
               for (a, b), (c, d) in itertools.pairwise(cells))
    assert (5, 6) not in cells
    assert any('continues' in text for _, text in bench.lines)


def test_what_a_trial_has_seen_is_at_its_place_on_the_larger_field():
    world = np.zeros(GRID.shape, np.int8)
    world[5, 6] = 100
    bench = GrowingBench(world=world).start()
    while len(bench.places) < 5:
        bench.tick()
    bench.supervisor.accept_field(larger_field((5, 15)))
    while bench.supervisor.status.revision == 1:
        bench.tick()
    run = bench.supervisor.trial.run
    assert run.policy.state.ground.known[shifted((5, 6))] == 100
    assert run.grid == bench.supervisor.grid == LARGER
    observation = bench.supervisor.sensing.observe(bench.now, False)
    assert observation.cell == LARGER.cell_from_world(bench.pose.x, bench.pose.y)


def test_a_field_that_came_in_a_trial_is_that_of_the_next_one():
    bench = GrowingBench().start()
    bench.tick()
    bench.supervisor.accept_field(larger_field((5, 15)))
    bench.take(bench.supervisor.stop())
    assert bench.supervisor.trial.grid == GRID
    bench.start()
    assert bench.run().outcome is Outcome.GOAL
    assert bench.supervisor.trial.grid == LARGER


@pytest.mark.parametrize(('memory', 'is_accepted'), [('', False), ('memory:other:1', True)])
def test_between_trials_a_field_of_other_cells_is_taken_if_it_is_of_another_memory(
    memory, is_accepted,
):
    bench = GrowingBench()
    bench.tick()
    other = dataclasses.replace(
        straight_field((5, 5), grid=Grid(10, 10, 0.5, -0.1)), memory=memory)
    assert bench.supervisor.accept_field(other) == is_accepted
    assert (bench.supervisor.grid == other.grid) == is_accepted
    assert bool(bench.supervisor.field.refusal) != is_accepted


def test_in_a_trial_a_field_of_other_cells_is_refused_with_what_to_do():
    bench = GrowingBench().start()
    other = dataclasses.replace(
        straight_field((5, 5), grid=Grid(10, 10, 0.5)), memory='memory:other:1')
    assert not bench.supervisor.accept_field(other)
    assert 'between trials' in bench.supervisor.field.refusal


def outside(**settings):
    """Return a bench whose robot stands two metres outside of the workspace."""
    bench = GrowingBench(**settings)
    bench.pose = Pose(1.0, -2.0, 1.0, 0.0)
    bench.tick()
    return bench


def test_a_person_drives_where_no_field_is_and_no_trial_begins_there():
    bench = outside()
    assert 'until a larger field has come' in bench.supervisor.start(bench.now)
    for _ in range(20):
        bench.take(bench.teleop((0.15, 0.0)))
        bench.tick(velocity=bench.velocity)
    assert bench.pose.x > -1.95
    bench.supervisor.accept_field(larger_field((5, 9)))
    bench.supervisor.manual.release()
    bench.pose = Pose(bench.now + DT, -1.0, 1.0, 0.0)
    assert bench.start().run().outcome is Outcome.GOAL


def test_a_person_is_held_by_what_is_seen_outside_of_the_workspace_too():
    bench = outside()
    wall = np.zeros((3, 3), np.int8)
    wall[:, 2] = 100
    cell = GRID.cell_from_world(bench.pose.x, bench.pose.y)
    bench.supervisor.on_neighbourhood(
        Neighbourhood(bench.now, *cell, wall), bench.now, bench.supervisor.grid)
    velocity = (0.0, 0.0)
    for _ in range(60):
        velocity = bench.teleop((0.15, 0.0)).velocity
        bench.take(bench.supervisor.on_pose(bench.pose, bench.now))
        bench.pose = dataclasses.replace(
            bench.pose, x=bench.pose.x + velocity[0] * DT, stamp=bench.now + DT)
        bench.supervisor.on_neighbourhood(
            Neighbourhood(bench.now, *cell, wall), bench.now, bench.supervisor.grid)
        bench.supervisor.on_pose(bench.pose, bench.now)
    edge = GRID.world_from_cell(cell[0], cell[1] + 1)[0] - GRID.resolution / 2
    assert velocity == STANDSTILL
    assert bench.pose.x + 0.105 <= edge


def test_a_trial_that_leaves_the_workspace_of_its_field_ends():
    bench = GrowingBench().start()
    bench.tick()
    bench.pose = dataclasses.replace(bench.pose, x=-0.05)
    bench.supervisor.sensing.inputs.poses.order.place_anew()
    bench.tick(velocity=STANDSTILL)
    assert bench.supervisor.trial.ended_by is StopReason.OUTSIDE_WORKSPACE


def test_a_void_field_has_no_workspace():
    bench = GrowingBench()
    bench.supervisor.accept_field(ControlField.void(Grid(1, 1, 0.25, -0.125, -0.125)))
    assert bench.supervisor.grid is None
    assert bench.supervisor.accept_field(larger_field((5, 9)))


def test_a_corrected_pose_stays_where_it_is_when_the_workspace_grows():
    bench = GrowingBench(anchoring=True)
    for _ in range(5):
        bench.tick(velocity=(0.1, 0.0))
    before = bench.supervisor.sensing.localisation.estimate
    bench.supervisor.accept_field(larger_field((5, 9)))
    after = bench.supervisor.sensing.localisation.estimate
    assert (after.x, after.y, after.yaw) == (before.x, before.y, before.yaw)
    assert (after.row, after.col) == shifted((before.row, before.col))
    bench.tick(velocity=(0.1, 0.0))
    assert abs(bench.supervisor.sensing.pose.x - bench.pose.x) < 0.05
