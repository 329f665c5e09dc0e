"""The learner: a pure function from a sequence of episodes to the field."""

import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.learning.certificate import Certificate, certify
from control_field.learning.compose import compose, compose_shown, Composition
from control_field.learning.exploration import exploration_field, worth_around, worth_of_look
from control_field.learning.memory import Memory
from control_field.learning.starts import best_cells, information_gain
from control_field.local_grid import FREE
from control_field.parameters import Parameters
from control_field.records import ControlField, Demonstration, Prototypes, Trial
from control_field.robot.policy import rules_of
from control_field.windows import moved


@dataclass(frozen=True, eq=False)
class Refresh:
    """
    What an episode made of the field.

    Parameters
    ----------
    field : ControlField
        The field in force: the refreshed one, or the old one if that was better.
    prototypes : Prototypes
        Of that field.
    certificate : Certificate
        Of that field, on the map as it is remembered now.
    pushed : bool
        Whether the field was refreshed.
    reason : str
        Why it was not; empty otherwise.
    reinforcements : int
        Rewards other than zero in the episode, online and offline.
    composition : Composition
        What the field was made of.

    """

    field: ControlField
    prototypes: Prototypes
    certificate: Certificate
    pushed: bool
    reason: str
    reinforcements: int
    composition: Composition


def explores(parameters: Parameters, spread: bool) -> bool:
    """
    Return whether the trials of a series explore, see `Learner.trial_field`.

    Parameters
    ----------
    parameters : Parameters
    spread : bool
        Whether they begin at chosen starts; from fixed ones they explore if shorter ways are
        preferred to what was shown.

    """
    return spread or parameters.prefer_shorter


