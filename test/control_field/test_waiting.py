"""What is worth waiting for: what was not there before."""

import numpy as np
import pytest

from control_field.kernels.steps import StepRules
from control_field.kernels.waiting import (
    CLEAR, comes_into_the_way, GIVE_UP, GO_ROUND, LOOK, look_again, look_ahead, new_record, STAYS,
    take_in, WAIT)

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


FREE, SHUT, UNSEEN = 0, 100, -1


def a_way(state=FREE):
    """Return the record of a trial in nine cells that are remembered as one state."""
    return new_record(np.full((3, 3), state, np.int8))


def see(way, east, rest=FREE, cell=(1, 1)):
    """See everything around the robot's cell in one state, but east of it."""
    cells = np.full((3, 3), rest, np.int8)
    cells[1, 2] = east
    take_in(way, *cell, cells)


def ahead(way, now, patience=2.0):
    return look_ahead(way, now, patience, 1, 1, EAST, RULES)


class TestWaiting:
    def test_what_came_is_waited_for_and_then_stays_until_it_is_seen_to_go(self):
        way = a_way()
        see(way, SHUT)
        assert [ahead(way, now) for now in (5.0, 6.9, 7.0, 7.1)] == [WAIT, WAIT, STAYS, CLEAR]
        see(way, FREE)
        assert ahead(way, 8.0) == CLEAR
        see(way, SHUT)
        assert ahead(way, 9.0) == WAIT

    def test_whoever_goes_and_comes_is_waited_for_from_anew(self):
        way = a_way()
        for now, state in enumerate([SHUT, SHUT, FREE, SHUT, SHUT]):
            see(way, state)
            assert ahead(way, float(now)) == (WAIT if state == SHUT else CLEAR)

    def test_what_was_never_seen_free_is_a_wall(self):
        way = a_way(UNSEEN)
        see(way, SHUT)
        assert ahead(way, 0.0) == CLEAR
        assert way.room[1, 2] == SHUT
        assert not way.came.any()

    def test_what_is_seen_from_the_next_cell_is_the_same(self):
        way = new_record(np.zeros((3, 4), np.int8))
        see(way, FREE)
        cells = np.zeros((3, 3), np.int8)
        cells[2, 1] = SHUT  # north of the next cell
        take_in(way, 1, 2, cells)
        assert look_ahead(way, 0.0, 2.0, 1, 1, EAST, RULES) == CLEAR
        assert look_ahead(way, 0.0, 2.0, 1, 1, NORTH_EAST, RULES) == WAIT

    @pytest.mark.parametrize('side', [5, 61])
    def test_it_may_come_far_away(self, side):
        way, cells = a_way(), np.zeros((side, side), np.int8)
        cells[side // 2 + 1, side // 2 + 2] = SHUT
        take_in(way, 1, 0, cells)
        assert np.argwhere(way.came).tolist() == [[2, 2]]

    def test_what_is_not_seen_changes_nothing(self):
        way = a_way()
        see(way, SHUT)
        before = way.room.copy(), way.came.copy()
        see(way, UNSEEN, UNSEEN)
        np.testing.assert_array_equal(before, (way.room, way.came))


class TestLookingAgain:
    def what_follows(self, way, n=100, patience=2.0, goes_every=0):
        """Return what a trial does that is closed in for ever, until it gives up."""
        known, seen, done = np.full((3, 3), SHUT, np.int8), np.ones((3, 3), np.bool_), []
        while len(done) < n:
            done.append(look_again(way, patience, known, seen))
            if done[-1] == GIVE_UP:
                return done
            assert not seen.all()
            seen[:] = True
            if goes_every and len(done) % goes_every == 0:
                see(way, FREE)
                see(way, SHUT)
        raise AssertionError('it looks for ever')

    def test_where_nothing_came_it_gives_up(self):
        assert self.what_follows(a_way(SHUT)) == [GIVE_UP]

    def test_where_something_came_and_stays_it_looks_six_times(self):
        way = a_way()
        see(way, SHUT)
        assert self.what_follows(way) == [LOOK] * 6 + [GIVE_UP]

    def test_where_things_move_it_goes_round_twice(self):
        way = a_way()
        see(way, SHUT)
        see(way, FREE)
        assert self.what_follows(way) == [GO_ROUND] * 2 + [GIVE_UP]

    def test_where_things_come_and_go_it_looks_often_but_not_for_ever(self):
        way = a_way()
        see(way, SHUT)
        done = self.what_follows(way, goes_every=1)
        assert done == ([LOOK] * 20 + [GO_ROUND]) * 2 + [LOOK] * 20 + [GIVE_UP]

    def test_without_patience_it_gives_up(self):
        way = a_way()
        see(way, SHUT)
        assert self.what_follows(way, patience=0.0) == [GIVE_UP]

    def test_what_is_looked_at_is_what_came(self):
        way, known, seen = a_way(), np.full((3, 3), SHUT, np.int8), np.ones((3, 3), np.bool_)
        see(way, SHUT)
        assert look_again(way, 2.0, known, seen) == LOOK
        assert np.argwhere(~seen).tolist() == [[1, 2]]
        assert ahead(way, 10.0) == WAIT
