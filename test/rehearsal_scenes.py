"""Arguments for the kernels of rehearsal, over a map and around the robot, and of windows."""

import numpy as np

from control_field.kernels import interpolation, rehearsal
from control_field.kernels.interpolation import View
from control_field.kernels.local_search import new_search
from control_field.kernels.queues import enter, new_agenda
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

    def for_look_around(self):
        start, goal = (row * self.known.shape[1] + col for row, col in (
            (self.row, self.col), self.goal))
        return self.ground, self.search(), start, goal, self.options.n_backups

    def for_rehearse_locally(self):
        return (self.ground, self.cost, self.search(), self.row, self.col, self.goal,
                self.options.n_backups)

    def for_offsets(self):
        return (self.known.shape[1],)

    def for_new_search(self):
        return self.known.shape, bool(self.mask & 1)

    def for_forget_masks(self):
        search = new_search(self.known.shape, bool(self.mask & 1))
        search.masks[:] = 7
        return search, self.known.shape, self.row, self.col

    def search(self):
        return new_search(self.known.shape, bool(self.mask & 1))

    def heap(self):
        """Return costs and places in order, which is a heap, with room for one more."""
        entries = sorted(zip(np.round(self.cost, 1).ravel(), range(self.cost.size), strict=True))
        costs, places = zip(*entries, (0.0, 0), strict=True)
        return np.array(costs), np.array(places), len(entries)

    def for_push(self):
        return *self.heap(), float(np.round(self.cost[self.row, self.col], 1)), self.mask

    def for_pop(self):
        return self.heap()

    def for_rim_around(self):
        search = self.search()
        search.noted[:] = np.random.default_rng(self.seed).integers(0, 4, self.known.size)
        touched = np.flatnonzero(search.noted)
        search.touched[:len(touched)] = touched
        return self.cost.reshape(-1), search, len(touched)

    def for_carry_back(self):
        cost, search, n_touched = self.for_rim_around()
        return self.ground, cost, search, n_touched

    def for_new_agenda(self):
        return (self.known.size,)

    def agenda(self):
        """Return an agenda of all places but one, with their costs, the least one, and this."""
        costs = np.round(np.minimum(self.cost, 300.0).ravel(), 1) * (1 + self.mask % 2)
        agenda, place = new_agenda(costs.size), self.row * self.known.shape[1] + self.col
        for other in range(costs.size):
            if other != place:
                enter(agenda, costs, costs.min(), other)
        return agenda, costs, costs.min(), place

    for_enter = agenda

    def for_leave(self):
        agenda, costs, least, place = self.agenda()
        enter(agenda, costs, least, place)
        return agenda, costs, least, place

    def for_bucket_on(self):
        return new_agenda(1), 0.7 * self.mask