class Learner:
    """
    Learns from episodes in the order they are given; equal episodes give equal bytes.

    Parameters
    ----------
    grid : Grid
        The workspace to begin with.
    parameters : Parameters
    fitted : bool
        Whether the workspace fits itself: then much of it was never seen and lies behind walls.
        So trials start where the ground is known to be free, further demonstrations there or in
        the next cell.

    """

    def __init__(self, grid: Grid, parameters: Parameters, fitted: bool = False) -> None:
        self.fitted = fitted
        self.parameters = parameters
        self.memory = Memory(grid, parameters)
        self.refresh: Refresh | None = None
        self.shown: Composition | None = None  #: leads along the shown way, if it is doubted

    @property
    def grid(self) -> Grid:
        """Return the workspace."""
        return self.memory.grid

    def add_demonstration(
        self, demonstration: Demonstration, workspace: Grid | None = None,
    ) -> Refresh:
        """
        Learn a demonstration (step 1 of the paper) and generalise (step 2).

        Parameters
        ----------
        demonstration : Demonstration
        workspace : Grid, optional
            A larger one of the same lattice, that its cells are of: the workspace from now on.

        Raises
        ------
        ValueError
            If it is too short or leaves the workspace.

        """
        self.memory.add_demonstration(demonstration, workspace)
        return self._renew(0, keep_better=False)

    def add_trial(self, trial: Trial, workspace: Grid | None = None) -> Refresh:
        """
        Learn a trial (steps 3 to 5).

        Parameters
        ----------
        trial : Trial
        workspace : Grid, optional
            A larger one of the same lattice, that its cells are of: the workspace from now on.

        Raises
        ------
        ValueError
            If nothing was demonstrated yet.

        """
        if self.refresh is None:
            raise ValueError('a trial was recorded before the first demonstration')
        return self._renew(self.memory.add_trial(trial, workspace), keep_better=True)

    def _renew(self, reinforcements: int, keep_better: bool) -> Refresh:
        self.shown = compose_shown(self.memory)
        composition = compose(self.memory)
        certificate = self._certify(composition)
        old = self.refresh
        # A field whose basin is everything is not worse than the old one.
        if (old is not None and keep_better and self.parameters.profile == 'full'
                and certificate.basin < 1.0):
            remembered = with_old_headings(old.composition, composition)
            before = self._certify(remembered)
            if before.basin > certificate.basin:
                self.refresh = Refresh(
                    remembered.field, remembered.prototypes, before, False,
                    f'the refreshed field would shrink the basin from {before.basin:.1%} to '
                    f'{certificate.basin:.1%} on the known map', reinforcements, remembered)
                return self.refresh
        self.refresh = Refresh(composition.field, composition.prototypes, certificate, True, '',
                               reinforcements, composition)
        return self.refresh

    def _certify(self, composition: Composition) -> Certificate:
        return certify(composition.field, self.memory.demonstrated, len(composition.prototypes),
                       rules_of(self.parameters), composition.reachable, composition.planned,
                       self.memory.evidence.age)

    def trial_field(self, exploring: bool) -> ControlField:
        """
        Return the field the next trial shall be driven on.

        Parameters
        ----------
        exploring : bool
            Whether it is a trial to learn from (profile full), as `explores` says: it prefers
            ground not seen yet or not for long. Otherwise the field in force, or while the shown
            way is doubted somewhere, the one that goes there to look.

        Raises
        ------
        ValueError
            If nothing was demonstrated yet.

        """
        field = self._current().field
        parameters = self.parameters
        looks_around = parameters.curiosity > 0.0 or parameters.prefer_shorter
        if exploring and parameters.profile == 'full' and looks_around:
            return exploration_field(self.memory, field)
        return field if self.shown is None else self.shown.field

    def next_starts(
        self, n: int, rng: np.random.Generator, driven: ControlField | None = None,
    ) -> list[tuple[int, int]]:
        """
        Propose cells for the next trial to start from, each once, best first.

        Where the flow would show most ground that matters and was not seen yet, or not since the
        world has changed, or not for long; when nothing is left to see (and in the paper's
        profile), known free cells at random. A proposed cell may turn out blocked.

        Parameters
        ----------
        n : int
            At most this many.
        rng : numpy.random.Generator
        driven : ControlField, optional
            What the trial will be driven on, if not the field in force.

        """
        field = self._current().field
        cells: list[tuple[int, int]] = []
        if self.parameters.profile == 'full':
            cells = best_cells(information_gain(
                field, driven or field, worth_of_look(self.memory),
                rules_of(self.parameters), self._beside_known(0)), n)
        free = np.argwhere((field.known == 0) & self._current().composition.reachable)
        # As many more as may be among the cells already, or the goal.
        picked = free[rng.permutation(len(free))[:n + 1]]
        others = [(int(row), int(col)) for row, col in picked]
        taken = {*cells, field.goal}
        return cells + [cell for cell in others if cell not in taken][:n - len(cells)]

    def teach_here(self, n: int) -> list[tuple[int, int]]:
        """Return the cells from which one more demonstration would help most, best first."""
        field = self._current().field
        unseen = np.where(field.known < 0, 1.0, 0.0)
        value = information_gain(
            field, field, unseen, rules_of(self.parameters), self._beside_known(1))
        for row, col in self._current().certificate.sinks:
            if field.known[row, col] == 0:
                value[row, col] += field.known.size
        return best_cells(value, n)

    def grown_to(self, grid: Grid) -> 'Learner':
        """
        Return one that knows the same in a larger workspace; this one stays as it is.

        Headings that are in force stay, and beyond them lead the cheapest way that is known.

        Raises
        ------
        ValueError
            If it does not hold the present one, or is of another lattice.

        """
        other = copy.copy(self)
        other.memory = copy.deepcopy(self.memory)
        other.memory.grow(grid)
        other.shown = compose_shown(other.memory)
        if self.refresh is not None:
            made = with_old_headings(self.refresh.composition, compose(other.memory))
            other.refresh = replace(
                self.refresh, field=made.field, prototypes=made.prototypes, composition=made,
                certificate=other._certify(made))
        return other

    def _beside_known(self, reach: int) -> npt.NDArray[np.bool_] | None:
        """Mark what is so near to known free ground, [cells]; None if the workspace is given."""
        if not self.fitted:
            return None
        is_free = (self._current().field.known == FREE).astype(np.float64)
        return np.asarray(worth_around(is_free, reach) > 0.5)

    def _current(self) -> Refresh:
        if self.refresh is None:
            raise ValueError('nothing was demonstrated yet')
        return self.refresh


def with_old_headings(old: Composition, new: Composition) -> Composition:
    """
    Return the headings that were in force, with the Q-matrix and map that are remembered now.

    Where the workspace has grown since, the new cells have their new headings.
    """
    grids = old.field.grid, new.field.grid
    if grids[0] == grids[1]:
        field = replace(new.field, vx=old.field.vx, vy=old.field.vy,
                        coherence=old.field.coherence, flags=old.field.flags)
        return Composition(field, old.prototypes, old.weights, new.reachable, new.planned)
    is_new = moved(np.zeros(grids[0].shape, dtype=np.bool_), *grids, True)
    layers: dict[str, Any] = {name: np.where(is_new, getattr(new.field, name), moved(
        getattr(old.field, name), *grids, 0)) for name in ('vx', 'vy', 'coherence', 'flags')}
    added = is_new[tuple(new.prototypes.cells.T)]
    offset = np.array(grids[0].offset_to(grids[1]))
    cells = np.concatenate([old.prototypes.cells + offset, new.prototypes.cells[added]])
    order = np.lexsort((cells[:, 1], cells[:, 0]))

    def both(ours: npt.NDArray[Any], theirs: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.concatenate([ours, theirs[added]])[order]

    prototypes = Prototypes(cells=cells[order].astype(np.int32), **{
        name: both(getattr(old.prototypes, name), getattr(new.prototypes, name))
        for name in ('headings', 'q', 'episodes', 'stamps', 'demonstrated')})
    return Composition(replace(new.field, **layers), prototypes, both(old.weights, new.weights),
                       new.reachable, new.planned)
