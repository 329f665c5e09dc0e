"""Random small worlds, and from them arguments for every kernel."""

import copy

import numpy as np

from control_field.kernels import compiled
from control_field.kernels import interpolation as field_kernels
from control_field.kernels import steps as kernels


class Scene:
    """Random arguments for every kernel, of the types they are called with in earnest."""

    def __init__(self, known, rule, seed):
        rng = np.random.default_rng(seed)
        shape, self.seed = known.shape, seed
        self.known, self.rules = known, rule
        free = np.argwhere(known != 100)
        self.row, self.col = (int(k) for k in (free if len(free) else [[0, 0]])[
            rng.integers(max(len(free), 1))])
        self.goal = int(rng.integers(shape[0])), int(rng.integers(shape[1]))
        self.heading = int(rng.integers(8))
        self.headings = rng.integers(-1, 8, shape).astype(np.int8)
        self.spared = rng.choice([0.0, 0.3, 0.9], shape)
        self.factor = rng.choice([1.0, 1.2, 0.4], shape)
        self.cost = compiled.cost_to_go(
            known, *self.goal, self.headings, self.spared, self.factor, rule)
        self.q = compiled.q_from_cost(
            known, self.cost, self.headings, self.spared, self.factor, 0.98, rule)
        self.state = compiled.flow_basin(known, self.headings, *self.goal, rule)
        self.counts = rng.integers(0, 6, (*shape, 8)).astype(np.int32)
        self.entered = rng.integers(0, 3, shape).astype(np.int32)
        self.punished = rng.integers(0, 256, shape).astype(np.uint8)
        self.mask = int(rng.integers(256))
        n = int(rng.integers(1, 6))
        self.cells = np.stack([rng.integers(0, shape[0], n), rng.integers(0, shape[1], n)], axis=1)
        self.cells = np.unique(self.cells, axis=0)
        self.proto = rng.integers(0, 8, len(self.cells)).astype(np.int8)
        self.weights = rng.uniform(0.05, 1.0, len(self.cells))
        self.centre = np.full(shape, -1, np.int8)
        self.centre[tuple(self.cells.T)] = self.proto
        self.totals = tuple(rng.uniform(-1.0, 1.0, shape) for _ in range(2)) + (
            rng.uniform(0.0, 1.0, shape),)
        self.window = float(rng.choice([1.0, 2.5, 6.0]))
        self.options = (bool(rng.integers(2)), self.window, 2.0, int(rng.integers(1, 5)),
                        int(rng.integers(0, 40)))
        self.fixed = rng.random(shape) < 0.3
        self.truth = np.where(known == 100, 100, 0).astype(np.int8)

    def arguments(self, name):
        """Return a fresh copy of a kernel's arguments."""
        return copy.deepcopy(getattr(self, f'for_{name}')())

    def rng(self):
        return np.random.default_rng(self.seed)

    def for_is_occupied(self):
        return self.known, self.row - 1, self.col + 1, self.rules[1]

    def for_step_allowed(self):
        return self.known, self.row, self.col, self.heading, self.rules

    def for_allowed_steps(self):
        return self.known, self.row, self.col, self.rules

    def for_remember_local_grid(self):
        return self.known, self.row, self.col, self.mask, self.mask >> 3

    def for_cost_to_go(self):
        return self.known, *self.goal, self.headings, self.spared, self.factor, self.rules

    def for_q_from_cost(self):
        return (self.known, self.cost, self.headings, self.spared, self.factor, 0.98, self.rules)

    def for_best_step(self):
        return (self.known, self.cost, self.factor, self.row, self.col, self.heading, self.rules)

    def for_look_around(self):
        return (self.known, self.factor, self.row, self.col, *self.goal, self.options[4],
                self.rules)

    def for_rehearse_locally(self):
        return (self.known, self.cost, self.factor, self.row, self.col, *self.goal,
                self.options[4], self.rules)

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
        seen = np.random.default_rng(self.seed).integers(-2, 2, self.known.shape)
        return self.cost, seen.astype(np.int16), np.flatnonzero(seen.ravel() > -2), 0, 0

    def for_least_chosen(self):
        return self.counts, self.row, self.col, self.mask, self.rng()

    def for_window_values(self):
        return self.q, self.row, self.col, self.window, 2.0

    def for_next_highest(self):
        allowed = kernels.allowed_steps(self.known, self.row, self.col, self.rules)
        return (np.round(self.q[self.row, self.col], 1), self.counts, self.entered, self.row,
                self.col, self.heading, allowed)

    def for_sees(self):
        return (self.known, self.row, self.col, *self.goal)

    def for_spread(self):
        return (*self.totals, self.known, self.row, self.col, self.heading, 0.7, self.window, 2.0,
                True)

    def for_add_windows(self):
        return (*self.totals, self.known, self.cells, self.proto, self.weights, self.window, 2.0,
                True)

    def for_heading_of(self):
        return float(self.totals[0][0, 0]), float(self.totals[1][0, 0])

    def for_course_at(self):
        return (self.row, self.col, *self.totals, self.headings, 2.0)

    def for_courses(self):
        return (*self.totals, self.centre, self.headings, 2.0)

    def for_pull_from_cost(self):
        return self.known, self.cost, self.factor, *self.totals[:2], self.rules

    def for_pull_to_nearest(self):
        return self.known, self.cells, self.rules

    def for_flow_reaches(self):
        return self.known, self.headings, self.row, self.col, *self.goal, self.rules

    def for_flow_basin(self):
        return self.known, self.headings, *self.goal, self.rules

    def for_flow_ends(self):
        return self.known, self.headings, self.state, self.known == 0, self.rules

    def for_n_as_shown(self):
        return self.known, self.headings, self.headings, self.rules

    def for_flow_lengths(self):
        return self.known, self.headings, *self.goal, self.rules

    def for_n_crossing(self):
        return self.headings, self.state, *self.goal

    def for_unseen_along(self):
        return self.headings, self.state == 1, self.known, self.totals[2], *self.goal

    def for_through(self):
        return (self.known, self.cost, self.factor, self.row, self.col, self.heading, self.rules)

    def for_needed(self):
        return (self.row, self.col, self.centre, self.totals, self.known, self.cost, self.factor,
                self.headings, 2.0, self.headings, self.window, self.rules)

    def for_idle_prototypes(self):
        _, _, courses = field_kernels.courses(*self.totals, self.centre, self.headings, 2.0)
        return (np.arange(len(self.cells)), self.cells, self.proto, self.weights, self.totals,
                self.centre, self.known, self.cost, self.factor, self.headings, 2.0, courses,
                self.window, 2.0, True, self.rules)

    def for_mending_cells(self):
        return (self.known, self.cost, self.factor, self.headings, self.state, self.fixed,
                self.rules)

    def for_mend_loop(self):
        loop = np.zeros((2, 2), np.int8)
        loop[0, 1], loop[1, 1], loop[1, 0] = 2, 4, 6
        return (np.zeros((2, 2), np.int8), np.arange(4.0).reshape(2, 2), np.ones((2, 2)), loop,
                np.eye(2, dtype=bool), np.zeros((2, 2), np.int64), np.zeros((2, 2), bool), 0, 0, 1,
                self.rules)

    def for_beside(self):
        return self.fixed, self.row, self.col

    def for_backup(self):
        return (self.q, self.known, self.row, self.col, self.heading, -1.0, self.row, self.col,
                0.5, 0.9, self.rules)

    def for_choose(self):
        allowed = kernels.allowed_steps(self.known, self.row, self.col, self.rules)
        # Called with nothing allowed it would have nothing to choose from: `decide` gives up.
        return (self.row, self.col, int(self.headings[self.row, self.col]), allowed or 1,
                self.headings, self.known, self.q, self.cost, self.factor, self.counts,
                np.pad(self.entered, 1), self.goal, self.options, self.rules, self.rng())

    def for_decide(self):
        return (self.row, self.col, self.mask, 0, self.headings, self.known, self.q, self.cost,
                self.factor, self.counts, self.entered, self.punished, self.goal, (0.5, 0.9),
                self.options, self.rules, self.rng())

    def for_see(self):
        return self.truth, self.row, self.col

    def for_run_trial(self):
        return (self.truth, self.row, self.col, self.headings, self.known, self.q, self.cost,
                self.factor, self.goal, (0.5, 0.9), self.options, self.rules, 60, self.rng(),
                np.zeros((90, 9), np.int32))

    def for_write_row(self):
        return (np.zeros((2, 9), np.int32), *range(10))
