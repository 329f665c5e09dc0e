"""Whether a robot was where the decisions of a trial say, by its odometry."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import BreakKind, place_text
from control_field.drives.plausibility import breaks_of, DriveLimits
from control_field.grid import Grid

Floats = npt.NDArray[np.float64]

#: The robot was in a cell of a decision within so many seconds of it: local grid lags, stamps
#: differ.
_AROUND: Final = 1.0
#: How far off the cell it may have been, in cells, and at least, [m].
_BESIDE, _LEAST_BESIDE = 0.3, 0.05
#: A place that is mended (by local grid or a localisation) may be off the odometry: by so much,
#: [m], and by so much of the way driven more; only a robot that has come so many cells tells that.
_MENDED, _DRIFT, _FEWEST_CELLS = 1.5, 0.25, 2.0


def doubt_about_trial(
    decisions: npt.NDArray[np.void], stamps: Floats, xy: Floats, grid: Grid, speed_max: float,
) -> str:
    """
    Say why the decisions of a trial and the odometry beside them do not belong together.

    Parameters
    ----------
    decisions : ndarray of DECISION_DTYPE, shape (m,)
        In the order they were made.
    stamps : ndarray, shape (n,), [s]
        Of the odometry, in the order in which it was recorded.
    xy : ndarray, shape (n, 2), [m]
    grid : Grid
    speed_max : float, [m/s]
        The robot is no faster.

    Returns
    -------
    str
        Empty if they do.

    """
    if not len(decisions):
        return ''
    order = np.argsort(stamps, kind='stable')
    stamps, xy = stamps[order], xy[order]
    start = float(stamps[0]) if len(stamps) else 0.0
    during = (stamps >= decisions['stamp'].min() - _AROUND) & (
        stamps <= decisions['stamp'].max() + _AROUND)
    if not during.any():
        return 'no odometry was recorded with it, so that nothing shows where the robot was'
    stamps, xy = stamps[during], xy[during]
    limits = DriveLimits(grid.resolution, speed_max)
    # What is missing was lost on the way to the recorder; the robot itself had it.
    broken = [found for found in breaks_of(stamps, xy, limits)
              if found.kind is not BreakKind.HOLE]
    if broken:
        return f'its odometry is not that of one robot: {broken[0]}'
    return _misplaced(decisions, stamps, xy, grid, start)


def _misplaced(
    decisions: npt.NDArray[np.void], stamps: Floats, xy: Floats, grid: Grid, start: float,
) -> str:
    """Say which decision was made in a cell that the robot was not in; empty if none was."""
    centres = grid.world_from_cells(np.stack([decisions['row'], decisions['col']], axis=1))
    at = decisions['stamp']
    nearest = _nearest(stamps, at)
    known = np.abs(stamps[nearest] - at) <= _AROUND
    if not known.any():
        return 'no odometry was recorded with it, so that nothing shows where the robot was'
    beside = max(_BESIDE * grid.resolution, _LEAST_BESIDE)
    off = np.array([_off_cell(centre, stamps, xy, when, grid.resolution)
                    for centre, when in zip(centres, at.tolist(), strict=True)])
    wrong = known & (off > beside)
    if not wrong.any() or _is_mended(centres[known], xy[nearest[known]], stamps, xy, grid):
        return ''
    first = int(wrong.argmax())
    where = (float(xy[nearest[first], 0]), float(xy[nearest[first], 1]))
    return (f'its decisions do not fit where the robot was: at {at[first] - start:.2f} s one is '
            f'made at {place_text(tuple(centres[first].tolist()))}, where odometry says '
            f'{place_text(where)} ({int(wrong.sum())} of {len(at)} decisions are such)')


def _nearest(stamps: Floats, at: Floats) -> npt.NDArray[np.int64]:
    """Return the index of the odometry nearest in time to each decision."""
    after = np.clip(np.searchsorted(stamps, at), 1, max(len(stamps) - 1, 1))
    after = np.minimum(after, len(stamps) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(at - stamps[before] <= stamps[after] - at, before, after).astype(np.int64)


def _off_cell(centre: Floats, stamps: Floats, xy: Floats, at: float, side: float) -> float:
    """Return how near the robot came to a cell around a moment, [m]; 0 if it was in it."""
    low, high = np.searchsorted(stamps, (at - _AROUND, at + _AROUND), side='left')
    away = np.maximum(np.abs(xy[low:high] - centre) - side / 2.0, 0.0)
    return float(away.max(axis=1).min(initial=np.inf))


def _is_mended(
    centres: Floats, places: Floats, stamps: Floats, xy: Floats, grid: Grid,
) -> bool:
    """
    Return whether one offset, and the drift of wheels, explains all places of a trial.

    The controller may mend its place by local grid or by a localisation; what is recorded is raw.
    """
    way = float(np.hypot(*np.diff(xy, axis=0).T).sum())
    span = float(np.ptp(centres, axis=0).max()) + grid.resolution
    offsets = centres - places
    base = np.median(offsets, axis=0)
    loose = np.abs(offsets - base).max()
    return bool(
        np.hypot(*np.ptp(xy, axis=0)) >= _FEWEST_CELLS * grid.resolution
        and np.abs(base).max() <= _MENDED and way >= 0.5 * span
        and loose <= grid.resolution + _DRIFT * way)
