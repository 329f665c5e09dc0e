"""What a field is worth, checked exhaustively on the grid."""

import dataclasses
from dataclasses import dataclass
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.headings import headings_from_vectors
from control_field.kernels import compiled
from control_field.kernels.steps import no_preference, plain_ground, StepRules
from control_field.records import ControlField
from control_field.robot.policy import is_doubted
from control_field.words import counted

#: Ground seen in so many episodes, the last ones, counts as confirmed.
RECENT: Final = 10
#: Age of ground that was never seen, [episodes].
NEVER: Final = 2**31 - 1


@dataclass(frozen=True, eq=False)
class Certificate:
    """
    How far a field can be trusted on the map that is remembered so far.

    Parameters
    ----------
    basin : float
        Share of the known free, reachable cells whose flow reaches the goal, taking cells never
        seen as free.
    proven : float
        Share of them whose flow reaches the goal over cells seen to be free only.
    sinks : ndarray of int32, shape (k, 2)
        Cells ``(row, col)`` where a flow from a known free, reachable cell ends, on seen ground
        or not: its heading is blocked or missing, or it is a cell of a loop.
    fidelity : float
        Share of the demonstrated cells, among those not proven blocked, where the field still
        does what was demonstrated; NaN without any.
    n_prototypes : int
    n_free : int
        Known free cells.
    n_reachable : int
        Known free cells from which the remembered map allows a way to the goal.
    coherence_min : float
        Least coherence over them.
    confirmed : float
        Share of the basin whose whole way home was seen in the last `RECENT` episodes; NaN where
        nobody says when it was seen.
    oldest : int, [episodes]
        How long ago the ground was seen that was not seen for longest of all that the basin
        stands on; `NEVER` if some of it never was, -1 where nobody says.
    doubted : ndarray of int32, shape (k, 2)
        Cells ``(row, col)`` in doubt: occupied when they were seen last, which is a while ago.
    leaning : float
        Share of the basin whose way home leads through such cells: it has no other.

    """

    basin: float
    proven: float
    sinks: npt.NDArray[np.int32]
    fidelity: float
    n_prototypes: int
    n_free: int
    n_reachable: int
    coherence_min: float
    confirmed: float = float('nan')
    oldest: int = -1
    doubted: npt.NDArray[np.int32] = dataclasses.field(
        default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    leaning: float = 0.0

    @property
    def n_reached(self) -> int:
        """Return how many of the reachable cells have a flow to the goal."""
        return round(self.basin * self.n_reachable)

    def sentence(self) -> str:
        """Say from where the robot gets to the goal, in plain words; `numbers` has the rest."""
        n, cut_off = self.n_reachable, self.n_free - self.n_reachable
        if n == 0:
            return 'From none of the places seen so far there is a way to the goal.'
        which = f'{self.n_reached} of {counted(n, "place")}'
        if self.n_reached == n:
            which = 'the only place' if n == 1 else f'all {n} places'
        rest = f' There is no way to it from {cut_off} more.' if cut_off else ''
        if self.leaning:
            rest = (f' From {round(self.leaning * self.n_reached)} of them only if what is in '
                    f'doubt is no longer in the way.{rest}')
        return f'From {which} seen so far the robot gets to the goal.{rest}'

    def numbers(self) -> str:
        """Return the certificate in numbers, for who wants to know more than `sentence` says."""
        return (f'basin {self.basin:.1%} of {counted(self.n_reachable, "known free cell")} '
                f'({self.proven:.1%} over seen ground only), {counted(len(self.sinks), "sink")}, '
                f'fidelity {self.fidelity:.1%}, {counted(self.n_prototypes, "prototype")}, '
                f'coherence at least {self.coherence_min:.2f}{self._age()}')

    def _age(self) -> str:
        """Return how old the ground is, and what is in doubt, in numbers."""
        text = ('' if math.isnan(self.confirmed) else
                f', {self.confirmed:.1%} of the basin seen in the last {RECENT} episodes')
        if len(self.doubted):
            text += (f', {counted(len(self.doubted), "cell")} in doubt ({self.leaning:.1%} of the '
                     f'basin lean on them)')
        return text


def fidelity_of(
    headings: npt.NDArray[np.int8], demonstrated: npt.NDArray[np.int8],
    known: npt.NDArray[np.int8], rules: StepRules,
) -> float:
    """
    Return the share of demonstrated cells where the field does what was demonstrated.

    Parameters
    ----------
    headings : ndarray of int8, shape (n_rows, n_cols)
        Of the field.
    demonstrated : ndarray of int8, shape (n_rows, n_cols)
        Demonstrated heading a cell, -1 for none.
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map; a demonstrated step that it bars does not count.

    """
    n_possible, n_agreeing = compiled.n_as_demonstrated(known, headings, demonstrated, rules)
    return n_agreeing / n_possible if n_possible else float('nan')


def certify(
    field: ControlField, demonstrated: npt.NDArray[np.int8], n_prototypes: int, rules: StepRules,
    reachable: npt.NDArray[np.bool_] | None = None,
    planned: npt.NDArray[np.int8] | None = None, age: npt.NDArray[np.int32] | None = None,
) -> Certificate:
    """
    Check a field from every cell of its own remembered map.

    Parameters
    ----------
    field : ControlField
    demonstrated : ndarray of int8, shape (n_rows, n_cols)
        Demonstrated heading a cell, -1 for none.
    n_prototypes : int
    rules : StepRules
    reachable : ndarray of bool, shape (n_rows, n_cols), optional
        Cells with a way to the goal, if the caller knows them already.
    planned : ndarray of int8, shape (n_rows, n_cols), optional
        The remembered map with doubted walls as walls, where the field was to keep around them.
    age : ndarray of int32, shape (n_rows, n_cols), optional
        How many episodes ago each cell was seen last, -1 where it never was.

    """
    planned = field.known if planned is None else planned
    headings = headings_from_vectors(field.vx, field.vy)
    if reachable is None:
        cost = compiled.cost_to_go(
            plain_ground(planned, rules), field.goal, no_preference(field.known.shape))
        reachable = np.isfinite(cost)
    judged = (field.known == 0) & reachable
    n = int(judged.sum())
    state = compiled.flow_basin(planned, headings, *field.goal, rules)
    proven = compiled.flow_basin(
        planned, headings, *field.goal, rules._replace(unknown_is_blocked=True))
    at_end = compiled.flow_ends(planned, headings, state, judged, rules)
    away, home = judged.copy(), judged & (state == 1)
    away[field.goal] = False
    return Certificate(
        basin=float((state[judged] == 1).mean()) if n else 0.0,
        proven=float((proven[judged] == 1).mean()) if n else 0.0,
        sinks=np.argwhere(at_end).astype(np.int32),
        fidelity=fidelity_of(headings, demonstrated, planned, rules),
        n_prototypes=n_prototypes, n_free=int((field.known == 0).sum()), n_reachable=n,
        coherence_min=float(field.coherence[away].min()) if away.any() else 0.0,
        **_evidence(field, headings, state, home, age))


def _evidence(
    field: ControlField, headings: npt.NDArray[np.int8], state: npt.NDArray[np.int8],
    home: npt.NDArray[np.bool_], age: npt.NDArray[np.int32] | None,
) -> dict[str, Any]:
    """Return what the certificate says of the age of the ground, and of what is in doubt."""
    doubted = is_doubted(field.known)
    found: dict[str, Any] = {'doubted': np.argwhere(doubted).astype(np.int32)}
    if doubted.any() and home.any():
        leans = compiled.most_ahead(headings, state, doubted.astype(np.int32), *field.goal)
        found['leaning'] = float(leans[home].mean())
    if age is not None and home.any():
        since = np.where(age < 0, NEVER, age).astype(np.int32)
        oldest = compiled.most_ahead(headings, state, since, *field.goal)[home]
        found['oldest'], found['confirmed'] = int(oldest.max()), float((oldest < RECENT).mean())
    return found
