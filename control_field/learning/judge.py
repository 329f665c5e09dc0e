"""What becomes of trials from many starts, when nothing is learnt between them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.kernels import compiled
from control_field.kernels.decision import TrialState
from control_field.kernels.local_search import new_search
from control_field.kernels.queues import Places
from control_field.kernels.rollout import new_flow
from control_field.kernels.sharing import Beforehand, BY_LOT, Ends, OPEN, Work
from control_field.kernels.visibility import Scanner
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import options_of, trial_on

#: Starts that are judged between two looks at how far it is.
_AT_ONCE: Final = 512
#: Side of the blocks that starts are taken in, [cells]: trials from near each other have most
#: rehearsals in common, and only the latest ones are kept.
_BLOCK: Final = 24


@dataclass(frozen=True, eq=False)
class Runs:
    """
    What became of trials from several starts.

    Parameters
    ----------
    outcome : ndarray of int8, shape (n,)
        0 goal, 1 collision, 2 gave up.
    n_steps, n_reinforcements : ndarray of int64, shape (n,)
    length : ndarray of float64, shape (n,), [cells]

    """

    outcome: npt.NDArray[np.int8]
    n_steps: npt.NDArray[np.int64]
    n_reinforcements: npt.NDArray[np.int64]
    length: npt.NDArray[np.float64]


class Judge:
    """
    Tells what becomes of trials on a field as if each was run alone, but for rounding of lengths.

    Parameters
    ----------
    field : ControlField
    truth : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked.
    parameters : Parameters
    cost : ndarray of float64, shape (n_rows, n_cols)
        True least cost to the goal; inf without a way.
    scanner : Scanner
        How far the robot sees.

    Attributes
    ----------
    n_run : int
        How many trials were run, and not known from others.

    """

    def __init__(self, field: ControlField, truth: npt.NDArray[np.int8], parameters: Parameters,
                 cost: npt.NDArray[np.float64], scanner: Scanner) -> None:
        self._truth, self._parameters, self._scanner = truth, parameters, scanner
        state = trial_on(field, field.known.copy(), parameters)
        self._trial = state._replace(
            search=new_search(truth.shape, True), flow=new_flow(truth.shape, True))
        self._before = _beforehand(state, truth, np.isfinite(cost))
        n_places, n_shown = truth.size, len(scanner.shown)
        self._ends = Ends(
            np.full(n_places, OPEN, dtype=np.int8), np.zeros(n_places, dtype=np.int64),
            np.zeros(n_places, dtype=np.int64), np.zeros(n_places))
        self._work = Work(
            np.empty(parameters.step_limit, dtype=np.int64), np.zeros(n_places, dtype=np.int64),
            np.zeros(n_places, dtype=np.int64), np.zeros(n_places, dtype=np.int64),
            np.zeros((n_shown, n_shown), dtype=np.int8), np.zeros(1, dtype=np.int64))

    @property
    def n_run(self) -> int:
        """Return how many trials were run, and not known from others."""
        return int(self._work.n_trials[0])

    def runs(self, starts: npt.NDArray[np.integer], seed: int,
             watch: Callable[[int], None] | None = None) -> Runs:
        """
        Return what becomes of a trial from every start.

        Parameters
        ----------
        starts : ndarray of int, shape (n, 2)
            Free cells.
        seed : int
            Of the first one; that of each other is one more.
        watch : callable, optional
            Is told how many are done, again and again.

        """
        places = (np.asarray(starts) @ [self._truth.shape[1], 1]).astype(np.int64)
        columns: list[npt.NDArray[Any]] = list(self._ends)
        ends = [np.empty(len(places), column.dtype) for column in columns]
        order = _block_by_block(np.asarray(starts))
        for first in range(0, len(places), _AT_ONCE):
            part = order[first:first + _AT_ONCE]
            for end, column in zip(ends, self._ends_of(places[part], seed + part), strict=True):
                end[part] = column
            if watch is not None:
                watch(min(first + _AT_ONCE, len(places)))
        return Runs(*ends)

    def _ends_of(self, places: Places, seeds: Places) -> tuple[npt.NDArray[Any], ...]:
        """Return outcome, steps, reinforcements and length from some places."""
        self._call(compiled.judge, places, np.random.default_rng(int(seeds[0])))
        columns: list[npt.NDArray[Any]] = list(self._ends)
        ends = tuple(column[places] for column in columns)
        for index in np.flatnonzero(ends[0] == BY_LOT):
            place = places[index]
            self._call(compiled.run_alone, place, np.random.default_rng(int(seeds[index])))
            for end, column in zip(ends, columns, strict=True):
                end[index] = column[place]
        return ends

    def _call(self, kernel: Callable[..., None], places: Places | np.int64,
              rng: np.random.Generator) -> None:
        parameters = self._parameters
        kernel(self._truth, places, self._trial, options_of(parameters), parameters.step_limit,
               rng, self._scanner, self._before, self._ends, self._work)


def _block_by_block(starts: npt.NDArray[np.integer]) -> npt.NDArray[np.int64]:
    """Return the order of starts in which they are taken."""
    rows, cols = starts.T
    return np.lexsort((cols, rows, cols // _BLOCK, rows // _BLOCK))


def _beforehand(
    state: TrialState, truth: npt.NDArray[np.int8], reachable: npt.NDArray[np.bool_],
) -> Beforehand:
    """Return what is known before trials that begin with a state."""
    known, rules = state.ground.known, state.ground.rules
    lengths, n_steps = compiled.flows_home(truth, state.headings, *state.goal, rules)
    home = compiled.flow_basin(known, state.headings, *state.goal, rules) == 1
    return Beforehand(
        known.copy(), state.ground.factor.copy(), state.cost.copy(), state.q.copy(), lengths,
        n_steps, home, reachable, not bool(((known > 0) & (truth == 0)).any()))
