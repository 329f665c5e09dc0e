"""
What poses say of the thing that moved: a robot on wheels drives on a floor, where it looks.

What leaves the floor is no drive of one and refused; what else is odd is learnt, and said.
"""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError
from msgs_bridge.sensing.rigid_motions import Motions

Floats = npt.NDArray[np.float64]

#: Motion is looked at over so long, [s].
_STRIDE: Final = 1.0
#: Strides shorter than this share of the long ones, or than so much, [m], are no motion.
_SHORT, _STILL = 0.25, 0.02
#: No floor is steeper, rise by run; a rise on the spot by so much, [m], is no driving.
_STEEPEST, _LIFT = 0.5, 0.4
#: What leans by more than this cosine, or difference of cosines, and climbs by so much, [m], or
#: such a share of how far it gets, turns about another axis than z.
_TILT, _HIGH, _STEEP = 0.5, 0.3, 0.1
#: A share of the way that goes aside, and sines from which on it does.
_ASIDE, _SIDEWAYS = 0.2, 0.7
#: Headings that differ by less over a drive, [rad], were not measured.
_TURNS: Final = 1e-3
#: Headings are turned against the way by more, [rad], all alike (a mean resultant length).
_TURNED, _ALIKE = math.radians(30.0), 0.9


def doubts_about_motion(seconds: Floats, motions: Motions, frame_id: str) -> list[str]:
    """
    Return sentences on what is odd about the motion of a robot on wheels.

    Parameters
    ----------
    seconds : ndarray, shape (n,), [s]
        In any order.
    motions : Motions
        Of the robot's middle, in ``frame_id``.
    frame_id : str

    Raises
    ------
    BagError
        If it does not move on the floor of its frame.

    """
    order = np.argsort(seconds, kind='stable')
    order = order[np.isfinite(motions.shift[order]).all(axis=1)]
    first, last = _strides(seconds[order])
    if not len(first):
        return []
    places, yaw = motions.shift[order], motions.yaw[order]
    steps = places[last] - places[first]
    length = np.linalg.norm(steps, axis=1)
    moved = length > max(_SHORT * float(np.percentile(length, 90)), _STILL)
    if not moved.any():
        return []
    turn = motions.turn[order]
    _check_floor(places, steps[moved], turn, frame_id)
    middle = yaw[(first[moved] + last[moved]) // 2]
    return list(filter(None, [
        _lift(steps[moved]), _tipped(seconds[order], turn), _upside_down(turn, frame_id),
        _aside(steps[moved], middle, yaw)]))


def _strides(seconds: Floats) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return indices between which a second lies, one stride after the other."""
    if len(seconds) < 2:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    at = np.arange(seconds[0], seconds[-1], _STRIDE)[:1_000_000]
    edges = np.unique(np.append(np.searchsorted(seconds, at), len(seconds) - 1))
    return edges[:-1], edges[1:]


def _check_floor(places: Floats, steps: Floats, turn: Floats, frame_id: str) -> None:
    """Refuse what climbs, the sooner if it turns about other axes than z."""
    rise, run = float(np.abs(steps[:, 2]).sum()), float(np.hypot(*steps[:, :2].T).sum())
    (wide, deep, high) = np.ptp(places, axis=0)
    turns_over = _tilts(turn) and high > max(_HIGH, _STEEP * max(wide, deep))
    if rise <= _STEEPEST * run and not turns_over:
        return
    (x, y, z), (high_x, high_y, high_z) = places.min(axis=0), places.max(axis=0)
    raise BagError(
        f'it does not drive on the floor of {frame_id!r}: there x goes from {x:.2f} to '
        f'{high_x:.2f} m, y from {y:.2f} to {high_y:.2f} m and z, which is height, from {z:.2f} '
        f'to {high_z:.2f} m. A frame of cameras has z ahead: name one whose z is up with --frame, '
        f'if /tf leads there, or other poses with --odom-topic. What flies or climbs cannot be '
        f'learnt')


def _lift(steps: Floats) -> str:
    run = np.hypot(*steps[:, :2].T)
    lift = float(np.abs(steps[:, 2])[np.abs(steps[:, 2]) > np.maximum(run, _STILL)].sum())
    return '' if lift < _LIFT else (
        f'it rises and sinks by {lift:.1f} m on the spot, as no robot on wheels does: its way in '
        f'x and y is learnt, its height is not')


def _up(turn: Floats) -> Floats:
    """Return the cosine between z of the frame and z of what turns in it."""
    return np.asarray(1.0 - 2.0 * (turn[:, 0] ** 2 + turn[:, 1] ** 2))


def _tilts(turn: Floats) -> bool:
    return bool(np.ptp(np.percentile(_up(turn), (5.0, 95.0))) > _TILT)


def _tipped(seconds: Floats, turn: Floats) -> str:
    """Say from when on a robot leans too far that stood upright at first."""
    up = _up(turn)
    if not _tilts(turn) or up[0] < _TILT:
        return ''
    return (f'from {seconds[up < _TILT][0]:.1f} s on it leans by more than 60 degrees, as if it '
            f'had tipped over: its way is learnt all the same; --to leaves out what is no drive')


def _upside_down(turn: Floats, frame_id: str) -> str:
    up = float(np.median(_up(turn)))
    is_named = 'ned' in frame_id.lower().replace('/', '_').split('_')
    return '' if up > -0.5 and not is_named else (
        f'z of {frame_id!r} or of the robot points down, as in NED: x and y are learnt as they '
        f'are; to drive by what is learnt the controller needs the same odometry, with z up and '
        f'turns to the left counted positive')


def _aside(steps: Floats, middle: Floats, yaw: Floats) -> str:
    """Say that it moves sideways, or looks beside its way all the time."""
    if np.ptp(yaw) <= _TURNS:
        return ''
    length = np.hypot(*steps[:, :2].T)
    off = np.arctan2(steps[:, 1], steps[:, 0]) - middle
    # Backwards is a way to drive, too.
    mean = (length * np.exp(2j * off)).sum() / max(float(length.sum()), 1e-9)
    turned = 0.5 * float(np.angle(mean))
    if abs(mean) > _ALIKE and abs(turned) > _TURNED:
        return (f'it always looks {math.degrees(abs(turned)):.0f} degrees beside the way it goes: '
                f"its headings are those of another frame than the robot's, such as a camera's; "
                f'only places are learnt')
    share = float(length[np.abs(np.sin(off)) > _SIDEWAYS].sum() / max(length.sum(), 1e-9))
    return '' if share <= _ASIDE else (
        f'it goes sideways for {share:.0%} of its way, as no robot with two driven wheels does: '
        f'the places are learnt, and that robot has to turn instead')
