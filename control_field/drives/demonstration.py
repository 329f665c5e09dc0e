"""From a drive to a demonstration: the cells a person drove through, without the idling."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from control_field.drives.dead_reckoning import Motion
from control_field.drives.loops import Loop, loops_of, sentence_from_loops
from control_field.drives.plausibility import DriveLimits, SPEED_MAX, whole_drive
from control_field.drives.tight_end import n_before_tight_end, sentence_from_tight_end
from control_field.drives.workspace import check_inside, check_near
from control_field.grid import Grid
from control_field.records import Demonstration
from control_field.words import counted

#: A cell is left only this far beyond its edge, as a share of its side: a diagonal drive that
#: grazes a corner is a diagonal step, and jitter on an edge, or a drive along it, is no step.
_MARGIN = 0.2
#: Closer than this to the first (the last) pose, in cells, the drive has not begun (is over).
_STILL = 0.02
#: Slower than this is standing still, [cells/s]; a speed, whatever the rate of the poses.
_STANDING = 0.01
#: Between places so many cells apart, or fewer, the way is filled in diagonally first.
_SHORT = 3
#: Poses looked at in one go when the next cell is searched.
_BLOCK = 256


class TooShortError(ValueError):
    """
    A drive does not leave its first cell.

    Parameters
    ----------
    message : str
    reach : float, [m]
        How far it gets from where it began.

    """

    def __init__(self, message: str, reach: float) -> None:
        """Keep both."""
        super().__init__(message)
        self.reach = reach


@dataclass(frozen=True)
class DemonstrationReport:
    """
    What became of the poses of a drive.

    Parameters
    ----------
    n_poses : int
        Poses given.
    n_outside : int
        Poses on the very edge outside the workspace, or that are no numbers; dropped.
    n_idle_start, n_idle_end : int
        Poses before the first and after the last motion, dropped.
    n_standing : int
        Poses in between at which the robot stood still; not learnt.
    n_filled : int
        Cells put in where two poses lay more than a cell apart.
    n_crossings : int
        Cells driven through more than once; the last time wins.
    n_cells : int
        Cells of the demonstration.
    start : float, [s]
        Stamp of the first pose.
    loops : tuple of Loop
        What leads back to where the robot had been: it is cut out.
    cuts : tuple of str
        Sentences on poses that were left out because no robot drives so, and on what is in doubt.
    missing_evidence : str
        What did not help to tell it from a broken drive; empty if all there can be did.

    """

    n_poses: int
    n_outside: int
    n_idle_start: int
    n_idle_end: int
    n_standing: int
    n_filled: int
    n_crossings: int
    n_cells: int
    start: float = 0.0
    loops: tuple[Loop, ...] = ()
    cuts: tuple[str, ...] = ()
    missing_evidence: str = ''

    @property
    def n_erased(self) -> int:
        """Return how many cells of the demonstration are cut out with its loops."""
        return sum(loop.n_cells for loop in self.loops)

    @property
    def n_steps(self) -> int:
        """Return how many steps from cell to cell are left to learn."""
        return max(self.n_cells - self.n_erased - 1, 0)

    def sentences(self) -> list[str]:
        """Say what of the drive is not learnt, and where that was."""
        loops = sentence_from_loops(self.loops, self.n_cells, self.start)
        return [*([loops] if loops else []), *self.cuts]

    def __str__(self) -> str:
        """Say all of it, numbers first."""
        return ', '.join([self.numbers(), *self.sentences()])

    def numbers(self) -> str:
        """Count what became of the poses; what did not happen is left out."""
        parts = [f'{counted(self.n_cells, "cell")} from {counted(self.n_poses, "pose")}']
        for count, noun, what in (
                (self.n_idle_start, 'pose', 'of standing still at the start dropped'),
                (self.n_idle_end, 'pose', 'of standing still at the end dropped'),
                (self.n_standing, 'pose', 'of standing still in between not learnt'),
                (self.n_outside, 'pose', 'on the edge outside the workspace dropped'),
                (self.n_filled, 'cell', 'filled in between poses far apart')):
            if count:
                parts.append(f'{counted(count, noun)} {what}')
        if self.missing_evidence:
            parts.append(self.missing_evidence)
        return ', '.join(parts)


def demonstration_from_poses(
    grid: Grid, stamps: npt.NDArray[np.float64], xy: npt.NDArray[np.float64],
    local_grid_stamps: npt.NDArray[np.float64], local_grid_blocked: npt.NDArray[np.uint8],
    local_grid_unknown: npt.NDArray[np.uint8], episode: int = 0, speed_max: float = SPEED_MAX,
    local_grid_cells: npt.NDArray[np.int64] | None = None, motion: Motion | None = None,
    fitted: bool = False,
) -> tuple[Demonstration, DemonstrationReport]:
    """
    Turn a recorded drive into a demonstration.

    Parameters
    ----------
    grid : Grid
    stamps : ndarray, shape (n,), [s]
        Of the poses, in the order in which they were recorded.
    xy : ndarray, shape (n, 2), [m]
        Positions.
    local_grid_stamps, local_grid_blocked, local_grid_unknown : ndarray, shape (m,)
        The 3x3 local grids seen under way and their stamps, not decreasing; may be empty.
    episode : int
        Number of the bag.
    speed_max : float, [m/s]
        The robot is no faster.
    local_grid_cells : ndarray, shape (m, 2), optional
        Cells that the local grids were seen from; what was seen from elsewhere counts for nothing.
    motion : Motion, optional
        Headings and speeds that came with the poses.
    fitted : bool
        Whether the workspace fits itself: the drive may leave ``grid``, whose cells then go on
        outside it, negative ones too.

    Raises
    ------
    ImplausibleDriveError
        If no robot can have driven so.
    OutsideWorkspaceError
        If the drive leaves a workspace that does not fit itself.
    TooShortError
        If fewer than two cells are left; the message says what was dropped.

    """
    n_poses = len(stamps)
    finite = np.isfinite(xy).all(axis=1) & np.isfinite(stamps)
    stamps, xy = stamps[finite], xy[finite]
    motion = None if motion is None else motion.at(finite)
    drive = whole_drive(stamps, xy, DriveLimits(grid.resolution, speed_max), motion)
    begins = float(stamps.min()) if len(stamps) else 0.0
    stamps, xy = stamps[drive.kept], xy[drive.kept]
    raw = grid.cells_from_world(xy) if len(xy) else np.zeros((0, 2), dtype=np.int64)
    if fitted:
        check_near(grid, raw)
    else:
        check_inside(grid, stamps, xy)
    inside = fitted | (raw >= 0).all(axis=1) & (raw < np.array(grid.shape)).all(axis=1)
    n_outside = int((~finite).sum() + (~inside).sum())
    stamps, xy, raw = stamps[inside], xy[inside], raw[inside]
    start, end, n_standing = _moving_span(stamps, xy / grid.resolution)
    n_idle = (start, len(xy) - end)
    stamps, xy, raw = stamps[start:end], xy[start:end], raw[start:end]
    entered = _entries(grid, xy, raw)
    path, at, filled = _connected(raw[entered], stamps[entered])
    cells = np.array(path, dtype=np.int32).reshape(-1, 2)
    there = seen_from(local_grid_stamps, local_grid_cells, stamps, raw)
    n_free = n_before_tight_end(
        cells, at, local_grid_stamps[there],
        None if local_grid_cells is None else local_grid_cells[there], local_grid_blocked[there])
    cuts = drive.sentences()
    if n_free < len(cells):
        cuts.append(sentence_from_tight_end(grid, path[n_free - 1], path[-1]))
        cells, at, filled, path = cells[:n_free], at[:n_free], filled[:n_free], path[:n_free]
    report = DemonstrationReport(
        n_poses, n_outside, n_idle[0], n_idle[1], n_standing, int(filled.sum()),
        len(path) - len(set(path)), len(path), begins,
        loops_of(cells, at, grid.world_from_cells(cells)), tuple(cuts), drive.missing_evidence)
    if len(path) < 2:
        reach = float(np.hypot(*(xy - xy[:1]).T).max(initial=0.0))
        raise TooShortError(
            f'nothing to learn from this drive: it gets {reach:.2f} m away from where it began, '
            f'and leads through {counted(len(path), "cell")} of {grid.resolution:g} m ({report}); '
            f'drive at least from one cell into the next', reach)
    blocked, unknown = _local_grids(
        at, local_grid_stamps[there], local_grid_blocked[there], local_grid_unknown[there])
    blocked[filled], unknown[filled] = 0, 255
    return Demonstration(cells, at, blocked, unknown, episode), report


def _moving_span(
    stamps: npt.NDArray[np.float64], xy: npt.NDArray[np.float64],
) -> tuple[int, int, int]:
    """
    Return the first and one past the last moving pose, and how many stand in between.

    ``xy`` is in cells.
    """
    if len(xy) < 2:
        return 0, len(xy), 0
    begun = np.hypot(*(xy - xy[0]).T) > _STILL
    going = np.hypot(*(xy - xy[-1]).T) > _STILL
    # Where jitter is wider than that, it may be so of one of the two only.
    if not (begun.any() and going.any()):
        return 0, 1, 0
    first, last = int(begun.argmax()) - 1, len(xy) - int(going[::-1].argmax())
    way = np.hypot(*np.diff(xy[first:last + 1], axis=0).T)
    stands = way <= _STANDING * np.maximum(np.diff(stamps[first:last + 1]), 0.0)
    return first, last + 1, int(stands.sum())


def _entries(
    grid: Grid, xy: npt.NDArray[np.float64], raw: npt.NDArray[np.int64],
) -> npt.NDArray[np.int64]:
    """Return the indices of the poses at which the drive has surely entered another cell."""
    if len(xy) == 0:
        return np.zeros(0, dtype=np.int64)
    kept = [0]
    while True:
        centre = np.array(grid.world_from_cell(*raw[kept[-1]].tolist()))
        index = _first_away(xy, kept[-1] + 1, centre, (0.5 + _MARGIN) * grid.resolution)
        if index == len(xy):
            break
        kept.append(index)
    if (raw[-1] != raw[kept[-1]]).any():
        kept.append(len(xy) - 1)
    return np.array(kept, dtype=np.int64)


def _first_away(
    xy: npt.NDArray[np.float64], first: int, centre: npt.NDArray[np.float64], reach: float,
) -> int:
    """Return the first index from ``first`` on outside a square; ``len(xy)`` if there is none."""
    for start in range(first, len(xy), _BLOCK):
        away = np.abs(xy[start:start + _BLOCK] - centre).max(axis=1) > reach
        if away.any():
            return start + int(away.argmax())
    return len(xy)


def _connected(
    cells: npt.NDArray[np.int64], stamps: npt.NDArray[np.float64],
) -> tuple[list[tuple[int, int]], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Fill gaps between cells with straight steps; return which cells were filled in."""
    path: list[tuple[int, int]] = []
    at: list[float] = []
    filled: list[bool] = []
    for (row, col), stamp in zip(cells.tolist(), stamps.tolist(), strict=True):
        last = path[-1] if path else (row, col)
        rows, cols = row - last[0], col - last[1]
        n_steps = max(abs(rows), abs(cols))
        for k in range(1, n_steps):
            path.append((last[0] + _share(rows, k, n_steps), last[1] + _share(cols, k, n_steps)))
            at.append(stamp)
            filled.append(True)
        path.append((row, col))
        at.append(stamp)
        filled.append(False)
    return path, np.array(at), np.array(filled, dtype=np.bool_)


