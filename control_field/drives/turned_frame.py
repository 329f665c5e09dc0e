"""
Where the heading of a drive leaps, and with it the frame of all places that follow.

Odometry that is reset near its origin, and a localisation that finds itself turned, move no place
at first: what comes after is another drive all the same, turned.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import Break, BreakKind
from control_field.drives.speeds import period
from control_field.poses import TURN_JUMP, TURN_MAX

Floats = npt.NDArray[np.float64]

#: A robot may turn so many times as fast as in the steps beside.
_HASTE: Final = 2.0
#: A heading that stands for so long, [s], is one of a robot that does.
_RAREST: Final = 0.5
#: Poses on either side among which one that fits makes a leap a spike, and the share that fits.
_SPIKE, _FITS = 3, 0.5
#: Of strides of so long, [s], the few next ones that are driving, [m], lead no farther aside than
#: this share of them, where headings are to be believed.
_STRIDE, _FEW, _DRIVEN, _ASIDE = 0.5, 3, 0.02, 0.4
#: From so much on a leap of the heading is one of a robot that turns back, [rad].
_BACK: Final = 1.6
#: Around it a robot stands that moves no farther, [m], and creeps below that share of its speed.
_STILL, _SLOW = 0.01, 0.5
#: Whether the way goes on shows within this time, [s].
_SOON: Final = 0.15


def turned_frames(
    stamps: Floats, xy: Floats, yaw: Floats, swing: Floats | float = 0.0,
) -> list[Break]:
    """
    Return where the heading leaps by more than a robot turns in that time, and stays there.

    Where the robot creeps just then, and goes back the way it came, that is no more than a doubt
    (`Break.is_doubt`): a heading that is made from the way it goes leaps there. So it is where
    places go on as before: a frame that turns takes the way with it.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    yaw : ndarray, shape (n,), [rad]
        Headings that fit how the robot drives.
    swing : ndarray, shape (n, 2), [m], or 0
        Where the places lie beside what drives ahead, see `DeadReckoning.swing`.

    """
    dt, turn = np.diff(stamps), _wrapped(np.diff(yaw))
    # A heading that is measured more rarely than it is sent stands in between.
    dt = np.maximum(dt, min(period(stamps[1:][turn != 0.0]), _RAREST))
    rate = turn / np.maximum(dt, 1e-3)
    beside = np.abs(np.stack([np.roll(rate, 1), np.roll(rate, -1)]))
    beside[0, :1] = beside[1, -1:] = 0.0
    # A second leap beside it, to or fro, is no turning.
    beside[beside > 2.0 * TURN_MAX] = 0.0
    reach = TURN_JUMP + np.maximum(_HASTE * beside.max(axis=0), TURN_MAX) * dt
    found = [i for i in np.flatnonzero(np.abs(turn) > reach).tolist() if _stays(yaw, i)]
    wheels, whole = xy - swing, _at_one_go(turn, rate)
    stride = max(round(_STRIDE / max(period(stamps), 1e-3)), 1)
    return [_break(i, stamps, xy, float(turn[i]), (
        (abs(turn[i]) > _BACK and _is_slow(stamps, wheels, i))
        or _goes_on(stamps, wheels, i, float(whole[i])))) for i in found
            if _is_ahead(wheels[i + 1:], yaw[i + 1:], stride)
            and _is_ahead(wheels[i::-1], yaw[i::-1], stride)]


def _at_one_go(turn: Floats, rate: Floats) -> Floats:
    """Return by how much the heading turns with each step and those around it, as fast."""
    found = turn.copy()
    fast = np.sign(rate) * (np.abs(rate) > TURN_MAX)
    for run in np.split(np.arange(len(turn)), np.flatnonzero(np.diff(fast)) + 1):
        if len(run) and fast[run[0]]:
            found[run] = turn[run].sum()
    return found


def _stays(yaw: Floats, i: int) -> bool:
    """Return whether no heading soon after the leap is one of those soon before it."""
    before, after = yaw[max(i + 1 - _SPIKE, 0):i + 1], yaw[i + 1:i + 1 + _SPIKE]
    apart = np.abs(_wrapped(after[:, np.newaxis] - before))
    return bool(apart.min() > _FITS * abs(_wrapped(yaw[i + 1] - yaw[i])))


def _is_ahead(xy: Floats, yaw: Floats, stride: int) -> bool:
    """Return whether a robot drives on, first of all, and where it looks: else nothing turns."""
    done = np.diff(xy[::stride], axis=0)
    middle = yaw[:-stride:stride] + 0.5 * _wrapped(np.diff(yaw[::stride]))
    way = np.hypot(*done.T)
    first = np.flatnonzero(way > _DRIVEN)[:_FEW]
    if len(first) < _FEW:
        return False
    aside = np.cos(middle) * done[:, 1] - np.sin(middle) * done[:, 0]
    return bool(np.median(np.abs(aside[first]) / way[first]) < _ASIDE)


def _is_slow(stamps: Floats, xy: Floats, i: int) -> bool:
    """Return whether the robot creeps around a step, or that may be: it does not drive on."""
    if stamps[i + 1] - stamps[i] > 0.5 * _STRIDE:
        return True
    way, dt = np.hypot(*np.diff(xy, axis=0).T), np.maximum(np.diff(stamps), 1e-9)
    speed, around = way / dt, np.abs(stamps[:-1] - stamps[i]) <= _STRIDE
    usual = float(np.median(speed[way > 0.5 * np.percentile(way, 90)]))
    return bool(way[around].sum() > _STILL and speed[around].min() < _SLOW * usual)


def _goes_on(stamps: Floats, xy: Floats, i: int, turn: float) -> bool:
    """Return whether the way leads on as before a step, though the heading turns in it."""
    before = np.searchsorted(stamps, stamps[i] - _SOON)
    after = np.searchsorted(stamps, stamps[i + 1] + _SOON, side='right') - 1
    ways = np.array([xy[i] - xy[before], xy[after] - xy[i + 1]])
    if np.hypot(*ways.T).min() <= _STILL:
        return False
    bend = float(_wrapped(np.diff(np.arctan2(ways[:, 1], ways[:, 0])))[0])
    return abs(bend) < 0.5 * abs(turn)


def _wrapped(angle: Floats) -> Floats:
    return np.asarray(np.angle(np.exp(1j * angle)))


def _break(i: int, stamps: Floats, xy: Floats, turn: float, is_doubt: bool) -> Break:
    (x, y), (next_x, next_y) = xy[i].tolist(), xy[i + 1].tolist()
    return Break(BreakKind.TURNED, i + 1, float(stamps[i + 1] - stamps.min()),
                 float(stamps[i + 1] - stamps[i]), (x, y), (next_x, next_y), turn=turn,
                 is_doubt=is_doubt)
