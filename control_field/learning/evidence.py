"""What was seen of every cell, in which episode last, and how often so: evidence, not a flag."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.kernels import compiled
from control_field.kernels.seen import FREE_SEEN, OCCUPIED_LAST, OCCUPIED_SEEN
from control_field.local_grid import BLOCKED, FREE, UNKNOWN
from control_field.windows import moved

#: Confidence of a wall that has just come to be doubted, and how low it falls with age.
_HIGHEST: Final = 99
_LOWEST: Final = 25
#: From so many episodes in a row on, more of them make nothing surer: 2 ** 20 episodes last long.
_MOST_IN_A_ROW: Final = 20


class Evidence:
    """
    What the episodes have shown of every cell, in the order they came.

    A cell seen free and occupied in one episode is something that moves: free, unless it was a
    wall before and was one when it was seen last. So one wrong reading neither makes nor takes a
    wall that was looked at twice.

    Parameters
    ----------
    shape : tuple of int
        ``(n_rows, n_cols)``
    map_memory : int, [episodes]
        A wall not seen for so many episodes is doubted; one seen less often, sooner. 0: never.

    """

    def __init__(self, shape: tuple[int, int], map_memory: int) -> None:
        self.map_memory = map_memory
        self.n_episodes = 0  #: episodes that have shown something
        self.state = np.full(shape, UNKNOWN, dtype=np.int8)
        self._last_seen = np.zeros(shape, dtype=np.int32)
        self._in_a_row = np.zeros(shape, dtype=np.int32)
        self._times_free = np.zeros(shape, dtype=np.int32)
        self._is_passing = np.zeros(shape, dtype=np.bool_)
        self._shown = np.zeros(shape, dtype=np.uint8)
        self._changed_by = 0  #: episode by which what was noticed has changed
        self.opened = np.zeros(shape, dtype=np.bool_)  #: free now, a wall when it was seen before

    def grow(self, old: Grid, new: Grid) -> None:
        """Go on in a larger workspace of the same lattice; of its new cells nothing was seen."""
        self.state = moved(self.state, old, new, UNKNOWN)
        for name in ('_last_seen', '_in_a_row', '_times_free', '_is_passing', '_shown', 'opened'):
            setattr(self, name, moved(getattr(self, name), old, new, 0))

    def begin(self) -> None:
        """Begin an episode: nothing was seen in it yet."""
        self._shown = np.zeros(self.state.shape, dtype=np.uint8)

    def observe(self, row: int, col: int, blocked: int, unknown: int) -> None:
        """
        Take in a 3x3 local grid.

        Parameters
        ----------
        row, col : int
            The robot's cell, which is free.
        blocked, unknown : int
            Masks of its neighbours.

        """
        compiled.note_local_grid(self._shown, row, col, blocked, unknown)

    def observe_cells(self, top: int, left: int, cells: npt.NDArray[np.int8]) -> None:
        """
        Take in a block of cells of any size.

        Parameters
        ----------
        top, left : int
            Cell of ``cells[0, 0]``; the block may reach out of the workspace.
        cells : ndarray of int8, shape (n, m)
            0 free, 100 occupied, -1 where nothing was seen.

        """
        compiled.note_cells(self._shown, top, left, cells)

    def end(self) -> None:
        """End an episode: what was seen in it is older than nothing from now on."""
        shown = self._shown
        self.n_episodes += 1
        was_wall = (shown & OCCUPIED_LAST != 0) & (self.state == BLOCKED)
        wall = (shown & OCCUPIED_SEEN != 0) & ((shown & FREE_SEEN == 0) | was_wall)
        free = (shown != 0) & ~wall
        opened = free & (self.state == BLOCKED)
        other = (wall & (self.state == FREE)) | opened
        self.opened = (self.opened | opened) & ~wall
        if self._last_seen[other].max(initial=-1) >= self._changed_by:
            self._changed_by = self.n_episodes
        # Where something moves, what is first seen may be a part of it.
        moves = free & (shown & OCCUPIED_SEEN != 0)
        self._is_passing = np.where(
            wall, (self.state == UNKNOWN) & moves.any(), self._is_passing & ~free)
        self.state[wall], self.state[free] = BLOCKED, FREE
        self._last_seen[shown != 0] = self.n_episodes
        self._in_a_row[wall] += 1
        self._in_a_row[free] = 0
        self._times_free[free] += 1

    @property
    def _since(self) -> npt.NDArray[np.int32]:
        """Return how many episodes ago each cell was seen last; all of them where it never was."""
        return self.n_episodes - self._last_seen

    @property
    def age(self) -> npt.NDArray[np.int32]:
        """Return how many episodes ago each cell was seen last, -1 where it never was."""
        age: npt.NDArray[np.int32] = np.where(
            self.state == UNKNOWN, -1, self._since)
        return age

    @property
    def outdated(self) -> npt.NDArray[np.bool_]:
        """
        Mark the cells last seen before a change of the world that was noticed since.

        What is not as it was seen last has changed since then; so may have whatever else was not
        seen in the episode that shows it. Surprises that one change explains are one change.
        """
        outdated: npt.NDArray[np.bool_] = (self.state != UNKNOWN) & (
            self._last_seen < self._changed_by)
        return outdated

    @property
    def certain_for(self) -> npt.NDArray[np.int64]:
        """
        Return for how many episodes a wall is certain after it was seen last, 0 elsewhere.

        What was never seen free, ``map_memory``, half of it when it was seen in one episode only;
        0 if something moved in it.
        What was seen free before may be so again: for 0, 1, 3, 7, ... episodes when it was seen
        occupied in 1, 2, 3, 4, ... of them in a row, at most ``map_memory``; for 1, 3, 7, 15, ...
        where it was seen free in one episode only.
        """
        in_a_row = np.minimum(self._in_a_row, _MOST_IN_A_ROW).astype(np.int64)
        halved = -(-self.map_memory // 2)
        glimpsed = np.where(self._is_passing, 0, halved)
        ever_a_wall = np.where(in_a_row == 1, glimpsed, self.map_memory)
        # Room that was seen in one episode only may have been a glimpse, too.
        sightings = in_a_row + (self._times_free == 1)
        once_free = np.minimum((1 << np.maximum(sightings - 1, 0)) - 1, self.map_memory)
        certain: npt.NDArray[np.int64] = np.where(
            self.state != BLOCKED, 0, np.where(self._times_free > 0, once_free, ever_a_wall))
        return certain

    @property
    def strength(self) -> npt.NDArray[np.float64]:
        """
        Return how much speaks for each wall, 0 for what is none: 99 where doubt begins.

        It falls with age as ``1 / (age + 1)``; more than 99 is certain.
        """
        strength: npt.NDArray[np.float64] = np.where(
            self.state == BLOCKED,
            _HIGHEST * (self.certain_for + 1.0) / (self._since + 1.0), 0.0)
        return strength

    @property
    def known(self) -> npt.NDArray[np.int8]:
        """
        Return the remembered map: -1 never seen, 0 free, 100 occupied, 1 to 99 doubted.

        A doubted cell was occupied when it was seen last; the number is the confidence that it
        still is.
        """
        if not self.map_memory:
            return self.state.copy()
        doubted = (self.state == BLOCKED) & (self._since >= self.certain_for)
        confidence = np.clip(np.floor(self.strength), _LOWEST, _HIGHEST).astype(np.int8)
        known: npt.NDArray[np.int8] = np.where(doubted, confidence, self.state)
        return known