def _share(much: int, step: int, n_steps: int) -> int:
    """Return how far one of some steps leads in a row or column."""
    whole = abs(much)
    share = min(step, whole) if n_steps <= _SHORT else (
        2 * whole * step + n_steps) // (2 * n_steps)
    return share if much > 0 else -share


def seen_from(
    local_grid_stamps: npt.NDArray[np.float64], local_grid_cells: npt.NDArray[np.int64] | None,
    stamps: npt.NDArray[np.float64], raw: npt.NDArray[np.int64],
) -> npt.NDArray[np.bool_]:
    """
    Return which local grids were seen from where the robot was, or beside it.

    Parameters
    ----------
    local_grid_stamps : ndarray, shape (m,), [s]
    local_grid_cells : ndarray, shape (m, 2), or None
        Where they were seen from; None where that is not known, which is no reproach.
    stamps : ndarray, shape (n,), [s]
        Of the poses, not decreasing.
    raw : ndarray of int64, shape (n, 2)
        Their cells.

    """
    if local_grid_cells is None or not len(local_grid_stamps) or len(stamps) < 2:
        return np.ones(len(local_grid_stamps), dtype=np.bool_)
    after = np.clip(np.searchsorted(stamps, local_grid_stamps), 1, len(stamps) - 1)
    is_before = local_grid_stamps - stamps[after - 1] <= stamps[after] - local_grid_stamps
    off = local_grid_cells - raw[np.where(is_before, after - 1, after)]
    return np.asarray(np.abs(off).max(axis=1) <= 1)


def _local_grids(
    at: npt.NDArray[np.float64], stamps: npt.NDArray[np.float64],
    blocked: npt.NDArray[np.uint8], unknown: npt.NDArray[np.uint8],
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """Return the local grid that was newest when each cell was surely entered."""
    if len(stamps) == 0:
        return np.zeros(len(at), dtype=np.uint8), np.full(len(at), 255, dtype=np.uint8)
    index = np.searchsorted(stamps, at + 1e-9, side='right') - 1
    none = index < 0
    index = np.maximum(index, 0)
    seen, unseen = blocked[index].copy(), unknown[index].copy()
    seen[none], unseen[none] = 0, 255
    return seen, unseen
