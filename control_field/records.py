"""What the parts hand to each other: decisions, trials, demonstrations, prototypes, the field."""

from dataclasses import dataclass, field, replace
from enum import IntEnum, StrEnum
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import N_HEADINGS


class Kind(IntEnum):
    """Why an action was chosen, or what became of it."""

    FIELD = 0    #: the field's own heading; earns nothing
    BLOCKED = 1  #: the heading was blocked: the robot stays, the action earns -1
    AVOID = 2    #: chosen from the Q-matrix in its stead; earns +1 the first time
    EXPLORE = 3  #: random, count-guided, to leave an oscillation
    TAUGHT = 4   #: a person drove this step during the trial
    DETOUR = 5   #: the heading is free here but is remembered to fail further on: from Q, earns 0


class Outcome(StrEnum):
    """How a trial ended."""

    GOAL = 'goal'
    COLLISION = 'collision'
    GAVE_UP = 'gave_up'      #: step or time limit, or no way left
    STOPPED = 'stopped'      #: a person or a safety rule stopped it
    ABORTED = 'aborted'      #: a process died; nothing is learnt from it


#: One row a decision, in the order they were made. ``next_row, next_col`` is the cell the robot
#: was in when the step was over (its own cell again for BLOCKED). ``blocked`` and ``unknown`` are
#: the masks of the 3x3 local grid the decision was made on. ``stamp`` is in seconds, ``revision``
#: the field it was made with.
DECISION_DTYPE: Final = np.dtype([
    ('stamp', '<f8'), ('trial', '<u4'), ('step', '<u4'), ('revision', '<u4'),
    ('row', '<i4'), ('col', '<i4'), ('next_row', '<i4'), ('next_col', '<i4'),
    ('action', 'i1'), ('reward', 'i1'), ('kind', 'u1'), ('blocked', 'u1'), ('unknown', 'u1'),
])


def local_grid_dtype(side: int) -> np.dtype[np.void]:
    """
    Return the type of a table of local grids: stamp [s], cell it was seen from, side x side cells.

    Row 0 of the cells is at the lowest y, the robot's cell in the middle; 0, 100 or -1 each.
    """
    return np.dtype([('stamp', '<f8'), ('row', '<i4'), ('col', '<i4'),
                     ('cells', 'i1', (side, side))])


def no_local_grids() -> npt.NDArray[np.void]:
    """Return the table of a drive whose local grids show no more than the cells around."""
    return np.zeros(0, dtype=local_grid_dtype(3))


def _check_local_grids(local_grids: npt.NDArray[np.void]) -> None:
    """Refuse what is no table of local grids."""
    names = local_grids.dtype.names or ()
    cells = local_grids['cells'].shape if 'cells' in names else ()
    if local_grids.ndim != 1 or len(cells) != 3 or local_grids.dtype != local_grid_dtype(cells[1]):
        raise ValueError('local_grids must be a one-dimensional table of local_grid_dtype')


def _shifted(local_grids: npt.NDArray[np.void], rows: int, cols: int) -> npt.NDArray[np.void]:
    moved = local_grids.copy()
    moved['row'] += rows
    moved['col'] += cols
    return moved


def _read_only(array: npt.NDArray[np.generic]) -> None:
    array.setflags(write=False)


