"""What the poses of a drive cannot tell: it is said, not kept in silence."""

from collections.abc import Sequence
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import Break, BreakKind
from control_field.drives.dead_reckoning import DeadReckoning
from control_field.drives.speeds import period
from control_field.poses import possible_turn
from control_field.words import counted

Floats = npt.NDArray[np.float64]

#: Driving is compared over so long, [s]; this share of it is as fast as it usually is, and far
#: faster is so many times that, and at least so fast, [m/s].
_SPAN, _USUAL, _FAR, _SLOWEST = 1.0, 0.8, 2.0, 0.2
#: Shorter ways are no driving, [m].
_DRIVEN: Final = 0.02
#: A frame that turns by more than this is another frame, [rad].
_TURN: Final = math.pi / 3.0


def haste(stamps: Floats, xy: Floats, pose_jump: float) -> Break | None:
    """
    Return where a drive is for a second far faster than elsewhere; None if nowhere.

    A filter that smears a leap looks so where nothing but places is known, and so does a robot
    that hastes.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    pose_jump : float, [m]
        How far a pose may be off.

    """
    lag = max(round(_SPAN / max(period(stamps), 1e-3)), 1)
    if len(stamps) <= 2 * lag:
        return None
    seconds = np.maximum(stamps[lag:] - stamps[:-lag], 1e-9)
    way = np.hypot(*(xy[lag:] - xy[:-lag]).T)
    driven = way > _DRIVEN
    usual = float(np.quantile(way[driven] / seconds[driven], _USUAL)) if driven.any() else 0.0
    excess = way - pose_jump - max(_FAR * usual, _SLOWEST) * seconds
    worst = int(excess.argmax())
    if excess[worst] <= 0.0:
        return None
    before, after = (xy[i].tolist() for i in (worst, worst + lag))
    span = float(seconds[worst])
    return Break(BreakKind.HASTE, worst + lag, float(stamps[worst + lag] - stamps.min()), span,
                 (before[0], before[1]), (after[0], after[1]), usual * span)


def first_doubt(found: Sequence[Break]) -> str:
    """Say what is odd at the first of some places, and how many more there are."""
    if not found:
        return ''
    more = f' (and {counted(len(found) - 1, "more such place")})' if len(found) > 1 else ''
    return found[0].doubt + more


def unseen(dt: float, leap: float, said: DeadReckoning | None) -> str:
    """
    Say which resets and corrections would not show in a drive; empty where all would.

    Parameters
    ----------
    dt : float, [s]
        From pose to pose.
    leap : float, [m]
        Greatest leap that passes for driving; 0 if it does no harm.
    said : DeadReckoning or None
        What came with the poses, as far as it fits them.

    """
    turn = possible_turn(dt) if said is not None and said.has_headings else 0.0
    hidden = [f'leap by up to {leap:.2f} m'] if leap > 0.0 else []
    if turn > _TURN:
        hidden.append('turn' if turn >= math.pi else
                      f'turn by up to {math.degrees(turn):.0f} degrees')
    if not hidden:
        return ''
    return (f'with a pose every {dt:.2g} s nobody can tell whether its odometry was reset or '
            f'corrected under way: it may {" or ".join(hidden)} from one to the next and look '
            f'like driving')


def missing_evidence(said: DeadReckoning | None) -> str:
    """Say what did not help to tell a drive from a broken one; empty if all there can be did."""
    if said is None:
        return 'no headings or speeds fit the poses, so that only they tell leaps from driving'
    return '' if said.has_speeds else ('no speeds fit the poses, so that a correction that is '
                                       'spread over seconds may look like driving')
