"""The world and settings in which the robot visibly fails at first, and then improves."""

import numpy as np

from benchmarks.first_failures import in_a_line, trials
from control_field.records import Outcome

N_DRIVES = 24


def test_whoever_shows_the_way_the_first_trials_fail_and_the_robot_improves():
    drives = [trials(seed) for seed in range(N_DRIVES)]
    reached = np.array([[each.outcome is Outcome.GOAL for each in tries] for tries in drives])
    steps = np.array([[each.n_steps for each in tries] for tries in drives])
    written = '\n'.join(map(in_a_line, drives))
    assert not reached[:, 0].any(), written
    assert (~reached[:, 1]).mean() > 0.8, written
    # Once it has reached the goal it always does, and from the fifth trial on everybody's.
    assert (np.diff(reached.astype(int), axis=1) >= 0).all(), written
    assert reached[:, 4:].all(), written
    assert steps[:, -1].mean() < 0.75 * steps[:, 0].mean(), written
    assert not any(each.n_reinforcements for tries in drives for each in tries[-4:]), written


def test_what_the_demo_shows():
    assert in_a_line(trials(0, 6)) == '(50) (50) 43 32 32 32'
