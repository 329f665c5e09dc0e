"""Arguments for the kernels of what moves and what is waited for."""

import numpy as np

from control_field.kernels import moving_world
from control_field.kernels.decision import new_trial
from control_field.kernels.moving_world import Moving, Pace
from control_field.kernels.visibility import Scanner
from control_field.kernels.waiting import WayRecord


class MovingThings:
    """What `kernel_scenes.Scene` holds besides: a trial on its way, and what comes into it."""

    def way(self):
        """Return a record under way, whose last glance was near the cell."""
        rng = self.rng()
        glance = np.array([self.row + rng.integers(-1, 2), self.col + rng.integers(-1, 2),
                           self.mask])
        return WayRecord(self.known, self.fixed, glance, rng.integers(0, 4, 5),
                         np.array([float(rng.integers(-1, 9)), 1.0]))

    def shown_cells(self):
        side = 3 + 2 * (self.mask % 3)
        return self.rng().choice(np.array([0, 100, -1], np.int8), (side, side))

    def for_new_record(self):
        return (self.known,)

    def for_take_in(self):
        return self.way(), self.row, self.col, self.shown_cells()

    def for_blocked_around(self):
        return (self.shown_cells(),)

    def for_blocked_beside(self):
        return self.way(), self.row, self.col

    def for_look_ahead(self):
        return (self.way(), 2.0, float(self.mask % 4), self.row, self.col, self.mask % 9 - 1,
                self.rules)

    def for_believe(self):
        return (self.way(),)

    def for_look_again(self):
        way = self.way()
        way.counts[2:] *= np.array([5, 2, 1])
        return way, float(self.mask % 2), self.known.copy(), self.shown > 3

    def for_forget(self):
        return self.shown > 3, self.fixed

    def for_n_looks(self):
        return (self.way(),)

    def for_comes_into_the_way(self):
        return self.known, self.row, self.col, self.heading, self.mask, self.rules

    def pace(self):
        return Pace(0.3, 0.4, self.mask % 7, 0.1)

    def moving(self):
        """Return a trial on its way, with three discs on the map and beside it."""
        rng, shape = self.rng(), self.known.shape
        places = rng.uniform(-1.0, max(shape) + 1.0, (40, 3, 2))
        places[rng.random((40, 3)) < 0.2] = np.nan
        events = np.array([[3, self.row, self.col, 100], [2, shape[0] - 1, 0, 0]])
        moving = Moving(places, rng.uniform(0.1, 1.5, 3), rng.integers(0, 4, 3), events)
        place = self.row + 0.5, self.col + 0.5
        return moving_world.Scene(
            moving, self.truth, self.truth.copy(), self.way(),
            Scanner(np.zeros((0, 0, 2), np.int16), np.zeros((3, 3), np.int8)),
            rng.integers(0, 40, 3), rng.choice([-1, 1], 3), rng.integers(0, 3, 3),
            rng.random(3) < 0.5, np.array(place), np.array([2, 0]))

    def for_new_scene(self):
        moving = self.moving()
        return moving.moving, self.truth, self.known, (self.row, self.col), 5

    def for_reaches_into(self):
        return 1.3, self.cost.size / 3.0, 0.9, self.row, self.col

    def for_mover_in(self):
        return self.moving(), self.row, self.col

    def for_paint_movers(self):
        return (self.moving(),)

    def for_see_moving(self):
        return (self.moving(), self.row, self.col, self.scanner(), 0.2 * (self.mask % 2),
                self.rng())

    def for_flip(self):
        return self.shown_cells(), 0.2, self.rng()

    def for_goes_on(self):
        return self.moving(), self.trial(), self.pace(), self.row, self.col, self.rng()

    def for_gap_to(self):
        return self.moving(), 1, self.mask % 40, 0.4

    def for_patience_share(self):
        return (self.mask + 0.5,)

    def for_pass_tick(self):
        return self.moving(), 0.4

    def for_pass_tick_of(self):
        return self.moving(), 2, 0.4

    def for_move_to(self):
        return self.moving(), self.row + 0.7, self.col + 0.1, 0.4

    def for_stand_before(self):
        return self.moving(), self.trial(), self.pace(), self.row, self.col, self.rng()

    def for_drive_step(self):
        return (self.moving(), self.trial(), self.pace(), self.row, self.col, self.heading,
                self.rng())

    def for_go_back(self):
        return self.moving(), self.pace(), self.row, self.col, self.heading, 0.7

    def for_run_moving_trial(self):
        trial = new_trial(self.ground, self.headings, self.goal, self.q, self.cost)
        scanner = self.scanner()
        return (self.moving(), self.pace(), trial, self.options, 20, self.rng(),
                self.log(scanner), scanner)
