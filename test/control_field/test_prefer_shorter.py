import numpy as np
import pytest

from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import explores
from strategies import practise, segment, taught

OPEN = np.zeros((9, 9), np.int8)
#: Three sides of a square, where the fourth is free.
ROUND = segment((1, 1), (1, 7), (7, 7), (7, 1))


def length_from(learner, occupancy, start):
    return GridWorld(occupancy, learner.parameters).flow_lengths(learner.refresh.field)[start]


def test_what_was_shown_is_kept_unless_shorter_ways_are_preferred():
    lengths = []
    for prefer_shorter in (False, True):
        learner = taught(ROUND, OPEN.shape, OPEN, prefer_shorter=prefer_shorter)
        exploring = explores(learner.parameters, spread=False)
        practise(learner, OPEN, [(4, 1), (1, 1)], exploring=exploring)
        lengths.append(length_from(learner, OPEN, (1, 1)))
    assert lengths[0] == len(ROUND) - 1
    assert lengths[1] < 8.0


@pytest.mark.parametrize(('spread', 'prefer_shorter'), [
    (False, False), (False, True), (True, False), (True, True)])
def test_trials_explore_from_chosen_starts_or_where_shorter_ways_are_preferred(
        spread, prefer_shorter):
    learner = taught(ROUND, OPEN.shape, OPEN, prefer_shorter=prefer_shorter)
    assert explores(learner.parameters, spread) == (spread or prefer_shorter)
