"""A robot that is no disc on its way, without ROS."""

from dataclasses import replace

import numpy as np
import pytest

from controller_bench import Bench, GRID
from msgs_bridge.messages.trial_status import State

#: 0.215 m to its corners, in cells of 0.25 m: between two walls it cannot turn.
LONG = '[[0.2, 0.08], [-0.2, 0.08], [-0.2, -0.08], [0.2, -0.08]]'


#: 0.104 m to its corners: it turns in the middle of a cell, with 2 cm to spare.
SHORT = '[[0.1, 0.03], [-0.1, 0.03], [-0.1, -0.03], [0.1, -0.03]]'


@pytest.mark.parametrize(('footprint', 'walls', 'yaw', 'off'), [
    (LONG, [4, 6], 0.0, 0.0), (LONG, [4, 6], 0.08, 0.0), (LONG, [4, 6], 0.0, 0.02),
    (LONG, [], 1.5, 0.0), (LONG, [3], 2.0, 0.0), (SHORT, [4, 6], 3.0, 0.005)])
def test_it_drives_through_a_corridor_and_turns_where_there_is_room(footprint, walls, yaw, off):
    world = np.zeros(GRID.shape, np.int8)
    world[walls] = 100
    bench = Bench(world=world, footprint=footprint)
    bench.pose = replace(bench.pose, y=bench.pose.y + off, yaw=yaw)
    status = bench.start().run(40.0)
    assert (status.state, status.outcome) == (State.ENDED, 'goal')


def test_where_it_cannot_turn_it_stands_and_says_so():
    world = np.zeros(GRID.shape, np.int8)
    world[[4, 6]] = 100
    bench = Bench(world=world, footprint=LONG)
    bench.pose = replace(bench.pose, yaw=np.pi)  # the goal is behind it
    bench.start().run(5.0)
    assert 'blocked or unseen' in bench.supervisor.output.held
    assert bench.run(40.0).stop_reason == 'no_progress'
    assert abs(bench.pose.yaw - np.pi) < 0.3
