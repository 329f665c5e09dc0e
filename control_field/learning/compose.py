"""From prototypes to the control field: equation 7, in either profile."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.headings import UNIT
from control_field.kernels import compiled
from control_field.kernels.interpolation import Attraction, Centres, Sums, Vectors, Window
from control_field.kernels.repair import Flow
from control_field.kernels.steps import Ground, no_preference, plain_ground, Preference
from control_field.learning.doubt import as_shown, cautious, Maps, with_ways_out
from control_field.learning.interpolation import interpolate, weight_from_q
from control_field.learning.memory import Memory
from control_field.local_grid import BLOCKED
from control_field.records import CellFlag, ControlField, Prototypes
from control_field.robot.policy import ground_of, rules_of

#: Weight of the attraction beside a prototype of full weight one cell away.
ATTRACTION_STRENGTH = 2.0
#: Rounds of repair after which the rest is left to the local grid; never reached in our
#: evaluations.
_MOST_ROUNDS = 200
#: A learnt step is kept while what it leads to costs at most this many cells more than the best.
_WORTH_KEEPING = 1.0
#: From this ratio to the best known way on, a shown way is one that has been outdone.
_CLEARLY_LONGER = 1.15
#: From this one on, what a trial did is no longer preferred: its way had looking around in it.
_LONGER_IN_PRACTICE = 1.05


@dataclass(frozen=True, eq=False)
class Composition:
    """
    A field with what it was made of.

    Parameters
    ----------
    field : ControlField
    prototypes : Prototypes
    weights : ndarray of float64, shape (n,)
        Weight of each prototype in eq. 7.
    reachable : ndarray of bool, shape (n_rows, n_cols)
        Cells with a way to the goal on the remembered map.
    planned : ndarray of int8, shape (n_rows, n_cols)
        That map as the field was planned on it: doubted walls as walls, where there is another
        way.

    """

    field: ControlField
    prototypes: Prototypes
    weights: npt.NDArray[np.float64]
    reachable: npt.NDArray[np.bool_]
    planned: npt.NDArray[np.int8]


def compose(memory: Memory) -> Composition:
    """
    Make the field of a memory, in the profile its parameters name.

    It keeps around doubted walls as long as there is another way.

    Raises
    ------
    ValueError
        If nothing was demonstrated yet.

    """
    if memory.goal is None:
        raise ValueError('there is no control field before the first demonstration')
    if memory.parameters.profile == 'paper':
        return _compose_paper(memory)
    return _Composer(memory, cautious(memory.known)).compose()


def compose_shown(memory: Memory) -> Composition | None:
    """
    Make the field that looks whether the shown way is free again (profile full).

    What is doubted there counts as free; the field in force keeps around it. None where nothing
    is in doubt there, or what was shown is not kept to.
    """
    parameters = memory.parameters
    if parameters.profile != 'full' or parameters.prefer_shorter:
        return None
    known = as_shown(memory, rules_of(parameters))
    if np.array_equal(known, memory.known):
        return None
    return _Composer(memory, cautious(known)).compose()


def _compose_paper(memory: Memory) -> Composition:
    """Eq. 7 to the letter."""
    parameters, grid = memory.parameters, memory.grid
    prototypes = memory.prototypes()
    weights = weight_from_q(prototypes.q, parameters.weight_floor)
    cells = np.argwhere(np.ones(grid.shape, dtype=np.bool_))
    vectors = interpolate(
        cells.astype(np.float64), prototypes.cells.astype(np.float64),
        UNIT[prototypes.headings], weights, parameters.power, parameters.effective_window)
    vx, vy = vectors[:, 0].reshape(grid.shape), vectors[:, 1].reshape(grid.shape)
    cost = compiled.cost_to_go(
        plain_ground(memory.known, rules_of(parameters)), _goal(memory), no_preference(grid.shape))
    field = _field(memory, vx, vy, memory.q, prototypes, memory.known)
    return Composition(field, prototypes, weights, np.isfinite(cost), memory.known)


def _goal(memory: Memory) -> tuple[int, int]:
    assert memory.goal is not None
    return memory.goal


def _field(
    memory: Memory, vx: npt.NDArray[np.float64], vy: npt.NDArray[np.float64],
    q: npt.NDArray[np.float64], prototypes: Prototypes, known: npt.NDArray[np.int8],
) -> ControlField:
    """Make unit vectors, keep their length as coherence, and set the flags."""
    length = np.hypot(vx, vy)
    shape = memory.grid.shape
    safe = np.where(length > 1e-9, length, 1.0)
    flags = np.zeros(shape, dtype=np.uint8)
    flags[tuple(prototypes.cells.T)] |= np.uint8(CellFlag.PROTOTYPE)
    flags[memory.demonstrated >= 0] |= np.uint8(CellFlag.DEMONSTRATED)
    flags[_goal(memory)] |= np.uint8(CellFlag.GOAL)
    flags[_supported(memory, prototypes)] |= np.uint8(CellFlag.SUPPORTED)
    return ControlField(
        grid=memory.grid, revision=memory.n_episodes, goal=_goal(memory),
        vx=np.where(length > 1e-9, vx / safe, 0.0).astype(np.float32),
        vy=np.where(length > 1e-9, vy / safe, 0.0).astype(np.float32),
        coherence=np.minimum(length, 1.0).astype(np.float32),
        q=q.astype(np.float32), known=known.copy(), flags=flags)


def _supported(memory: Memory, prototypes: Prototypes) -> npt.NDArray[np.bool_]:
    """Mark the cells within the effective window of a prototype."""
    rows, cols = memory.grid.shape
    window = memory.parameters.effective_window
    reach = int(min(window, max(rows, cols)))
    marked = np.zeros((rows, cols), dtype=np.bool_)
    r, c = np.mgrid[-reach:reach + 1, -reach:reach + 1]
    disc = np.hypot(r, c) <= window
    for row, col in prototypes.cells.tolist():
        top, left = max(row - reach, 0), max(col - reach, 0)
        bottom, right = min(row + reach + 1, rows), min(col + reach + 1, cols)
        marked[top:bottom, left:right] |= disc[
            top - row + reach:bottom - row + reach, left - col + reach:right - col + reach]
    return marked


def _centres(prototypes: Prototypes, weights: npt.NDArray[np.float64]) -> Centres:
    return Centres(prototypes.cells.astype(np.int64), prototypes.headings, weights)


class _Composer:
    """The steps of `profile: full`, over shared arrays."""

    def __init__(self, memory: Memory, maps: Maps) -> None:
        self.memory = memory
        self.parameters = memory.parameters
        self.ground: Ground = ground_of(maps.planned, memory.parameters)
        self.plain_cost = self._cost(no_preference(memory.grid.shape))
        self.maps = with_ways_out(memory, maps, self.plain_cost)
        if self.maps is not maps:
            self.ground = ground_of(self.maps.planned, memory.parameters)
            self.plain_cost = self._cost(no_preference(memory.grid.shape))
        self.q = self._plain_q() if self.parameters.rehearsal else memory.q
        self.demonstrated = self._still_demonstrated()
        self.outdone = self._outdone()
        self.preference = self._preference()
        shape = memory.grid.shape
        self.centre = np.full(shape, -1, dtype=np.int8)
        self.mended = np.zeros(shape, dtype=np.bool_)
        self.sums, self.vectors = Sums.none(shape), Vectors.none(shape)
        self.attraction = Attraction(np.full(shape, -1, dtype=np.int8), ATTRACTION_STRENGTH)
        self.steps = compiled.best_steps(self.ground, self.cost)
        #: What the field was made of last: heading and weight of the prototype of each cell.
        self._made_of = np.full(shape, -1, dtype=np.int8), np.zeros(shape)
        self._is_made = False
        self._state: npt.NDArray[np.int8] | None = None

    def _plain_q(self) -> npt.NDArray[np.float64]:
        """
        Return the Q-matrix that rehearsal comes to without any preference.

        What was demonstrated is preferred where the field is made, not in what is known to be
        good: the greedy path of the Q-matrix is the best one known, whatever way the teacher went.
        """
        q: npt.NDArray[np.float64] = compiled.q_from_cost(
            self.ground, self.plain_cost, no_preference(self.memory.grid.shape),
            self.parameters.discount)
        return q

    def _still_demonstrated(self) -> npt.NDArray[np.int8]:
        """Return the demonstrated steps that are to be kept and not proven blocked."""
        if self.parameters.prefer_shorter:
            return np.full(self.memory.grid.shape, -1, dtype=np.int8)
        kept: npt.NDArray[np.int8] = compiled.kept_steps(
            self.ground.known, self.memory.demonstrated, self.ground.rules)
        return kept

    def _outdone(self) -> npt.NDArray[np.bool_]:
        """
        Mark where the shown way is clearly longer than one that has opened since.

        It is kept there, but draws nobody else: others take what it is longer as the price of a
        step onto it.
        """
        opened, ground = self.memory.evidence.opened, self.ground
        if not opened.any() or self.parameters.prefer_shorter:
            return np.zeros(opened.shape, dtype=np.bool_)
        goal, none = _goal(self.memory), no_preference(opened.shape)
        lengths = compiled.flow_lengths(ground.known, self.demonstrated, *goal, ground.rules)
        shut = ground._replace(known=np.where(opened, BLOCKED, ground.known).astype(np.int8))
        is_shorter = self.plain_cost < compiled.cost_to_go(shut, goal, none) - 1e-9
        outdone: npt.NDArray[np.bool_] = (
            (self.demonstrated >= 0) & np.isfinite(lengths) & is_shorter
            & (lengths > _CLEARLY_LONGER * self.plain_cost))
        factor = self.ground.factor.copy()
        factor[outdone] += lengths[outdone] - self.plain_cost[outdone]
        self.ground = self.ground._replace(factor=factor)
        return outdone

    def _preference(self) -> Preference:
        """
        Return the step to prefer in each cell, and note the cost to go with it.

        What was demonstrated comes first, then what led to the goal in a trial, unless the
        remembered map now knows a clearly shorter way. With ``prefer_shorter`` there is none.
        """
        parameters, action = self.parameters, self.memory.action
        if parameters.prefer_shorter:
            self.cost = self.plain_cost
            return no_preference(self.memory.grid.shape)
        followed = np.where(self.outdone, -1, self.demonstrated).astype(np.int8)
        preference = Preference(followed, np.where(
            followed >= 0, parameters.demonstration_advantage, 0.0))
        self.cost = self._cost(preference)
        practised = np.where(self.demonstrated < 0, action, -1).astype(np.int8)
        if (practised >= 0).any():
            compiled.prefer_practised(
                self.ground, self.cost, practised, _LONGER_IN_PRACTICE,
                float(parameters.practice_advantage), preference)
            self.cost = self._cost(preference)
        return preference

    def _cost(self, preference: Preference) -> npt.NDArray[np.float64]:
        cost: npt.NDArray[np.float64] = compiled.cost_to_go(
            self.ground, _goal(self.memory), preference)
        return cost

    def compose(self) -> Composition:
        """Choose the prototypes, mend and prune, and make the field."""
        self._choose()
        self._interpolate()
        if self._repairs():
            self._repair()
        if self.parameters.pruning:
            self._prune()
        prototypes, weights = self._table()
        field = _field(
            self.memory, self.vectors.x, self.vectors.y, self.q, prototypes, self.maps.known)
        return Composition(
            field, prototypes, weights, np.isfinite(self.cost), self.maps.planned)

    def _choose(self) -> None:
        """Start from what was learnt, less what the remembered map has since disproved."""
        action, kept = self.memory.action, self.memory.action
        if self.parameters.rehearsal:
            kept = compiled.worth_keeping(
                self.ground, self.cost, action, self.preference,
                1e-9 if self.parameters.prefer_shorter else _WORTH_KEEPING)
        if self.parameters.demonstration_advantage > 0.0:
            is_shown = (action >= 0) & (self.demonstrated >= 0)
            kept = np.where(is_shown, self.demonstrated, kept)
        self.centre = kept.astype(np.int8)

    def _table(self) -> tuple[Prototypes, npt.NDArray[np.float64]]:
        """Return the prototypes as they stand, and their weights."""
        memory = self.memory
        cells = np.argwhere(self.centre >= 0).astype(np.int32)
        at = (cells[:, 0], cells[:, 1])
        headings = self.centre[at]
        own = self.mended[at] | (memory.action[at] != headings)
        q = self.q[(*at, headings)].astype(np.float64)
        prototypes = Prototypes(
            cells=cells, headings=headings, q=q,
            episodes=np.where(own, -memory.n_episodes, memory.episode[at]).astype(np.int32),
            stamps=np.where(own, np.nan, memory.stamp[at]),
            demonstrated=memory.demonstrated[at] == headings)
        weights = weight_from_q(q, self.parameters.weight_floor)
        weights[self.outdone[at]] = self.parameters.weight_floor
        return prototypes, weights

    def _interpolate(self) -> None:
        """
        Evaluate eq. 7 with windows and attraction, wherever prototypes have changed.

        There the sums begin anew, in the order of the prototypes: all is as if made at once.
        """
        prototypes, weights = self._table()
        wanted, window, ground = self._changed(prototypes, weights), self._window(), self.ground
        for part in self.sums:
            part[wanted] = 0.0
        compiled.add_windows(
            self.sums, ground.known, _centres(prototypes, weights), window, wanted)
        if self.parameters.pull:
            self._attract(prototypes, wanted)
        compiled.field_vectors(self.sums, self.centre, self.attraction, self.vectors, wanted)
        self._state = None

    def _changed(
        self, prototypes: Prototypes, weights: npt.NDArray[np.float64],
    ) -> npt.NDArray[np.bool_]:
        """Mark the windows of the prototypes that are not as they were; at first, every cell."""
        own = np.zeros(self.centre.shape)
        own[tuple(prototypes.cells.T)] = weights
        (centre, before), self._made_of = self._made_of, (self.centre.copy(), own)
        draws_anywhere = self.parameters.pull and not self.parameters.rehearsal
        if not self._is_made or draws_anywhere:
            self._is_made = True
            return np.ones(centre.shape, dtype=np.bool_)
        changed: npt.NDArray[np.bool_] = compiled.windows_of(
            (centre != self.centre) | (own != before), self._window())
        return changed

    def _window(self) -> Window:
        parameters = self.parameters
        return Window(float(min(parameters.effective_window, max(self.memory.grid.shape))),
                      float(parameters.power), parameters.visible_windows)

    def _attract(self, prototypes: Prototypes, wanted: npt.NDArray[np.bool_]) -> None:
        """Note which way the attraction draws, where it is wanted."""
        if self.parameters.rehearsal:
            compiled.settle_ties(self.attraction.headings, *self.steps, self.ground, self.cost,
                                 self.sums, wanted)
        else:
            self.attraction.headings[:] = compiled.attraction_to_nearest(
                self.ground.known, prototypes.cells.astype(np.int64), self.ground.rules)

    def _repairs(self) -> bool:
        return self.parameters.repair and self.parameters.rehearsal

    def _repair(self) -> None:
        """Give the cells whose flow does not come home a prototype, few at a time."""
        for _ in range(_MOST_ROUNDS):
            cells = compiled.mending_cells(
                self.ground, self.cost, self.vectors.headings, self.state, self.demonstrated >= 0)
            if not cells.any():
                return
            before = self.centre.copy()
            self.centre[cells] = self.steps[0][cells]
            self.mended |= cells
            if np.array_equal(before, self.centre):
                return  # what is left cannot be mended in this way
            self._interpolate()

    def _prune(self) -> None:
        """Drop the prototypes without which no heading is worse; what a person showed stays."""
        prototypes, weights = self._table()
        candidates = np.flatnonzero(~prototypes.demonstrated)
        order = candidates[np.argsort(prototypes.q[candidates], kind='stable')]
        before, centre = self.centre, self.centre.copy()
        flow = Flow(Sums(*(part.copy() for part in self.sums)), self.attraction, centre,
                    self.vectors.headings.copy())
        idle = compiled.idle_prototypes(
            order, _centres(prototypes, weights), flow, self.ground, self.cost, self._window())
        if not idle.any():
            return
        n_home, mended = self._n_home(), self.mended.copy()
        self.centre = centre
        self._interpolate()
        # No heading is worse, and yet several that are as good as before may close a loop.
        if self._n_home() < n_home and self._repairs():
            self._repair()
        if self._n_home() < n_home:
            self.centre, self.mended = before, mended
            self._interpolate()

    @property
    def state(self) -> npt.NDArray[np.int8]:
        """Return where the flow from each cell leads, see `flow_basin`."""
        if self._state is None:
            self._state = compiled.flow_basin(
                self.ground.known, self.vectors.headings, *_goal(self.memory), self.ground.rules)
        return self._state

    def _n_home(self) -> int:
        """Return from how many cells the flow comes home."""
        return int((self.state == 1).sum())
