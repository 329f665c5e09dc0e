"""What moves in the true world: where it is when, how it stands before a robot, what it hides."""

from itertools import pairwise
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from world_maps.clearance import Clearance
from world_maps.mover import Mover, Track, tracks, Waypoint
from world_maps.movers import Disc, gap_between, Movers
from world_maps.window import true_window
from world_maps.world import World

THERE_AND_BACK = (Waypoint(1.0, 1.0), Waypoint(3.0, 1.0))


def world(blocked=()):
    cells = np.zeros((20, 20), dtype=np.int8)
    for cell in blocked:
        cells[cell] = 100
    return World(Grid(20, 20, 0.25), cells)


def track(seed=0, **values):
    mover = Mover(**{'radius': 0.15, 'speed': 0.5, 'waypoints': THERE_AND_BACK, **values})
    return Track(mover, world(), np.random.default_rng(seed))


def at(laid, *times):
    return [laid.at(t) for t in times]


class TestTracks:
    def test_round_and_round(self):
        assert at(track(), 0.0, 2.0, 4.0, 6.0, 8.0, 802.0) == [
            (1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (2.0, 1.0), (1.0, 1.0), (2.0, 1.0)]

    def test_back_and_forth_waits_at_each_waypoint_once(self):
        points = (Waypoint(1.0, 1.0, 1.0), Waypoint(2.0, 1.0), Waypoint(2.0, 2.0, 3.0))
        laid = track(waypoints=points, mode='back_and_forth', speed=1.0)
        assert at(laid, 0.9, 1.5, 2.5, 3.0, 5.9, 6.5, 7.5, 8.5) == [
            (1.0, 1.0), (1.5, 1.0), (2.0, 1.5), (2.0, 2.0), (2.0, 2.0), (2.0, 1.5), (1.5, 1.0),
            (1.0, 1.0)]

    def test_once_comes_late_and_is_gone(self):
        laid = track(mode='once', start=5.0)
        assert at(laid, 4.9, 5.0, 7.0, 9.1, 1e6) == [None, (1.0, 1.0), (2.0, 1.0), None, None]

    def test_one_waypoint_is_somebody_who_stands(self):
        assert at(track(waypoints=(Waypoint(1.0, 1.0),)), 0.0, 1e9) == [(1.0, 1.0), (1.0, 1.0)]
        stays = track(waypoints=(Waypoint(1.0, 1.0, 3.0),), mode='once')
        assert at(stays, 2.9, 3.1) == [(1.0, 1.0), None]

    def test_comes_at_random_but_the_same_for_a_seed(self):
        times = np.arange(0.0, 600.0, 0.25).tolist()
        seen = [at(track(seed, mode='once', comes_every=20.0), *times) for seed in (0, 0, 1)]
        assert seen[0] == seen[1] != seen[2]
        there = [place is not None for place in seen[0]]
        assert 0.05 < np.mean(there) < 0.4  # 4 s of about 24
        assert sum(b and not a for a, b in pairwise(there)) > 10

    def test_where_it_is_does_not_hang_on_what_was_asked_before(self):
        wanderer = {'mode': 'wander', 'waypoints': ()}
        asked = track(3, **wanderer)
        asked.at(100.0)
        assert at(asked, 10.0, 50.0) == at(track(3, **wanderer), 10.0, 50.0)

    @given(st.integers(0, 50), st.integers(0, 2**32))
    def test_who_wanders_keeps_clear_of_walls_and_within_its_speed(self, seed, walls):
        blocked = np.random.default_rng(walls).integers(0, 20, (30, 2))
        here = world(map(tuple, blocked))
        laid = Track(Mover(0.15, 0.3, mode='wander'), here, np.random.default_rng(seed))
        clearance = Clearance(here, 0.15)
        places = at(laid, *np.arange(0.0, 60.0, 0.5).tolist())
        assert all(clearance.at(*place) >= -1e-3 for place in places)
        assert max(math.dist(*two) for two in pairwise(places)) <= 0.15 + 1e-9
        assert math.dist(places[0], places[-1]) > 0.0

    def test_who_wanders_may_begin_somewhere(self):
        assert track(mode='wander', waypoints=(Waypoint(2.0, 3.0),)).at(0.0) == (2.0, 3.0)


class TestWhatIsRefused:
    @pytest.mark.parametrize(('values', 'words'), [
        ({'radius': 0.0}, 'radius is 0'),
        ({'radius': math.nan}, 'radius is nan'),
        ({'speed': -1.0}, 'speed is -1'),
        ({'start': -1.0}, 'start is -1'),
        ({'mode': 'fly'}, "mode is 'fly', must be one of loop"),
        ({'waypoints': ()}, 'at least one'),
        ({'waypoints': (Waypoint(math.inf, 0.0),)}, 'waypoints is inf'),
        ({'waypoints': (Waypoint(1.0, 1.0),) * 2}, 'less than 0.1 s'),
        ({'mode': 'wander'}, 'at most one'),
        ({'comes_every': 3.0}, 'mode once only'),
    ])
    def test_says_what_is_wrong(self, values, words):
        with pytest.raises(ValueError, match=words):
            track(**values)

    def test_who_has_no_room_is_named(self):
        full = World(Grid(2, 2, 0.25), np.full((2, 2), 100, dtype=np.int8))
        with pytest.raises(ValueError, match=r'mover cat: there is no room .* 0.1 m'):
            tracks([Mover(0.1, mode='wander', name='cat')], full, 0)


class TestBeforeARobot:
    ROBOT = Disc(2.0, 1.0, 0.1)

    def go(self, movers, seconds, robot=None, tick=0.05):
        stopped = False
        for _ in range(round(seconds / tick)):
            stopped = movers.advance(tick, robot)[0]
        return stopped

    def movers(self, **values):
        values = {'radius': 0.15, 'speed': 0.5, 'waypoints': THERE_AND_BACK, **values}
        return Movers([Mover(**values)], world())

    def test_it_stands_and_goes_on_when_there_is_room(self):
        movers = self.movers(patience=0.0)
        assert self.go(movers, 60.0, self.ROBOT)
        gap = gap_between(self.ROBOT, movers.discs[0])
        assert 0.0 <= gap < 1e-6
        assert not self.go(movers, 1.0)
        assert movers.discs[0].x == pytest.approx(2.25)

    def test_when_its_patience_is_over_it_turns_back(self):
        movers = self.movers(patience=2.0)
        self.go(movers, 5.0, self.ROBOT)
        assert movers.discs[0].x < 1.5
        self.go(movers, 600.0, self.ROBOT)  # it comes again
        assert movers.discs[0] is not None

    def test_where_it_is_placed_upon_the_robot_it_goes_on(self):
        movers, robot = self.movers(), Disc(1.1, 1.0, 0.1)
        assert not self.go(movers, 2.0, robot)
        assert movers.discs[0].x == pytest.approx(2.0)

    def test_it_does_not_come_where_the_robot_stands(self):
        movers = self.movers(start=1.0)
        assert not self.go(movers, 5.0, Disc(1.0, 1.0, 0.1))
        assert movers.discs == [None]
        self.go(movers, 0.1)
        assert movers.discs != [None]

    def test_reset_begins_anew(self):
        movers = self.movers(mode='wander', waypoints=())
        began = movers.discs
        self.go(movers, 10.0, self.ROBOT)
        movers.reset()
        assert movers.discs == began


class TestWindow:
    def test_shows_the_cells_that_a_disc_reaches_into(self):
        here = world([(4, 5)])
        disc = Disc(1.375, 1.125, 0.13)  # the middle of cell (4, 5) is (1.375, 1.125)
        assert true_window(here, [None, disc], 4, 6).tolist() == [
            [100, 0, 0], [100, 100, 0], [100, 0, 0]]
        assert true_window(here, [disc._replace(x=1.625)], 4, 6)[1].tolist() == [100, 100, 100]

    def test_finer_cells_show_where(self):
        window = true_window(world([(5, 5)]), [Disc(1.375, 1.125, 0.03)], 4, 5, fine=5)
        assert window.shape == (15, 15)
        assert (window[10:15, 5:10] == 100).all()
        assert np.argwhere(window[5:10, 5:10] == 100).tolist() == [
            [1, 2], [2, 1], [2, 2], [2, 3], [3, 2]]

    @given(st.floats(-1.0, 6.0), st.floats(-1.0, 6.0), st.floats(0.01, 0.6),
           st.integers(0, 19), st.integers(0, 19), st.integers(1, 3))
    def test_agrees_with_the_clearance_of_each_cell(self, x, y, radius, row, col, reach):
        window = true_window(world(), [Disc(x, y, radius)], row, col, reach)
        for r in range(max(row - reach, 0), min(row + reach + 1, 20)):
            for c in range(max(col - reach, 0), min(col + reach + 1, 20)):
                away = Clearance(world([(r, c)]), radius)._distance(x, y, r, c) - radius
                if abs(away) > 1e-9:
                    assert (window[r - row + reach, c - col + reach] == 100) == (away < 0.0)

    def test_outside_of_the_world_is_blocked(self):
        assert true_window(world(), [], 0, 19).tolist() == [[100] * 3, [0, 0, 100], [0, 0, 100]]
