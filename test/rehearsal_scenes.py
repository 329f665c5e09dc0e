"""Arguments for the kernels of rehearsal, and of windows."""

import numpy as np

from control_field.kernels import interpolation, rehearsal
from control_field.kernels.interpolation import View
from control_field.rays import rays_within


class Rehearsals:
    """A part of a `Scene`."""

    def for_step_masks(self):
        return self.known, self.rules

    def for_shortest_step(self):
        return self.ground, self.preference

    def for_bucket_of(self):
        return self.queue(), 3.7

    def for_new_queue(self):
        return 0, 2.0

    def for_put_in(self):
        return self.queue(), 2.5, 2

    def for_put_far(self):
        return self.queue(), 5000.0, 2

    def for_take_out(self):
        return self.queue(), 2.0, self.mask % 2

    def for_take_bucket(self):
        return self.queue(), self.mask % 4, np.full(3, 3.0), np.zeros(3, np.int32)

    def queue(self):
        """Return a queue with places 0 and 1 in one bucket, and room for place 2."""
        queue = rehearsal.new_queue(3, 1.001)
        queue.far_costs[:], queue.far_places[:] = 3.0, 0
        for place in (0, 1):
            rehearsal.put_in(queue, 2.0, place)
        return queue

    def cost_search(self):
        return rehearsal.CostSearch(
            rehearsal.step_masks(self.known, self.rules).ravel(), self.ground.factor.ravel(),
            self.preference.headings.ravel(), self.preference.spared.ravel(), self.cost.ravel(),
            np.zeros(self.known.size, bool), self.known.shape[1])

    def for_reach_neighbours(self):
        queue = rehearsal.new_queue(self.known.size, 1.001 / 0.04)
        queue.far_costs[:], queue.far_places[:] = 0.0, 0
        return self.cost_search(), queue, 0, np.array([self.place()], np.int32)

    def for_cost_by(self):
        return self.cost_search(), self.place()

    def for_first_met(self):
        return self.cost_search(), self.place(), np.full(8, np.inf), 3.0

    def for_reaches_unseen(self):
        return self.ground, self.goal

    def for_q_of_steps_into(self):
        return self.ground, self.cost, 1.5, 0.9

    def for_best_steps(self):
        return self.ground, self.cost

    def for_divisors(self):
        return (self.window,)

    def for_has_wall(self):
        return self.known, 0, self.row + 1, self.col, self.known.shape[1]

    def for_windows_of(self):
        return self.fixed, self.window

    def for_spread(self):
        view = View(self.known, interpolation.divisors(self.window), self.fixed, True)
        return self.sums, view, self.row, self.col, self.heading, 0.7

    def for_add_windows(self):
        return self.sums, self.known, self.centres, self.window, self.fixed

    def for_shared_beginnings(self):
        return (rays_within(1 + self.mask % 4),)
