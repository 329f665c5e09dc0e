"""What is worth waiting for: what was not there before."""

import numpy as np
import pytest

from control_field.kernels.steps import StepRules
from control_field.kernels.waiting import comes_into_the_way

RULES = StepRules(False, False, 8)
EAST, NORTH_EAST, NORTH = 0, 1, 2


def mask(*headings):
    return sum(1 << heading for heading in headings)


def comes(known, heading, blocked, rules=RULES):
    return comes_into_the_way(known, 1, 1, heading, blocked, rules)


def test_what_stands_where_it_was_free_is_waited_for():
    known = np.zeros((3, 3), np.int8)
    assert comes(known, EAST, mask(EAST))
    assert not comes(known, EAST, mask(NORTH))
    assert not comes(known, EAST, 0)


@pytest.mark.parametrize('state', [-1, 1, 99, 100])
def test_what_was_never_seen_free_is_not(state):
    known = np.zeros((3, 3), np.int8)
    known[1, 2] = state
    assert not comes(known, EAST, mask(EAST))


def test_a_diagonal_needs_room_on_both_sides():
    known = np.zeros((3, 3), np.int8)
    for blocked in (EAST, NORTH, NORTH_EAST):
        assert comes(known, NORTH_EAST, mask(blocked))
    assert not comes(known, NORTH_EAST, mask(EAST), StepRules(True, False, 8))


def test_nobody_waits_at_a_wall_for_what_stands_beside_it():
    known = np.zeros((3, 3), np.int8)
    known[1, 2] = -1
    assert not comes(known, NORTH_EAST, mask(EAST, NORTH))
    known[1, 2] = 100  # as remembered: the step was not open before
    assert not comes(known, NORTH_EAST, mask(EAST, NORTH))


def test_outside_the_workspace_nothing_comes():
    known = np.zeros((3, 2), np.int8)
    assert not comes(known, EAST, mask(EAST))
