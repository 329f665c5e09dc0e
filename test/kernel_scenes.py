"""Random small worlds, and from them arguments for every kernel."""

import copy

import numpy as np

from control_field.kernels import compiled, interpolation, rehearsal, steps, visibility
from control_field.kernels.decision import Decision, Log, new_trial, Options, Transition
from control_field.kernels.interpolation import Attraction, Centres, Sums, Vectors, Window
from control_field.kernels.last_resort import new_flood
from control_field.kernels.repair import Flow
from control_field.kernels.rollout import new_flow
from control_field.kernels.steps import Ground, Preference
from control_field.kernels.visibility import Scanner
from control_field.rays import rays_within
from judging_scenes import Judging
from moving_scenes import MovingThings
from rehearsal_scenes import Rehearsals


class Scene(Judging, MovingThings, Rehearsals):
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
        self.preference = Preference(self.headings, rng.choice([0.0, 0.3, 0.9], shape))
        self.ground = Ground(known, rng.choice([1.0, 1.2, 0.4], shape), self.rules)
        self.cost = compiled.cost_to_go(self.ground, self.goal, self.preference)
        self.q = compiled.q_from_cost(self.ground, self.cost, self.preference, 0.98)
        self.state = compiled.flow_basin(known, self.headings, *self.goal, self.rules)
        self.counts = rng.integers(0, 6, (*shape, 8)).astype(np.int32)
        self.entered = rng.integers(0, 3, shape).astype(np.int32)
        self.punished = rng.integers(0, 256, shape).astype(np.uint8)
        self.mask = int(rng.integers(256))
        n = int(rng.integers(1, 6))
        self.cells = np.stack([rng.integers(0, shape[0], n), rng.integers(0, shape[1], n)], axis=1)
        self.cells = np.unique(self.cells, axis=0)
        proto = rng.integers(0, 8, len(self.cells)).astype(np.int8)
        self.centres = Centres(self.cells, proto, rng.uniform(0.05, 1.0, len(self.cells)))
        self.centre = np.full(shape, -1, np.int8)
        self.centre[tuple(self.cells.T)] = proto
        self.sums = Sums(*(rng.uniform(-1.0, 1.0, shape) for _ in range(2)),
                         rng.uniform(0.0, 1.0, shape))
        self.attraction = Attraction(self.headings, 2.0)
        self.window = Window(float(rng.choice([1.0, 2.5, 6.0])), 2.0, True)
        self.options = Options(
            bool(rng.integers(2)), self.window.radius, 2.0, int(rng.integers(1, 5)),
            int(rng.integers(0, 40)), 0.5, 0.9, bool(rng.integers(2)))
        self.transition = Transition(self.row, self.col, self.heading, self.row, self.col, -1.0)
        self.fixed = rng.random(shape) < 0.3
        self.shown = rng.integers(0, 8, shape).astype(np.uint8)
        self.truth = np.where(known == 100, 100, 0).astype(np.int8)

    def arguments(self, name):
        """Return a fresh copy of a kernel's arguments."""
        return copy.deepcopy(getattr(self, f'for_{name}')())

    def rng(self):
        return np.random.default_rng(self.seed)

    def for_is_occupied(self):
        return self.known, self.row - 1, self.col + 1, self.rules[1]

    def for_is_doubtful(self):
        return self.known, self.row - 1, self.col + 1, self.rules[1]

    def for_step_allowed(self):
        return self.known, self.row, self.col, self.heading, self.rules

    def for_allowed_steps(self):
        return self.known, self.row, self.col, self.rules

    def for_remember_local_grid(self):
        return self.known, self.row, self.col, self.mask, self.mask >> 3

    def for_note_cell(self):
        return self.shown, self.row - 1, self.col + 1, bool(self.mask & 1)

    def for_note_local_grid(self):
        return self.shown, self.row, self.col, self.mask, self.mask >> 3

    def for_note_cells(self):
        return self.shown, self.row - 1, self.col - 2, self.known

    def for_new_flood(self):
        return (self.known.shape,)

    def for_is_shut_off(self):
        return (self.ground, new_flood(self.known.shape), self.row, self.col, self.goal,
                self.mask % 20)

    def for_search_anew(self):
        return (new_flood(self.known.shape),)

    def for_doubt_unseen(self):
        return self.ground, self.cost, self.fixed, self.goal

    for_doubt_unseen_by_cells = for_doubt_unseen

    def for_plain_ground(self):
        return self.known, self.rules

    def for_no_preference(self):
        return (self.known.shape,)

    def for_step_length(self):
        wide = self.ground._replace(factor=np.pad(self.ground.factor, 1))
        return wide, self.preference, self.row, self.col, self.mask % 3

    def for_cost_to_go(self):
        return self.ground, self.goal, self.preference

    def for_q_from_cost(self):
        return self.ground, self.cost, self.preference, 0.98

    def for_best_step(self):
        return self.ground, self.cost, self.row, self.col, self.heading

    def for_best_of(self):
        allowed = steps.allowed_steps(self.known, self.row, self.col, self.rules)
        return allowed, self.ground.factor, self.cost, self.row, self.col, self.heading

    def for_turn_between(self):
        return self.heading, self.mask % 9 - 1

    def for_least_chosen(self):
        return self.counts, self.row, self.col, self.mask, self.rng()

    def for_window_values(self):
        return self.q, self.row, self.col, self.window.radius, 2.0

    def for_next_highest(self):
        allowed = steps.allowed_steps(self.known, self.row, self.col, self.rules)
        return (np.round(self.q[self.row, self.col], 1), self.counts, self.entered, self.row,
                self.col, self.heading, allowed)

    def for_sees(self):
        return (self.known, self.row, self.col, *self.goal)

    def for_distance_weight(self):
        return 0.7, float(self.window.radius), self.window.power

    def for_heading_of(self):
        return float(self.sums.x[0, 0]), float(self.sums.y[0, 0])

    def for_mean_vector(self):
        return self.row, self.col, self.sums, self.attraction

    def for_field_vectors(self):
        return (self.sums, self.centre, self.attraction, Vectors.none(self.known.shape),
                self.fixed)

    def for_settle_ties(self):
        return (self.headings, *rehearsal.best_steps(self.ground, self.cost), self.ground,
                self.cost, self.sums, self.fixed)

    def for_attraction_from_cost(self):
        return self.ground, self.cost, self.sums

    def for_attraction_to_nearest(self):
        return self.known, self.cells, self.rules

    def for_flow_reaches(self):
        return self.known, self.headings, self.row, self.col, *self.goal, self.rules

    def for_flow_basin(self):
        return self.known, self.headings, *self.goal, self.rules

    def for_flow_ends(self):
        return self.known, self.headings, self.state, self.known == 0, self.rules

    def for_n_as_demonstrated(self):
        return self.known, self.headings, self.headings, self.rules

    def for_new_flow(self):
        return self.known.shape, bool(self.mask & 1)

    def known_flow(self):
        """Return a record of where flows lead: of no place, of all, or of none that is kept."""
        flow = new_flow(self.known.shape, bool(self.mask & 1))
        if self.mask & 2:
            flow.verdict[:] = np.where(self.state.ravel()[:len(flow.verdict)] == 1, 1, -1)
        return flow

    def for_comes_home(self):
        return (self.known, self.headings, self.known_flow(), self.row, self.col, self.goal,
                self.rules)

    def for_note_closed(self):
        flow = new_flow(self.known.shape, True)
        flow.verdict[:] = self.headings.ravel() >= 0
        return self.known, self.headings, flow, self.row, self.col, self.rules

    def for_note_opened(self):
        return (self.known_flow(),)

    def for_flows_home(self):
        return self.known, self.headings, *self.goal, self.rules

    def for_flow_lengths(self):
        return self.known, self.headings, *self.goal, self.rules

    def for_most_ahead(self):
        return self.headings, self.state, self.entered, *self.goal

    def for_n_crossing(self):
        return self.headings, self.state, *self.goal

    def for_seen_along(self):
        return self.headings, self.state == 1, self.sums.weight, *self.goal

    def for_crossed(self):
        cost = compiled.cost_to_go(self.ground, self.goal, steps.no_preference(self.known.shape))
        return self.ground, cost, self.known == 0, self.goal

    def for_through(self):
        return self.ground, self.cost, self.row, self.col, self.heading

    def flow(self):
        vectors = Vectors.none(self.known.shape)
        interpolation.field_vectors(
            self.sums, self.centre, self.attraction, vectors, np.ones(self.known.shape, bool))
        return Flow(self.sums, self.attraction, self.centre, vectors.headings)

    def for_kept_steps(self):
        return self.known, self.headings, self.rules

    def for_prefer_practised(self):
        return self.ground, self.cost, self.headings, 1.05, 0.3, self.preference

    def for_worth_keeping(self):
        return self.ground, self.cost, self.headings, self.preference, 1.0

    def for_needed(self):
        flow = self.flow()._replace(headings=self.headings)
        return self.row, self.col, flow, self.ground, self.cost, int(self.window.radius)

    def for_idle_prototypes(self):
        return (np.arange(len(self.cells)), self.centres, self.flow(), self.ground, self.cost,
                self.window)

    def for_update_headings(self):
        flow = self.flow()._replace(headings=self.headings)
        return self.row, self.col, flow, int(self.window.radius)

    def for_mending_cells(self):
        return self.ground, self.cost, self.headings, self.state, self.fixed

    def loop(self):
        return np.array([[0, 2], [6, 4]], np.int8)

    def for_enter_loop(self):
        return self.loop(), np.zeros((2, 2), np.int64), 0, 0, 1

    def for_cheapest_of_loop(self):
        ground = Ground(np.zeros((2, 2), np.int8), np.ones((2, 2)), self.rules)
        return (ground, np.arange(4.0).reshape(2, 2), self.loop(), np.eye(2, dtype=bool), 0, 0)

    def for_beside(self):
        return self.fixed, self.row, self.col

    def trial(self):
        trial = new_trial(self.ground, self.headings, self.goal, self.q, self.cost)
        return trial._replace(
            counts=self.counts, entered=self.entered, punished=self.punished)

    def for_new_trial(self):
        return self.ground, self.headings, self.goal, self.q, self.cost

    def for_backup(self):
        return self.q, self.known, self.transition, 0.5, 0.9, self.rules

    def for_take_in_local_grid(self):
        return self.trial(), self.row, self.col, self.mask, self.mask >> 3

    def for_take_in_cells(self):
        return self.trial(), self.row, self.col, self.known

    def for_take_in_cell(self):
        return self.trial(), self.row, self.col, bool(self.mask & 1)

    def for_rehearsed_step(self):
        heading = int(self.headings[self.row, self.col])
        return self.row, self.col, heading, self.trial(), self.options

    def for_choose(self):
        allowed = steps.allowed_steps(self.known, self.row, self.col, self.rules)
        # Called with nothing allowed it would have nothing to choose from: `decide` gives up.
        trial = self.trial()._replace(entered=np.pad(self.entered, 1))
        return (self.row, self.col, int(self.headings[self.row, self.col]), allowed or 1, trial,
                self.options, self.rng())

    def for_decide(self):
        return self.row, self.col, self.mask, 0, self.trial(), self.options, self.rng()

    def decision(self):
        return Decision(self.heading, 2, self.mask % 9 - 1, 1)

    def for_n_rewards(self):
        return (self.decision(),)

    def for_write_decision(self):
        return (np.zeros((2, 9), np.int32), self.mask % 3, self.row, self.col, self.decision(),
                self.mask, 4)

    def for_write_row(self):
        return np.zeros((2, 9), np.int32), 0, self.transition, 2, 3, 4

    def for_see(self):
        return self.truth, self.row, self.col

    def scanner(self):
        reach = self.mask % 5
        return Scanner(rays_within(reach), np.zeros((max(2 * reach + 1, 3),) * 2, np.int8))

    def for_state_at(self):
        return self.truth, self.row - 1, self.col + 1

    def for_sum_in_view(self):
        return (self.sums.weight, self.known, self.fixed, rays_within(1 + self.mask % 4),
                1.0 + self.mask % 9)

    def for_sum_from(self):
        rays = rays_within(1 + self.mask % 4)
        return (self.sums.weight, self.known, self.row, self.col, rays,
                visibility.shared_beginnings(rays), np.full(self.known.shape, -1),
                1.0 + self.mask % 9)

    def for_look(self):
        reach = 1 + self.mask % 4
        return (self.truth, self.row, self.col, rays_within(reach),
                np.zeros((2 * reach + 1,) * 2, np.int8))

    def for_remember_cells(self):
        cells = np.random.default_rng(self.seed).choice(np.array([0, 100, -1], np.int8), (5, 5))
        return self.known, self.fixed, self.row, self.col, cells

    def for_run_trial(self):
        trial = new_trial(self.ground, self.headings, self.goal, self.q, self.cost)
        scanner = self.scanner()
        return (self.truth, (self.row, self.col), trial, self.options, 60, self.rng(),
                self.log(scanner), scanner)

    def log(self, scanner):
        return Log(np.zeros((90, 9), np.int32), np.zeros((80, *scanner.shown.shape), np.int8))

    def for_write_shown(self):
        scanner = self.scanner()
        scanner.shown[:] = 7
        return self.log(scanner), self.mask, scanner
