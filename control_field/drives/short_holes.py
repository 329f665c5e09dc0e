"""
Holes across which what comes with the poses leads: the way through them is known all the same.

For a second or two without a pose a robot may be trusted that says, before and after, how fast it
drives and where it looks, if driving on so from the one leads to the other.
"""


import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import place_text
from control_field.drives.dead_reckoning import DeadReckoning, Motion

Floats = npt.NDArray[np.float64]

#: A hole lasts no longer, [s], and is no wider, [m].
_LONGEST, _WIDEST = 2.0, 1.0
#: The robot turns no farther in it, [rad]; what leads elsewhere is off by more, [m].
_TURN, _OFF = 0.5, 0.1


def led_across(
    stamps: Floats, xy: Floats, motion: Motion | None, said: DeadReckoning | None,
) -> npt.NDArray[np.bool_]:
    """
    Return between which poses the robot surely drove straight on.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    motion : Motion or None
    said : DeadReckoning or None
        What of it is to be trusted.

    Returns
    -------
    ndarray of bool, shape (n - 1,)

    """
    if motion is None or said is None or not (said.has_speeds and said.has_headings):
        return np.zeros(max(len(stamps) - 1, 0), dtype=np.bool_)
    done, way = np.diff(xy - said.swing, axis=0), np.diff(said.way, axis=0)
    turn = np.abs(np.angle(np.exp(1j * np.diff(motion.yaw))))
    return np.asarray(
        (np.diff(stamps) <= _LONGEST) & (np.hypot(*done.T) <= _WIDEST) & (turn <= _TURN)
        & (np.hypot(*(done - way).T) <= _OFF))


def sentence_on_holes(
    stamps: Floats, xy: Floats, holes: npt.NDArray[np.int64],
) -> str:
    """Say where the way through some holes was filled in; empty if there is none."""
    if not len(holes):
        return ''
    i = int(holes[0])
    since = stamps - stamps.min()
    places = ' to '.join(place_text((float(x), float(y))) for x, y in xy[i:i + 2])
    more = f' (and {len(holes) - 1} more)' if len(holes) > 1 else ''
    return (f'no pose has come between {since[i]:.2f} and {since[i + 1]:.2f} s{more}: the way '
            f'there, {float(np.hypot(*(xy[i + 1] - xy[i]))):.2f} m from {places}, is filled in, '
            f'as speeds and headings before and after lead straight across')
