"""Where two sources speak on one topic: places leap to and fro."""


import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import Break, break_between, BreakKind

Floats = npt.NDArray[np.float64]

#: Leaps to and fro from which on two sources speak, and their share of all leaps.
_FEWEST_TURNS, _TURNING = 7, 0.3


def two_sources(
    stamps: Floats, xy: Floats, has_breaks: bool, pose_jump: float,
) -> Break | None:
    """
    Return where poses leap to and fro, if they do so all the time.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    xy : ndarray, shape (n, 2), [m]
    has_breaks : bool
        Whether they make no drive, in order of time.
    pose_jump : float, [m]
        How far a pose may be off.

    """
    way = np.hypot(*np.diff(xy, axis=0).T)
    far = np.flatnonzero(way > pose_jump)
    there, back = far[:-1], far[1:]
    returns = np.hypot(*(xy[back + 1] - xy[there]).T) < 0.5 * np.minimum(way[there], way[back])
    share = _TURNING if has_breaks else 2.0 * _TURNING
    if returns.sum() >= max(_FEWEST_TURNS, share * len(far), 0.02 * len(xy)):
        first = int(there[returns.argmax()])
    else:
        turns = _turns(stamps, xy, pose_jump)
        if turns.sum() < max(_FEWEST_TURNS, 2.0 * _TURNING * len(turns)):
            return None
        first = int(turns.argmax())
    return break_between(BreakKind.SOURCES, first, first + 1, stamps, xy)


def _turns(stamps: Floats, xy: Floats, pose_jump: float) -> npt.NDArray[np.bool_]:
    """Return which poses lie far on one side of those around them, the next on the other one."""
    dt = np.maximum(np.diff(stamps), 0.0)
    share = (dt[:-1] / np.maximum(dt[:-1] + dt[1:], 1e-9))[:, np.newaxis]
    aside = xy[1:-1] - ((1.0 - share) * xy[:-2] + share * xy[2:])
    far = np.hypot(*aside.T) > pose_jump
    across = (aside[:-1] * aside[1:]).sum(axis=1)
    both = np.hypot(*aside[:-1].T) * np.hypot(*aside[1:].T)
    return np.asarray(far[:-1] & far[1:] & (across < -0.5 * both))
