"""A robot that is no disc on its way, without ROS."""

from dataclasses import replace

import numpy as np
import pytest

from controller_bench import Bench, GRID
from msgs_bridge.messages.trial_status import State

#: 0.215 m to its corners, in cells of 0.25 m: between two walls it cannot turn.
LONG = '[[0.2, 0.08], [-0.2, 0.08], [-0.2, -0.08], [0.2, -0.08]]'


@pytest.mark.parametrize(('walls', 'yaw'), [([4, 6], 0.0), ([4, 6], 0.08), ([], 1.5), ([3], 2.0)])
def test_it_drives_through_a_corridor_and_turns_where_there_is_room(walls, yaw):
    world = np.zeros(GRID.shape, np.int8)
    world[walls] = 100
    bench = Bench(world=world, footprint=LONG)
    bench.pose = replace(bench.pose, yaw=yaw)
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
