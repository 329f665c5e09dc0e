"""From a random small world, arguments for the kernels that judge."""

import numpy as np

from control_field.kernels import compiled
from control_field.kernels.decision import new_trial
from control_field.kernels.local_search import new_search
from control_field.kernels.rollout import new_flow
from control_field.kernels.sharing import Beforehand, Ends, Work


class Judging:
    """Part of a random scene: a trial that keeps what it finds, and what is known beforehand."""

    def kept_trial(self):
        trial = new_trial(self.ground, self.headings, self.goal, self.q, self.cost)
        return trial._replace(search=new_search(self.known.shape, True),
                              flow=new_flow(self.known.shape, True))

    def beforehand(self):
        lengths, n_steps = compiled.flows_home(
            self.truth, self.headings, *self.goal, self.rules)
        return Beforehand(
            self.known.copy(), self.ground.factor.copy(), self.cost.copy(), self.q.copy(), lengths,
            n_steps, self.state == 1, np.isfinite(self.cost), bool(self.mask & 1))

    def ends(self):
        n_places = self.known.size
        return Ends(np.full(n_places, -1, np.int8), *np.zeros((2, n_places), np.int64),
                    np.zeros(n_places))

    def work(self):
        scanner = self.scanner()
        return Work(np.zeros(30, np.int64), *np.zeros((3, self.known.size), np.int64),
                    np.zeros_like(scanner.shown), np.ones(1, np.int64))

    def place(self):
        return self.row * self.known.shape[1] + self.col

    def for_judge(self):
        starts = np.array([self.place(), self.goal[0] * self.known.shape[1] + self.goal[1]])
        return (self.truth, starts, self.kept_trial(), self.options, 30, self.rng(),
                self.scanner(), self.beforehand(), self.ends(), self.work())

    def for_run_from(self):
        truth, _, *others = self.for_judge()
        return truth, self.place(), *others

    for_run_alone = for_run_from

    def for_run_one(self):
        truth, place, *others = self.for_run_from()
        return truth, place, bool(self.mask & 2), *others

    def for_end_of_trial(self):
        *most, _, work = self.for_run_one()
        return *most, work

    def for_next_place(self):
        headings = np.pad(np.maximum(self.headings, 0), 1)
        return headings, (self.row + 1) * headings.shape[1] + self.col + 1

    def for_begins_with_flow(self):
        return (self.truth, self.place(), self.kept_trial(), self.options, self.scanner(),
                self.beforehand())

    def shown_around(self):
        """Return what is in sight of the scene's cell."""
        scanner = self.scanner()
        compiled.look(self.truth, self.row, self.col, scanner.rays, scanner.shown)
        return scanner

    def for_shows_blocked(self):
        return self.shown_around().shown, self.mask % 4 - 1, self.mask % 3 - 1

    def for_is_step_open(self):
        return (*self.for_shows_blocked(), self.heading, self.rules.corner_cutting)

    def for_note_crossed(self):
        return self.kept_trial(), self.row, self.col, self.work()

    def for_share(self):
        trial, ends = self.kept_trial(), self.ends()
        trial.search.is_mended[:] = self.fixed.ravel()
        return (self.truth, self.place(), trial, self.options, 30, self.scanner(),
                self.beforehand(), ends, self.work())

    def for_matters(self):
        trial = self.kept_trial()
        trial.search.is_mended[:] = self.fixed.ravel()
        here = (self.place() + 1) % self.known.size
        return here, self.place(), trial, self.shown_around(), self.beforehand(), self.work()

    def for_was_looked_at(self):
        trial = self.kept_trial()
        trial.search.is_mended[:] = self.fixed.ravel()
        return trial, self.row, self.col

    def for_new_memo(self):
        return (self.known.size * (self.mask & 1),)

    def for_memorise(self):
        start = self.row * self.known.shape[1] + self.col
        search = new_search(self.known.shape, True)
        n_touched = compiled.look_around(
            self.ground, search, start, self.goal[0] * self.known.shape[1] + self.goal[1], 9)
        return self.ground, self.cost.reshape(-1), search, start, n_touched

    def for_recall(self):
        ground, cost, search, start, n_touched = self.for_memorise()
        compiled.memorise(ground, cost, search, start, n_touched)
        changed = np.where(np.arange(cost.size) % 7 == self.mask % 9, cost + 0.5, cost)
        return ground, changed, search, start

    def for_is_as_before(self):
        *most, _ = self.for_recall()
        return *most, 0

    def for_put_back(self):
        trial = self.kept_trial()
        trial.n_doubted[0] = self.mask & 1
        trial.ground.known[:] = self.truth
        path = np.array([self.place(), 0])
        return trial, self.beforehand(), path, 1 + self.mask % 2, self.mask % 3

    def for_put_cell_back(self):
        trial = self.kept_trial()
        trial.ground.known[:] = self.truth[::-1]
        return trial, self.beforehand(), self.row, self.col

    def for_note_change(self):
        trial = self.kept_trial() if self.mask & 1 else self.trial()
        return trial, self.row, self.col, bool(self.mask & 2)

    def for_see_and_decide(self):
        scanner = self.scanner()
        return (self.truth, self.row, self.col, self.trial(), self.options, self.rng(), scanner)