def _check_shape(name: str, array: npt.NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise ValueError(f'{name} has shape {array.shape}, must be {shape}')


@dataclass(frozen=True, eq=False)
class Demonstration:
    """
    A drive that a person showed, as cells.

    Parameters
    ----------
    cells : ndarray of int32, shape (n, 2)
        ``(row, col)`` in the order they were driven through, each one a neighbour of the one
        before it, no cell twice in a row. The last one is the goal.
    stamps : ndarray of float64, shape (n,), [s]
        When each cell was entered.
    blocked, unknown : ndarray of uint8, shape (n,)
        Masks of the local grid in each cell (``unknown`` all ones where there was none).
    episode : int
        Number of the bag it came from; 0 where there is none.
    local_grids : ndarray of `local_grid_dtype`, shape (m,)
        What was seen beyond the cells around the robot's, by stamp; each counts until the next.

    Raises
    ------
    ValueError
        If the shapes disagree, or two cells in a row are not neighbours.

    """

    cells: npt.NDArray[np.int32]
    stamps: npt.NDArray[np.float64]
    blocked: npt.NDArray[np.uint8]
    unknown: npt.NDArray[np.uint8]
    episode: int = 0
    local_grids: npt.NDArray[np.void] = field(default_factory=no_local_grids)

    def __post_init__(self) -> None:
        """Check shapes and steps."""
        _check_local_grids(self.local_grids)
        n = len(self.cells)
        _check_shape('cells', self.cells, (n, 2))
        for name in ('stamps', 'blocked', 'unknown'):
            _check_shape(name, getattr(self, name), (n,))
        if n and np.abs(np.diff(self.cells, axis=0)).max(axis=1).min(initial=1) < 1:
            raise ValueError('a demonstration stays in one cell for two steps')
        if n and np.abs(np.diff(self.cells, axis=0)).max(initial=0) > 1:
            raise ValueError('a demonstration jumps between cells that are not neighbours')
        for name in ('cells', 'stamps', 'blocked', 'unknown', 'local_grids'):
            _read_only(getattr(self, name))

    def shifted(self, rows: int, cols: int) -> 'Demonstration':
        """Return it with all of its cells so many rows and columns farther up."""
        if not rows and not cols:
            return self
        return replace(self, cells=(self.cells + np.array([rows, cols])).astype(np.int32),
                       local_grids=_shifted(self.local_grids, rows, cols))


@dataclass(frozen=True, eq=False)
class Trial:
    """
    One run from a start to goal, collision or give-up.

    Parameters
    ----------
    decisions : ndarray of DECISION_DTYPE, shape (n,)
        In the order they were made.
    outcome : Outcome
        How it ended.
    episode : int
        Number of the bag it came from; 0 where there is none.
    local_grids : ndarray of `local_grid_dtype`, shape (m,)
        What was seen beyond the cells around the robot's, by stamp; each counts until the next.

    """

    decisions: npt.NDArray[np.void]
    outcome: Outcome
    episode: int = 0
    local_grids: npt.NDArray[np.void] = field(default_factory=no_local_grids)

    def __post_init__(self) -> None:
        """Check the tables."""
        _check_local_grids(self.local_grids)
        _read_only(self.local_grids)
        if self.decisions.dtype != DECISION_DTYPE or self.decisions.ndim != 1:
            raise ValueError('decisions must be a one-dimensional DECISION_DTYPE table')
        _read_only(self.decisions)

    def shifted(self, rows: int, cols: int) -> 'Trial':
        """Return it with all of its cells so many rows and columns farther up."""
        if not rows and not cols:
            return self
        decisions = self.decisions.copy()
        for name, n in (('row', rows), ('next_row', rows), ('col', cols), ('next_col', cols)):
            decisions[name] += n
        return replace(self, decisions=decisions,
                       local_grids=_shifted(self.local_grids, rows, cols))

    @property
    def n_steps(self) -> int:
        """Return the number of cell-to-cell steps."""
        return int((self.decisions['kind'] != Kind.BLOCKED).sum())

    @property
    def n_online_reinforcements(self) -> int:
        """Return how often a reward other than zero was given under way."""
        return int((self.decisions['reward'] != 0).sum())

    @property
    def n_reinforcements(self) -> int:
        """
        Return how many rewards are learnt from: those under way and R_goal.

        None if the field alone led to the goal, or the trial was stopped or broken off.
        """
        kinds = self.decisions['kind']
        alone = self.outcome == Outcome.GOAL and bool((kinds == Kind.FIELD).all())
        if alone or self.outcome in (Outcome.STOPPED, Outcome.ABORTED) or not self.n_steps:
            return 0
        return self.n_online_reinforcements + 1


@dataclass(frozen=True, eq=False)
class Prototypes:
    """
    Prototypes, the paper's hidden neurons: one a cell, ordered by row, then column.

    Parameters
    ----------
    cells : ndarray of int32, shape (n, 2)
        ``(row, col)`` of the centres.
    headings : ndarray of int8, shape (n,)
        Action of each, 0 to 7.
    q : ndarray of float64, shape (n,)
        Q-value of that action there.
    episodes : ndarray of int32, shape (n,)
        Number of the bag that each came from; a negative one, -n, is a prototype that the learner
        added itself when it had learnt from n bags, whatever their numbers.
    stamps : ndarray of float64, shape (n,), [s]
        Second of that bag; NaN for the learner's own.
    demonstrated : ndarray of bool, shape (n,)
        Whether a person showed it.

    """

    cells: npt.NDArray[np.int32]
    headings: npt.NDArray[np.int8]
    q: npt.NDArray[np.float64]
    episodes: npt.NDArray[np.int32]
    stamps: npt.NDArray[np.float64]
    demonstrated: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Check shapes."""
        n = len(self.cells)
        _check_shape('cells', self.cells, (n, 2))
        for name in ('headings', 'q', 'episodes', 'stamps', 'demonstrated'):
            _check_shape(name, getattr(self, name), (n,))
        for name in ('cells', 'headings', 'q', 'episodes', 'stamps', 'demonstrated'):
            _read_only(getattr(self, name))

    def __len__(self) -> int:
        """Return the number of prototypes."""
        return len(self.cells)

    @classmethod
    def none(cls) -> 'Prototypes':
        """Return no prototypes."""
        return cls(
            cells=np.zeros((0, 2), dtype=np.int32), headings=np.zeros(0, dtype=np.int8),
            q=np.zeros(0), episodes=np.zeros(0, dtype=np.int32), stamps=np.zeros(0),
            demonstrated=np.zeros(0, dtype=np.bool_))


class CellFlag(IntEnum):
    """Bits of ``ControlField.flags``."""

    PROTOTYPE = 1     #: the cell is a centre
    DEMONSTRATED = 2  #: a person drove through it
    GOAL = 4          #: the trial ends here
    SUPPORTED = 8     #: a prototype's effective window reaches it: something was learnt there


@dataclass(frozen=True, eq=False)
class ControlField:
    """
    Which way to go, at every cell: all that the robot needs.

    Parameters
    ----------
    grid : Grid
        The workspace.
    revision : int
        Number of episodes it was learnt from; grows by one with every refresh, and is used again
        once a bag was dropped.
    goal : tuple of int
        ``(row, col)`` where a trial ends.
    vx, vy : ndarray of float32, shape (n_rows, n_cols)
        Unit vector of the heading; (0, 0) where there is none.
    coherence : ndarray of float32, shape (n_rows, n_cols)
        Length of the averaged vector before it was made a unit vector, 0 to 1.
    q : ndarray of float32, shape (n_rows, n_cols, 8)
        Q-matrix.
    known : ndarray of int8, shape (n_rows, n_cols)
        Remembered map: 0 free, 100 blocked, -1 never seen; 1 to 99 blocked when it was seen last,
        which is in doubt: the confidence that it still is.
    flags : ndarray of uint8, shape (n_rows, n_cols)
        Bits of `CellFlag`.
    memory : str
        Name of the task and of what its memory holds; empty where nobody says.

    Raises
    ------
    ValueError
        If a shape disagrees with the grid or the goal lies outside it.

    """

    grid: Grid
    revision: int
    goal: tuple[int, int]
    vx: npt.NDArray[np.float32]
    vy: npt.NDArray[np.float32]
    coherence: npt.NDArray[np.float32]
    q: npt.NDArray[np.float32]
    known: npt.NDArray[np.int8]
    flags: npt.NDArray[np.uint8]
    memory: str = ''

    def __post_init__(self) -> None:
        """Check shapes and the goal."""
        for name in ('vx', 'vy', 'coherence', 'known', 'flags'):
            _check_shape(name, getattr(self, name), self.grid.shape)
        _check_shape('q', self.q, (*self.grid.shape, N_HEADINGS))
        if not self.grid.contains(*self.goal):
            raise ValueError(f'the goal {self.goal} lies outside the workspace {self.grid.shape}')
        for name in ('vx', 'vy', 'coherence', 'q', 'known', 'flags'):
            _read_only(getattr(self, name))

    @cached_property
    def is_void(self) -> bool:
        """Return whether no cell has a heading: there is nothing to drive on."""
        return not (self.vx.any() or self.vy.any())

    @classmethod
    def void(cls, grid: Grid) -> 'ControlField':
        """Return the field of revision 0, before anything was learnt."""
        nothing = np.zeros(grid.shape, dtype=np.float32)
        return cls(
            grid=grid, revision=0, goal=(0, 0), vx=nothing, vy=nothing, coherence=nothing,
            q=np.zeros((*grid.shape, N_HEADINGS), dtype=np.float32),
            known=np.full(grid.shape, -1, dtype=np.int8),
            flags=np.zeros(grid.shape, dtype=np.uint8))
